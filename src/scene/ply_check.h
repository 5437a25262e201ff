#pragma once

#include <string>

namespace tissue_sim {

/// What a PLY file lacks, empty if its header and every element that the header announces are there.
/// assimp 5.2 never comes back from some files that end too soon.
std::string missing_in_ply(const std::string& path);

}  // namespace tissue_sim
