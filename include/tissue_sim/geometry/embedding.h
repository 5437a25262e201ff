#pragma once

#include <array>
#include <vector>

#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

/// Points that follow the tetrahedra of a solid: point i is the sum over k of weights[i][k] times vertex corners[i][k].
/// The weights sum to 1 and reproduce every linear function, so a point follows each affine motion of its tetrahedron
/// exactly.
struct Embedding {
  std::vector<Tetrahedron> corners;
  std::vector<std::array<double, 4>> weights;
  double farthest_outside = 0.0;  ///< m, the distance from the solid to the point that is farthest outside it
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

/// Where embedded point i is while the solid's vertices are at `vertices`.
inline Vector3 embedded_point(const Embedding& embedding, std::size_t i, const std::vector<Vector3>& vertices) {
  const Tetrahedron& t = embedding.corners[i];
  const std::array<double, 4>& w = embedding.weights[i];
  return w[0] * vertices[t[0]] + w[1] * vertices[t[1]] + w[2] * vertices[t[2]] + w[3] * vertices[t[3]];
}

}  // namespace tissue_sim
