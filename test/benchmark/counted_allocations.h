#pragma once

#include <cstddef>

namespace tissue_sim {

/// How often this program, which is linked with a counting operator new, has allocated from the heap so far.
std::size_t counted_allocations();

}  // namespace tissue_sim
