#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tissue_sim/geometry/instruction_set.h"
#include "tissue_sim/geometry/lattice.h"
#include "tissue_sim/tissue/neo_hookean.h"

namespace tissue_sim {

/// Sixteen cubes of a lattice side by side: lane l of every array belongs to the l-th. Corners and tetrahedra are
/// numbered as in LatticeCube. The six tetrahedra of a cube share its corners and edges, so a cube reads and writes a
/// third of what they would by themselves, and needs none of their rest shapes.
struct alignas(64) CubeBatch {
  static constexpr std::size_t lanes = 16;

  std::array<std::array<int, lanes>, 8> vertices;        ///< one row a corner; of one that is not there, another
  std::array<std::array<float, lanes>, 3> slope;         ///< 1/m, one row an axis: 1 / edge, negative where mirrored
  std::array<std::array<float, lanes>, 6> volume_mu;     ///< J, rest volume times mu; 0: no such tetrahedron
  std::array<std::array<float, lanes>, 6> volume_stiff;  ///< J, rest volume times lambda + mu
};

/// Lanes that are left in the last batch repeat its last cube and add to no force.
struct LatticeCubes {
  std::vector<CubeBatch> batches;
  std::size_t cubes = 0;
};

/// The cubes of a lattice. `elements` are its tetrahedra, in their order.
LatticeCubes pack(const Lattice& lattice, const std::vector<NeoHookeanElement>& elements);

/// Adds a cube behind those that are there: the one in lane l of `from`.
void add_cube(const CubeBatch& from, std::size_t l, LatticeCubes& to);

/// Repeats the last cube in the lanes that are left.
void fill_last(LatticeCubes& cubes);

/// Adds the force (N) of every tetrahedron to its vertices: that of add_neo_hookean_forces(), with another rounding. A
/// displacement that is not finite spoils the forces on the cubes it belongs to and no others.
void add_cube_forces(const LatticeCubes& cubes, const float* displacements, float* forces,
                     InstructionSet set = instruction_set());

}  // namespace tissue_sim
