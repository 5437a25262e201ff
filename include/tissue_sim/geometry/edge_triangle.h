#pragma once

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Where an edge goes through a triangle.
struct EdgeTriangleHit {
  int direction = 0;  ///< 0: no hit; +1: the edge runs along the normal, from behind to the front; -1: against it
  double t = 0.0;     ///< along the edge, 0 at p and 1 at q
};

/// Does the edge p-q go through the triangle (corners `points`, which are vertices `indices` of their mesh)?
///
/// An edge through the rim between two triangles hits exactly one of them, and so does one through a corner of a convex
/// surface: the side of the rim is computed in the order of the vertex indices, so both triangles see the same number
/// with opposite sign, and what is zero within rounding is decided as after one small shift, the same for every rim. An
/// end in the triangle's plane counts as in front of it. No hit: degenerate triangles, an edge in the plane, NaN.
EdgeTriangleHit hit_edge_triangle(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                                  const Triangle& indices);

/// The same, to the same bits, where the line through p and q is known to pass all rims of a triangle on one side, by
/// more than rounding: then its plane decides, given by a corner and area_normal().
EdgeTriangleHit hit_within_rims(const Vector3& p, const Vector3& q, const Vector3& corner, const Vector3& normal);

}  // namespace tissue_sim
