#include "tissue_sim/simulation/health.h"

namespace tissue_sim {

namespace {
constexpr double fastest = 1500.0;  ///< m/s, the speed of sound in soft tissue
constexpr double farthest = 10.0;   ///< times the organ's size
}  // namespace

namespace {

/// One vertex. Written so that a NaN fails.
bool healthy(const Vector3& rest, const Vector3& position, const Vector3& velocity, double limit) {
  return (position - rest).squaredNorm() < limit && velocity.squaredNorm() < fastest * fastest;
}

}  // namespace

bool healthy(const OrganModel& model, const OrganState& state) {
  const RestShape& rest = model.rest;
  const double limit = farthest * farthest * rest.size * rest.size;
  const auto sound = [limit](const RestShape& shape, const auto& at, std::size_t v) {
    return healthy(shape.positions[v], at.positions[v], at.velocities[v], limit);
  };
  if (!state.wakes_in_parts()) {
    for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < state.positions.size(); ++v) {
      if (!sound(rest, state, v)) return false;
    }
    return true;
  }
  for (const int v : state.region.free) {
    if (!sound(rest, state, static_cast<std::size_t>(v))) return false;
  }
  for (std::size_t level = 0; level < state.levels.size(); ++level) {
    for (const int v : state.levels[level].region.free) {
      if (!sound(model.levels[level].shape, state.levels[level], static_cast<std::size_t>(v))) return false;
    }
  }
  return true;
}

}  // namespace tissue_sim
