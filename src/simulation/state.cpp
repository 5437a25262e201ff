#include "tissue_sim/simulation/state.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "tissue_sim/simulation/levels.h"

namespace tissue_sim {

namespace {

/// Four chains side by side, since one would wait for each multiplication.
std::uint64_t hash_doubles(const double* values, std::size_t count, std::uint64_t seed) {
  std::array<std::uint64_t, 4> chains = {seed, seed + 1, seed + 2, seed + 3};
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, values + i, sizeof bits);
    chains[i % 4] = hash_word(bits, chains[i % 4]);
  }
  for (const std::uint64_t chain : chains) seed = hash_word(chain, seed);
  return seed;
}

}  // namespace

OrganState rest_state(const World& world, int organ) {
  const OrganModel& model = world.organs[organ];
  const std::size_t vertices = model.rest.positions.size();
  OrganState state;
  state.positions = model.rest.positions;
  state.velocities.assign(vertices, Vector3::Zero());
  state.forces.assign(vertices, Vector3::Zero());
  state.depths.assign(static_cast<std::size_t>(model.rest.surface_vertices), 0.0);
  if (!model.restoration) state.held.assign(vertices, 0);
  state.colliding.resize(world.pieces.size());
  if (model.colliding_set == CollidingSet::paper) {
    for (std::vector<char>& memory : state.colliding) memory.assign(vertices, 0);
  }
  state.touching.resize(world.pieces.size());
  for (std::vector<int>& touching : state.touching) touching.reserve(usual_contacts);
  for (const InstrumentPiece& piece : world.pieces) state.clearances.emplace_back(piece.surface.vertices.size());
  if (!model.regions.empty()) rest_levels(model, world.pieces.size(), state);
  state.pressing.reserve(usual_contacts);
  state.pressed.reserve(usual_contacts);
  state.asleep = world.gravity.isZero();
  return state;
}

State rest_state(const World& world) {
  State state;
  for (int organ = 0; organ < static_cast<int>(world.organs.size()); ++organ) {
    state.organs.push_back(rest_state(world, organ));
  }
  return state;
}

std::uint64_t hash_word(std::uint64_t word, std::uint64_t seed) {
  std::uint64_t mixed = (seed ^ word) * 0x9E3779B97F4A7C15ull;
  return mixed ^ (mixed >> 32);
}

std::uint64_t hash_state(const OrganModel& model, const OrganState& organ, std::uint64_t seed) {
  const auto first = static_cast<std::size_t>(model.rest.first_simulated);
  if (organ.wakes_in_parts()) {
    for (const int v : organ.region.free) {
      seed = hash_doubles(organ.positions[v].data(), 3, seed);
      seed = hash_doubles(organ.velocities[v].data(), 3, seed);
    }
    for (const LevelState& level : organ.levels) {
      for (const int v : level.region.free) {
        seed = hash_doubles(level.positions[v].data(), 3, seed);
        seed = hash_doubles(level.velocities[v].data(), 3, seed);
      }
    }
  } else {
    const std::size_t count = 3 * (organ.positions.size() - first);
    seed = hash_doubles(organ.positions[first].data(), count, seed);
    seed = hash_doubles(organ.velocities[first].data(), count, seed);
  }
  if (first == 0 && !organ.wakes_in_parts()) return hash_doubles(organ.depths.data(), organ.depths.size(), seed);
  for (const int triangle : organ.pressed) {
    for (const int v : model.rest.triangles[triangle]) seed = hash_doubles(&organ.depths[v], 1, seed);
  }
  return seed;
}

namespace {

void copy_region(const ActiveRegion& from, ActiveRegion& to) {
  for (const int v : to.active.vertices) to.mark[v] = Part::asleep;
  to.centres = from.centres;
  to.active = from.active;
  to.free = from.free;
  to.driven = from.driven;
  for (const int v : to.free) to.mark[v] = Part::free;
  for (const int v : to.driven) to.mark[v] = Part::driven;
}

}  // namespace

void copy_state(const OrganModel& model, const OrganState& from, OrganState& to) {
  if (from.wakes_in_parts()) {
    // What has fallen asleep since the copy was made has gone to where it sleeps.
    for (const int v : to.region.active.vertices) {
      to.positions[v] = from.positions[v];
      to.velocities[v] = from.velocities[v];
    }
    for (const int v : from.region.active.vertices) {
      to.positions[v] = from.positions[v];
      to.velocities[v] = from.velocities[v];
    }
    copy_region(from.region, to.region);
    for (std::size_t level = 0; level < from.levels.size(); ++level) {
      const LevelState& source = from.levels[level];
      LevelState& copy = to.levels[level];
      for (const int v : source.region.active.vertices) {
        copy.positions[v] = source.positions[v];
        copy.velocities[v] = source.velocities[v];
        copy.push[v] = source.push[v];
      }
      copy.ahead = source.ahead;
      copy.speed = source.speed;
      copy_region(source.region, copy.region);
    }
    to.centres = from.centres;
    to.untouched = from.untouched;
  } else {
    const auto first = static_cast<std::ptrdiff_t>(model.rest.first_simulated);
    std::copy(from.positions.begin() + first, from.positions.end(), to.positions.begin() + first);
    std::copy(from.velocities.begin() + first, from.velocities.end(), to.velocities.begin() + first);
  }
  to.held = from.held;
  to.colliding = from.colliding;
  to.touching = from.touching;
  to.clearances = from.clearances;
  to.pressing = from.pressing;
  to.stiffening = from.stiffening;
  to.asleep = from.asleep;
}

}  // namespace tissue_sim
