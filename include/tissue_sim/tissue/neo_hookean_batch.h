#pragma once

#include <array>
#include <cstddef>
#include <vector>

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

/// Which registers the forces are computed in. All give the same bits: the lanes do not meet, and forces are added in
/// the order of the tetrahedra.
enum class InstructionSet { baseline, avx2 };

/// Whether this build has code for it and this processor can run it. `baseline` always is.
bool available(InstructionSet set);

/// The fastest that is available.
InstructionSet instruction_set();

const char* name(InstructionSet set);

/// Adds the force (N) of every tetrahedron to its vertices, in single precision. `displacements` and `forces` hold four
/// floats a vertex, x y z 0. A displacement is measured from the rest position (m): a float carries the strain to seven
/// digits that way, where the difference of two positions would lose what the edge is smaller than the organ. To damp
/// with the time tau (stiffness-proportional), pass x - X + tau v.
/// `set` must be available; tests force it.
void add_neo_hookean_forces(const NeoHookeanSolid& solid, const float* displacements, float* forces,
                            InstructionSet set = instruction_set());

}  // namespace tissue_sim
