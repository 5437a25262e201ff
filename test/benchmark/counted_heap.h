#pragma once

#include <cstddef>

namespace tissue_sim {

/// Of a program that is linked with this operator new, the libraries that it calls included: how often it has allocated
/// from the heap so far.
std::size_t counted_allocations();

/// Bytes that are allocated now.
std::size_t live_bytes();

/// The most bytes that were at once since forget_peak().
std::size_t peak_bytes();
void forget_peak();

}  // namespace tissue_sim
