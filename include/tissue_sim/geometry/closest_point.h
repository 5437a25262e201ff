#pragma once

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// The part of a triangle that a point of it lies on: corner 0, 1, 2, the rim after corner 0, 1, 2, or the face.
enum class Feature { corner_0, corner_1, corner_2, rim_0, rim_1, rim_2, face };

struct ClosestOnTriangle {
  Vector3 point = Vector3::Zero();
  Vector3 barycentric = Vector3::Zero();  ///< sums to 1, no entry below 0
  Feature feature = Feature::face;
};

/// The point of triangle (a, b, c) nearest to p. A degenerate triangle is treated as its longest rim or corner.
ClosestOnTriangle closest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// The nearest point of a mesh. `triangle` is -1 where nothing is within reach.
struct ClosestOnMesh {
  int triangle = -1;
  double squared_distance = 0.0;
  ClosestOnTriangle on;
};

/// A search for the point of a mesh nearest to p, triangle by triangle. Of equal distances the lower triangle wins, so
/// the order in which it looks at them does not matter.
struct ClosestSearch {
  const std::vector<Vector3>& vertices;
  const std::vector<Triangle>& triangles;
  Vector3 p;
  double bound;  ///< m^2, what is farther is not looked for
  ClosestOnMesh best;

  ClosestSearch(const std::vector<Vector3>& of_vertices, const std::vector<Triangle>& of_triangles, const Vector3& from,
                double reach)
      : vertices(of_vertices), triangles(of_triangles), p(from), bound(reach * reach) {}

  /// Whether what is at least as far as a box at this squared distance can be skipped. A NaN can. Rounding of the
  /// distance to a triangle's point may put it a little nearer than the box around it: that is no reason to skip it.
  bool too_far(double squared_distance) const { return !((1.0 - 1e-12) * squared_distance <= bound); }
  void look_at(int triangle);
  /// The same, but for triangles whose box shows that they are too far.
  void look_at_if_near(int triangle);
};

/// The point of the mesh nearest to p that is closer than `reach` (m). Of equal distances the lower triangle wins, so
/// the answer does not depend on the tree. `tree` holds boxes of the triangles, grown or not. `guess` is a triangle
/// that may well be the nearest, or -1: it changes how long the search takes and not what it finds.
ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const AabbTree& tree, const Vector3& p, double reach, int guess = -1);

/// The outward normal (not unit) that tells inside from outside at a point of a closed surface: the face's, the sum of
/// the two unit normals at an edge, the angle-weighted sum at a vertex (Baerentzen and Aanaes 2005).
Vector3 pseudonormal(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                     const MeshTopology& topology, int triangle, Feature feature);

}  // namespace tissue_sim
