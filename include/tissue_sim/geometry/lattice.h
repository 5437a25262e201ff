#pragma once

#include <array>
#include <vector>

#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

/// Equal cubes over a solid, each cut into six tetrahedra around a diagonal (Kuhn), neighbours mirrored so that they
/// fit together and no direction is preferred. Only tetrahedra that hold something of the solid are there.
struct Lattice {
  TetrahedralMesh mesh;
  /// Per tetrahedron, the part of its volume that the solid fills, 0 to 1.
  std::vector<double> fill;
  Vector3 origin = Vector3::Zero();
  double edge = 0.0;            ///< m, of the cubes
  std::array<int, 3> cells{};   ///< cubes along x, y, z
  std::vector<int> tetrahedra;  ///< six a cube, into `mesh`, or -1; cube (i, j, k) is i + cells[0] (j + cells[1] k)
};

/// The lattice of cubes of `edge` (m) over a solid. Tetrahedra that hold one of the solid's vertices or of `points` are
/// there even where the solid fills next to nothing of them. Needs a solid of positive volumes.
Lattice cover(const TetrahedralMesh& solid, const std::vector<Vector3>& points, double edge);

/// A cube of the lattice, seen from the corner that all of its tetrahedra have: corner i lies at the far end of each
/// axis a whose bit 1 << a is set in i. Where a corner or a tetrahedron is not there, -1. Tetrahedron n goes along the
/// cube's edges from corner 0 to corner 7, one axis after the other: n / 2 first, then the lower one of the others if n
/// is even.
struct LatticeCube {
  std::array<int, 8> corners{{-1, -1, -1, -1, -1, -1, -1, -1}};
  std::array<int, 6> tetrahedra{{-1, -1, -1, -1, -1, -1}};
  std::array<bool, 3> mirrored{};  ///< per axis: the far end is that of the smaller coordinate
};

/// The axes that tetrahedron n goes along, one after the other, and the corners that it comes by.
constexpr std::array<int, 3> axes_along(int n) {
  const int first = n / 2;
  const int lower = first == 0 ? 1 : 0;
  const int upper = first == 2 ? 1 : 2;
  return {first, n % 2 == 0 ? lower : upper, n % 2 == 0 ? upper : lower};
}
constexpr std::array<int, 4> corners_along(int n) {
  return {0, 1 << axes_along(n)[0], 7 - (1 << axes_along(n)[2]), 7};
}

/// The cubes that have a tetrahedron, in an order in which near ones are near in space.
std::vector<LatticeCube> cubes_of(const Lattice& lattice);

/// Each point by the tetrahedron of the lattice that holds it: those given to cover() all have one. Throws
/// std::invalid_argument for a point that has none.
Embedding embed(const std::vector<Vector3>& points, const Lattice& lattice);

}  // namespace tissue_sim
