#include "tissue_sim/simulation/state.h"

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
  for (const InstrumentPiece& piece : world.pieces) state.clearances.emplace_back(piece.surface.vertices.size());
  if (!model.levels.empty()) rest_levels(model, world.pieces.size(), state);
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

std::uint64_t hash_state(const OrganState& organ, std::uint64_t seed) {
  seed = hash_doubles(organ.positions.front().data(), 3 * organ.positions.size(), seed);
  seed = hash_doubles(organ.velocities.front().data(), 3 * organ.velocities.size(), seed);
  return hash_doubles(organ.depths.data(), organ.depths.size(), seed);
}

}  // namespace tissue_sim
