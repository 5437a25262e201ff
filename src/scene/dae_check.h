#pragma once

#include <string>

namespace tissue_sim {

/// The part of a COLLADA file that a rigid shape needs, for assimp to read: `text` with all else blanked out
/// (materials, pictures, lights, cameras, animations, skeletons), so that none of it is parsed. assimp believes what
/// the file says of itself: counts, strides and offsets are held against the numbers that are there, and nodes that
/// lead back to themselves or multiply are refused. Throws std::runtime_error, `line: what is wrong`.
std::string checked_dae(std::string text);

}  // namespace tissue_sim
