#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tissue_sim/tissue/neo_hookean_batch.h"

namespace tissue_sim {

/// Eight tetrahedra around one vertex, side by side: lane l of every array belongs to the l-th.
struct alignas(32) CornerBatch {
  static constexpr std::size_t lanes = 8;

  std::array<std::array<int, lanes>, 3> others;       ///< the other vertices, times 4: where their floats begin
  std::array<std::array<float, lanes>, 9> gradients;  ///< 1/m, the others' shape gradients, one after the other
  std::array<float, lanes> determinant;               ///< 1/m^3, of the matrix with these rows
  std::array<float, lanes> volume_mu;                 ///< J, rest volume times mu
  std::array<float, lanes> volume_stiff;              ///< J, rest volume times lambda + mu
};

/// The tetrahedra around each vertex, in their given order: batches first[v] to first[v + 1] are vertex v's. What is
/// left free in its last batch has no volume and adds zeros: 240 bytes a tetrahedron where nothing is left free, 280 in
/// a meshed liver, where a seventh is.
struct CornerBatches {
  std::vector<CornerBatch> batches;
  std::vector<int> first;
  std::vector<double> diagonal;  ///< N/m, per vertex: the part of its block that never changes, sum of V mu |g|^2
};

CornerBatches pack_corners(const std::vector<NeoHookeanElement>& elements, std::size_t vertices);

/// What a vertex sees of all its tetrahedra, the sum of NeoHookeanElement::local() over them, in single precision: for
/// implicit integrators that go from vertex to vertex. `displacements` are measured from the rest positions (m), as
/// add_neo_hookean_forces() takes them and for the same reason; the fourth component is not read. A displacement that
/// is not finite spoils the sums of the vertices that share a tetrahedron with it and no others.
///
/// On a Zen 4 core, in a block of 24,000 tetrahedra, 3.4 ns for each tetrahedron at a vertex with 32-byte
/// registers, 6.4 with 16; 4.8 in the liver. The plain element takes 70.
using CornerSum = LocalStiffness (*)(const CornerBatches& corners, int vertex, const Eigen::Vector4f* displacements);

/// The function for an instruction set, to be asked for once a sweep. All give the same bits: a lane's batches are
/// added one after the other, then the eight lanes in one order. Throws std::invalid_argument if `set` is not
/// available.
CornerSum corner_sum(InstructionSet set = instruction_set());

/// While it lives, numbers below the smallest normal float (1e-38) count as zero. Far from a contact the squares of
/// strains are such numbers by the thousand, and a tetrahedron of them takes 8 ns and not 3.5. CornerSum leaves it to
/// the caller, once a sweep: it takes 7 ns.
class TinyIsZero {
 public:
  TinyIsZero();
  ~TinyIsZero();
  TinyIsZero(const TinyIsZero&) = delete;
  TinyIsZero& operator=(const TinyIsZero&) = delete;

 private:
  unsigned before_ = 0;
};

}  // namespace tissue_sim
