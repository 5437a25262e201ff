#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tissue_sim/geometry/instruction_set.h"
#include "tissue_sim/tissue/neo_hookean.h"

namespace tissue_sim {

/// Eight tetrahedra side by side: lane l of every array belongs to the l-th.
struct alignas(32) NeoHookeanBatch {
  static constexpr std::size_t lanes = 8;

  std::array<std::array<int, lanes>, 4> vertices;        ///< one row a corner
  std::array<std::array<float, lanes>, 9> inverse_rest;  ///< 1/m, row by row
  std::array<float, lanes> volume_mu;                    ///< J, rest volume times mu
  std::array<float, lanes> volume_stiff;                 ///< J, rest volume times lambda + mu
};

/// Tetrahedra in their given order, eight a batch. What is left free in the last batch repeats the last tetrahedron and
/// adds to no force.
struct NeoHookeanSolid {
  std::vector<NeoHookeanBatch> batches;
  std::size_t tetrahedra = 0;
};

NeoHookeanSolid pack(const std::vector<NeoHookeanElement>& elements);

/// Batches from `first` on.
struct BatchRange {
  std::size_t first = 0;
  std::size_t count = 0;
};

/// Adds the force (N) of every tetrahedron to its vertices, in single precision. `displacements` and `forces` hold four
/// floats a vertex, of which the fourth is not read and not changed (but -0 becomes 0).
///
/// A displacement is measured from the rest position (m): so a float keeps seven digits of the strain, most of which
/// the difference of two positions would lose. For damping in proportion to the stiffness with the time tau, pass x - X
/// + tau v. A displacement that is not finite spoils the forces on the tetrahedra it belongs to and no others. Numbers
/// below the smallest normal float count as zero.
///
/// Throws std::invalid_argument if `set` is not available; it is there for tests to force.
void add_neo_hookean_forces(const NeoHookeanSolid& solid, const float* displacements, float* forces,
                            InstructionSet set = instruction_set());

/// The same for some of the batches only, by their ascending indices: the same bits as if there were no others.
void add_neo_hookean_forces(const NeoHookeanSolid& solid, const std::vector<int>& batches, const float* displacements,
                            float* forces, InstructionSet set = instruction_set());
void add_neo_hookean_forces(const NeoHookeanSolid& solid, BatchRange batches, const float* displacements, float* forces,
                            InstructionSet set = instruction_set());

}  // namespace tissue_sim
