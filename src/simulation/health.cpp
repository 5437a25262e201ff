#include "tissue_sim/simulation/health.h"

namespace tissue_sim {

namespace {
constexpr double fastest = 1500.0;  ///< m/s, the speed of sound in soft tissue
constexpr double farthest = 10.0;   ///< times the organ's size
}  // namespace

bool healthy(const RestShape& rest, const OrganState& state) {
  const double limit = farthest * farthest * rest.size * rest.size;
  for (std::size_t v = 0; v < state.positions.size(); ++v) {
    // Written so that a NaN fails.
    if (!((state.positions[v] - rest.positions[v]).squaredNorm() < limit)) return false;
    if (!(state.velocities[v].squaredNorm() < fastest * fastest)) return false;
  }
  return true;
}

}  // namespace tissue_sim
