#include "tissue_sim/simulation/health.h"

#include <array>

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

/// Of at(0) .. at(count - 1), in sums side by side: one would wait for each addition.
template <class At>
double sum_of_squares(std::size_t count, const At& at) {
  std::array<double, 8> sums{};
  std::size_t i = 0;
  for (; i + sums.size() <= count; i += sums.size()) {
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += at(i + k) * at(i + k);
  }
  double sum = 0.0;
  for (; i < count; ++i) sum += at(i) * at(i);
  for (const double s : sums) sum += s;
  return sum;
}

/// Mostly all vertices together stay below what each of them may have, and that is quickly said.
bool surely_healthy(const RestShape& rest, const OrganState& state, double limit) {
  const auto first = static_cast<std::size_t>(rest.first_simulated);
  const std::size_t count = 3 * (state.positions.size() - first);
  if (count == 0) return true;
  const double* at_rest = rest.positions[first].data();
  const double* position = state.positions[first].data();
  const double* velocity = state.velocities[first].data();
  return sum_of_squares(count, [&](std::size_t i) { return position[i] - at_rest[i]; }) < limit &&
         sum_of_squares(count, [&](std::size_t i) { return velocity[i]; }) < fastest * fastest;
}

}  // namespace

bool healthy(const OrganModel& model, const OrganState& state) {
  const RestShape& rest = model.rest;
  const double limit = farthest * farthest * rest.size * rest.size;
  const auto sound = [limit](const RestShape& shape, const auto& at, std::size_t v) {
    return healthy(shape.positions[v], at.positions[v], at.velocities[v], limit);
  };
  if (!state.wakes_in_parts()) {
    if (surely_healthy(rest, state, limit)) return true;
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
