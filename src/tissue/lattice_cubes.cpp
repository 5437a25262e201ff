#include "tissue_sim/tissue/lattice_cubes.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "neo_hookean_lanes.h"
#include "tissue_sim/tissue/neo_hookean_corners.h"

namespace tissue_sim {
namespace {

constexpr std::size_t lanes = CubeBatch::lanes;
constexpr std::size_t corner_floats = 3 * lanes;

/// An edge of the cube goes along an axis from the one of its corners to the other, and one or two of the cube's
/// tetrahedra go along it.
struct CubeEdge {
  std::size_t axis = 0, from = 0, to = 0;
  std::size_t count = 0;
  std::array<std::size_t, 2> tetrahedra{};
};

/// The twelve edges; those of each tetrahedron and of each corner, by the axis.
struct CubeEdges {
  std::array<CubeEdge, 12> edges{};
  std::array<std::array<std::size_t, 3>, 6> of_tetrahedron{};
  std::array<std::array<std::size_t, 3>, 8> of_corner{};

  constexpr CubeEdges() {
    std::size_t e = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t corner = 0; corner < 8; ++corner) {
        if ((corner >> axis & 1U) != 0) continue;
        CubeEdge& edge = edges[e];
        edge.axis = axis;
        edge.from = corner;
        edge.to = corner | std::size_t{1} << axis;
        of_corner[edge.from][axis] = of_corner[edge.to][axis] = e;
        for (std::size_t n = 0; n < 6; ++n) {
          if (start(n, axis) != corner) continue;
          of_tetrahedron[n][axis] = e;
          edge.tetrahedra[edge.count++] = n;
        }
        ++e;
      }
    }
  }

  /// The corner from which tetrahedron n goes along the axis.
  static constexpr std::size_t start(std::size_t n, std::size_t axis) {
    const int number = static_cast<int>(n);
    std::size_t i = 0;
    while (axes_along(number)[i] != static_cast<int>(axis)) ++i;
    return static_cast<std::size_t>(corners_along(number)[i]);
  }
};
constexpr CubeEdges cube_edges;

TISSUE_SIM_INLINE const Quad& vector_of(const float* vectors, int vertex) {
  return quad(vectors + 4 * static_cast<std::size_t>(vertex));
}
TISSUE_SIM_INLINE Quad& vector_of(float* vectors, int vertex) {
  return quad(vectors + 4 * static_cast<std::size_t>(vertex));
}

TISSUE_SIM_INLINE void gather(const CubeBatch& batch, const float* displacements, float* rows) {
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const auto& vertices = batch.vertices[corner];
    for (std::size_t l = 0; l < lanes; l += 4) {
      to_rows<lanes>(vector_of(displacements, vertices[l]), vector_of(displacements, vertices[l + 1]),
                     vector_of(displacements, vertices[l + 2]), vector_of(displacements, vertices[l + 3]),
                     rows + corner * corner_floats + l);
    }
  }
}

TISSUE_SIM_INLINE void scatter(const CubeBatch& batch, std::size_t count, const float* rows, float* forces) {
  for (std::size_t l = 0; l < count; l += 4) {
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const auto& vertices = batch.vertices[corner];
      Quad a, b, c, d;
      from_rows<lanes>(rows + corner * corner_floats + l, a, b, c, d);
      vector_of(forces, vertices[l]) += a;
      if (l + 1 < count) vector_of(forces, vertices[l + 1]) += b;
      if (l + 2 < count) vector_of(forces, vertices[l + 2]) += c;
      if (l + 3 < count) vector_of(forces, vertices[l + 3]) += d;
    }
  }
}

template <class Lane>
TISSUE_SIM_INLINE void read(const float* rows, std::size_t corner, Three<Lane>& v) {
  const float* row = rows + corner * corner_floats;
  v = {lane<Lane>(row), lane<Lane>(row + lanes), lane<Lane>(row + 2 * lanes)};
}

/// Replaces the displacements of the corners, from lane l on, by the forces on them. Along an edge of the cube the
/// gradient of the displacements is their difference over its length: H has those of a tetrahedron's three edges for
/// columns, and a column of its stress pulls at the ends of the same edge. Unrolled, so that whose edge is whose is
/// known to the compiler. A tetrahedron takes 2.1 ns, and 5.4 to 6.1 in a NeoHookeanBatch (3,402 of them, one core of
/// an AMD EPYC, Zen 5).
template <class Lane>
TISSUE_SIM_INLINE void pull(const CubeBatch& batch, std::size_t l, float* rows) {
  Three<Lane> gradients[12];
#pragma GCC unroll 12
  for (std::size_t e = 0; e < 12; ++e) {
    const CubeEdge& edge = cube_edges.edges[e];
    const Lane& slope = lane<Lane>(&batch.slope[edge.axis][l]);
    Three<Lane> from, to;
    read(rows, edge.from, from);
    read(rows, edge.to, to);
    gradients[e] = {slope * (to.x - from.x), slope * (to.y - from.y), slope * (to.z - from.z)};
  }
  Three<Lane> stresses[6][3];
#pragma GCC unroll 6
  for (std::size_t n = 0; n < 6; ++n) {
    const auto& [e0, e1, e2] = cube_edges.of_tetrahedron[n];
    stress(gradients[e0], gradients[e1], gradients[e2], lane<Lane>(&batch.volume_mu[n][l]),
           lane<Lane>(&batch.volume_stiff[n][l]), stresses[n][0], stresses[n][1], stresses[n][2]);
  }
  Three<Lane> pulls[12];
#pragma GCC unroll 12
  for (std::size_t e = 0; e < 12; ++e) {
    const CubeEdge& edge = cube_edges.edges[e];
    Three<Lane>& sum = pulls[e];
    sum = stresses[edge.tetrahedra[0]][edge.axis];
    if (edge.count > 1) add(stresses[edge.tetrahedra[1]][edge.axis], sum);
    const Lane& slope = lane<Lane>(&batch.slope[edge.axis][l]);
    sum = {slope * sum.x, slope * sum.y, slope * sum.z};
  }
#pragma GCC unroll 8
  for (std::size_t corner = 0; corner < 8; ++corner) {
    Three<Lane> force{};
#pragma GCC unroll 3
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Three<Lane>& along = pulls[cube_edges.of_corner[corner][axis]];
      if ((corner >> axis & 1U) == 0) {
        add(along, force);
      } else {
        subtract(along, force);
      }
    }
    float* row = rows + corner * corner_floats;
    lane<Lane>(row) = force.x;
    lane<Lane>(row + lanes) = force.y;
    lane<Lane>(row + 2 * lanes) = force.z;
  }
}

