#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

/// Points that follow the tetrahedra of a solid or the triangles of a shell.
///
/// In a solid point i is the sum over k of weights[i][k] times vertex corners[i][k]. The weights sum to 1 and reproduce
/// every linear function, so a point follows each affine motion of its tetrahedron exactly.
///
/// On a shell the first three corners are those of a triangle, the fourth is the first once more with weight 0, and the
/// point lies `offsets[i]` above the triangle, along its normal: it follows each rigid motion of its triangle, and what
/// stretches the triangle does not make the layer above it thinner.
struct Embedding {
  std::vector<Tetrahedron> corners;
  std::vector<std::array<double, 4>> weights;
  std::vector<double> offsets;    ///< m; empty in a solid
  double farthest_outside = 0.0;  ///< m, the distance from the solid or shell to the point that is farthest outside it
};

/// Embeds each point in the tetrahedron that holds it (of several, on a shared face, the lowest). A point outside the
/// solid gets the tetrahedron nearest to it; of those equally near, as around a vertex, the one whose least weight is
/// highest, then the lowest.
///
/// Outside, the tetrahedron's affine map is continued: some weights are negative, about as many times -1 as the point
/// is tetrahedron's heights away, and errors of the solid's strain grow by that factor. There is no limit here: a
/// caller looks at `farthest_outside` and refuses what is more than a fraction of an edge. Needs finite points and one
/// or more tetrahedra, none of them flat.
Embedding embed(const std::vector<Vector3>& points, const TetrahedralMesh& solid);

/// Embeds each point of a surface in the nearest triangle of a coarser mesh of it that faces the same way as the
/// surface there, `normals` (not unit); the nearest of all where none does. Of those equally near, as along a ridge,
/// the one whose least weight is highest, then the lowest. A point beyond the rim of its triangle has a negative
/// weight.
Embedding embed(const std::vector<Vector3>& points, const std::vector<Vector3>& normals, const TriangleMesh& shell);

/// The part of embedded point i that is linear in the vertices: in a solid all of it, on a shell its foot.
inline Vector3 embedded_foot(const Embedding& embedding, std::size_t i, const std::vector<Vector3>& vertices) {
  const Tetrahedron& t = embedding.corners[i];
  const std::array<double, 4>& w = embedding.weights[i];
  return w[0] * vertices[t[0]] + w[1] * vertices[t[1]] + w[2] * vertices[t[2]] + w[3] * vertices[t[3]];
}

/// Where embedded point i is while the vertices of the solid or shell are at `vertices`. Above a triangle without area
/// it is on it.
inline Vector3 embedded_point(const Embedding& embedding, std::size_t i, const std::vector<Vector3>& vertices) {
  const Vector3 foot = embedded_foot(embedding, i, vertices);
  if (embedding.offsets.empty()) return foot;
  const Tetrahedron& t = embedding.corners[i];
  const Vector3 normal = area_normal(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  const double twice_area = normal.norm();
  return foot + (twice_area > 0.0 ? embedding.offsets[i] / twice_area : 0.0) * normal;
}

}  // namespace tissue_sim
