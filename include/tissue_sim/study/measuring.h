#pragma once

#include <vector>

namespace tissue_sim {

/// s, of this thread: what else the machine does is no part of it.
double processor_seconds();

/// Of the values in order the one that is `fraction`, 0 to 1, of the way from the first to the last; 0 of none.
double percentile(std::vector<double> values, double fraction);

/// Bytes, the most of this process that was resident so far.
double most_resident();

}  // namespace tissue_sim
