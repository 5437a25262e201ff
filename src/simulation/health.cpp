#include "tissue_sim/simulation/health.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tissue_sim/simulation/integrator.h"

namespace tissue_sim {

namespace {

constexpr double speed_of_sound = 1500.0;  ///< m/s, the speed of sound in soft tissue
constexpr double organ_sizes = 10.0;       ///< times the organ's size

/// Vertices of which a step looks at everything, in turn: some 1 us a level. A million would cost more than the step.
constexpr std::size_t looked_at_in_turn = 256;

/// One vertex. Written so that a NaN fails.
bool healthy(const Vector3& rest, const Vector3& position, const Vector3& velocity, double limit) {
  return (position - rest).squaredNorm() < limit && velocity.squaredNorm() < speed_of_sound * speed_of_sound;
}

}  // namespace

bool runs_away(double speed) {
  return !(speed < speed_of_sound);
}

bool healthy(const OrganModel& model, const OrganState& state) {
  const RestShape& rest = model.rest;
  const double limit = organ_sizes * organ_sizes * rest.size * rest.size;
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

namespace {

bool is_number(double x) {
  return std::isfinite(x);
}
bool is_number(const Vector3& x) {
  return x.allFinite();
}

template <class Item>
bool are_numbers(const std::vector<Item>& items) {
  return std::all_of(items.begin(), items.end(), [](const Item& item) { return is_number(item); });
}

/// Of a row of doubles. The exponent of what is no number is all ones: one more runs into the sign. In integers, since
/// a loop over these goes through wide registers, and nothing traps.
bool are_numbers(const double* first, const double* last) {
  constexpr std::uint64_t exponent = 0x7ff0000000000000;
  constexpr std::uint64_t one = 0x0010000000000000;
  std::uint64_t signs = 0;
  for (; first != last; ++first) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, first, sizeof(bits));
    signs |= (bits & exponent) + one;
  }
  return signs >> 63 == 0;
}

const double* doubles_of(const double* items) {
  return items;
}
const double* doubles_of(const Vector3* items) {
  return reinterpret_cast<const double*>(items);
}

/// Of the vertices from `first` on whose turn it is.
template <class Item>
bool are_numbers_in_turn(const std::vector<Item>& items, std::size_t first, std::uint64_t turn) {
  if (first >= items.size()) return true;
  const std::size_t all = items.size() - first;
  const std::size_t count = std::min(all, looked_at_in_turn);
  const std::size_t begin = all > looked_at_in_turn ? static_cast<std::size_t>(turn * looked_at_in_turn % all) : 0;
  const std::size_t before_end = std::min(count, all - begin);  // the rest is at the start again
  const Item* start = items.data() + first;
  return are_numbers(doubles_of(start + begin), doubles_of(start + begin + before_end)) &&
         are_numbers(doubles_of(start), doubles_of(start + count - before_end));
}

/// What sleeps goes to where it sleeps.
template <class Sleeping>
void lay_down(const RestShape& shape, Sleeping& sleeping) {
  sleeping.positions = shape.positions;
  std::fill(sleeping.velocities.begin(), sleeping.velocities.end(), Vector3::Zero());
}

}  // namespace

bool remembers_numbers(const OrganState& state) {
  for (const Clearance& clearance : state.clearances) {
    if (!is_number(clearance.shift) || !is_number(clearance.turn)) return false;
  }
  for (const PlaceForce& place : state.pressing) {
    if (!is_number(place.force) || !is_number(place.stopping)) return false;
  }
  for (const std::vector<Vector3>& centres : state.centres) {
    if (!are_numbers(centres)) return false;
  }
  for (const LevelState& level : state.levels) {
    if (!is_number(level.ahead) || !is_number(level.speed)) return false;
  }
  return are_numbers(state.untouched) && is_number(state.stiffening);
}

bool remembers_numbers(const Clearance& clearance, const std::vector<int>& vertices) {
  return std::all_of(vertices.begin(), vertices.end(),
                     [&](int v) { return is_number(clearance.free_until[v]) && is_number(clearance.first_touch[v]); });
}

bool healthy_in_turn(const OrganModel& model, const OrganState& state, std::uint64_t turn) {
  const auto first = static_cast<std::size_t>(model.rest.first_simulated);
  const auto numbers = [turn](const auto& items, std::size_t from) { return are_numbers_in_turn(items, from, turn); };
  for (const Clearance& clearance : state.clearances) {
    if (!numbers(clearance.free_until, 0) || !numbers(clearance.first_touch, 0)) return false;
  }
  for (const LevelState& level : state.levels) {
    if (!numbers(level.positions, 0) || !numbers(level.velocities, 0)) return false;
    if (!numbers(level.push, 0)) return false;
  }
  return numbers(state.positions, first) && numbers(state.velocities, first) && numbers(state.forces, first) &&
         numbers(state.depths, 0);
}

void recover(const OrganModel& model, const OrganState& last_good, OrganState& state) {
  if (state.wakes_in_parts()) lay_down(model.rest, state);
  for (std::size_t level = 0; level < state.levels.size(); ++level) {
    LevelState& at = state.levels[level];
    lay_down(model.levels[level].shape, at);
    std::fill(at.push.begin(), at.push.end(), Vector3::Zero());
  }
  copy_state(model, last_good, state);
  std::fill(state.forces.begin(), state.forces.end(), Vector3::Zero());
  std::fill(state.depths.begin(), state.depths.end(), 0.0);
  std::fill(state.velocities.begin(), state.velocities.end(), Vector3::Zero());
  for (LevelState& level : state.levels) std::fill(level.velocities.begin(), level.velocities.end(), Vector3::Zero());
  state.stiffening = most_stiffening;
  for (Clearance& clearance : state.clearances) {
    if (are_numbers(clearance.free_until) && are_numbers(clearance.first_touch)) continue;
    clearance = Clearance(clearance.free_until.size());  // the copy was made before anything looked at it
  }
}

}  // namespace tissue_sim