template <class Lane>
TISSUE_SIM_INLINE void add_forces(const LatticeCubes& cubes, const float* displacements, float* forces) {
  constexpr std::size_t width = sizeof(Lane) / sizeof(float);
  alignas(64) float rows[8 * corner_floats];
  for (std::size_t b = 0; b < cubes.batches.size(); ++b) {
    const CubeBatch& batch = cubes.batches[b];
    gather(batch, displacements, rows);
    for (std::size_t l = 0; l < lanes; l += width) pull<Lane>(batch, l, rows + l);
    scatter(batch, std::min(lanes, cubes.cubes - lanes * b), rows, forces);
  }
}

__attribute__((noinline)) void add_forces_baseline(const LatticeCubes& cubes, const float* displacements,
                                                   float* forces) {
  add_forces<Four>(cubes, displacements, forces);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void add_forces_avx2(const LatticeCubes& cubes, const float* displacements,
                                                     float* forces) {
  add_forces<Eight>(cubes, displacements, forces);
}
__attribute__((target("avx512f,avx512vl"))) void add_forces_avx512(const LatticeCubes& cubes,
                                                                   const float* displacements, float* forces) {
  add_forces<Sixteen>(cubes, displacements, forces);
}
#endif

/// Where the next cube goes.
CubeBatch& next(LatticeCubes& cubes, std::size_t& l) {
  l = cubes.cubes++ % lanes;
  if (l == 0) cubes.batches.emplace_back();
  return cubes.batches.back();
}

void copy_cube(const CubeBatch& from, std::size_t l, CubeBatch& to, std::size_t at) {
  for (std::size_t i = 0; i < 8; ++i) to.vertices[i][at] = from.vertices[i][l];
  for (std::size_t i = 0; i < 3; ++i) to.slope[i][at] = from.slope[i][l];
  for (std::size_t i = 0; i < 6; ++i) to.volume_mu[i][at] = from.volume_mu[i][l];
  for (std::size_t i = 0; i < 6; ++i) to.volume_stiff[i][at] = from.volume_stiff[i][l];
}

}  // namespace

LatticeCubes pack(const Lattice& lattice, const std::vector<NeoHookeanElement>& elements) {
  LatticeCubes packed;
  for (const LatticeCube& cube : cubes_of(lattice)) {
    std::size_t l = 0;
    CubeBatch& batch = next(packed, l);
    for (std::size_t i = 0; i < 8; ++i) batch.vertices[i][l] = cube.corners[cube.corners[i] < 0 ? 0 : i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      batch.slope[axis][l] = static_cast<float>((cube.mirrored[axis] ? -1.0 : 1.0) / lattice.edge);
    }
    for (std::size_t n = 0; n < 6; ++n) {
      const bool there = cube.tetrahedra[n] >= 0;
      const NeoHookeanElement& element = elements[static_cast<std::size_t>(there ? cube.tetrahedra[n] : 0)];
      const double volume = there ? element.volume : 0.0;
      batch.volume_mu[n][l] = static_cast<float>(volume * element.moduli.mu);
      batch.volume_stiff[n][l] = static_cast<float>(volume * (element.moduli.lambda + element.moduli.mu));
    }
  }
  fill_last(packed);
  return packed;
}

void add_cube(const CubeBatch& from, std::size_t l, LatticeCubes& to) {
  std::size_t at = 0;
  CubeBatch& batch = next(to, at);
  copy_cube(from, l, batch, at);
}

void fill_last(LatticeCubes& cubes) {
  const std::size_t used = cubes.cubes % lanes;
  if (used == 0) return;
  CubeBatch& batch = cubes.batches.back();
  for (std::size_t l = used; l < lanes; ++l) copy_cube(batch, used - 1, batch, l);
}

void add_cube_forces(const LatticeCubes& cubes, const float* displacements, float* forces, InstructionSet set) {
  if (!available(set)) {
    throw std::invalid_argument(std::string("add_cube_forces: this processor has no ") + name(set));
  }
#ifdef __x86_64__
  const TinyIsZero tiny_is_zero;
  if (set == InstructionSet::avx512) return add_forces_avx512(cubes, displacements, forces);
  if (set == InstructionSet::avx2) return add_forces_avx2(cubes, displacements, forces);
#endif
  add_forces_baseline(cubes, displacements, forces);
}

}  // namespace tissue_sim
