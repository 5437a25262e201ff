#pragma once

#include <array>
#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Vertex indices (a, b, c, d) of positive volume: d lies on the side that the triangle (a, b, c) faces away from when
/// it runs clockwise seen from d, so (b - a) x (c - a) . (d - a) > 0.
using Tetrahedron = std::array<int, 4>;

/// A solid cut into tetrahedra. Lengths in metres.
struct TetrahedralMesh {
  std::vector<Vector3> vertices;
  std::vector<Tetrahedron> tetrahedra;

  bool empty() const { return tetrahedra.empty(); }
};

/// Signed volume, m^3.
inline double tetrahedron_volume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

}  // namespace tissue_sim
