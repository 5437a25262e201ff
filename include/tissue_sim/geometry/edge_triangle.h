#pragma once

#include <cmath>
#include <limits>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Where an edge goes through a triangle.
struct EdgeTriangleHit {
  int direction = 0;  ///< 0: no hit; +1: the edge runs along the normal, from behind to the front; -1: against it
  double t = 0.0;     ///< along the edge, 0 at p and 1 at q; of a hit only
};

/// Does the edge p-q go through the triangle (corners `points`, which are vertices `indices` of their mesh)?
///
/// An edge through the rim between two triangles hits exactly one of them, and so does one through a corner of a convex
/// surface: the side of the rim is computed in the order of the vertex indices, so both triangles see the same number
/// with opposite sign, and what is zero within rounding is decided as after one small shift, the same for every rim. An
/// end in the triangle's plane counts as in front of it. No hit: degenerate triangles, an edge in the plane, NaN.
EdgeTriangleHit hit_edge_triangle(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                                  const Triangle& indices);

/// Where the edge goes through the triangle's plane, given by a corner and area_normal(): what of the same is decided
/// by it. Without a branch: no one can guess it.
inline EdgeTriangleHit hit_plane(const Vector3& p, const Vector3& q, const Vector3& corner, const Vector3& normal) {
  const double height_p = normal.dot(p - corner);
  const double height_q = normal.dot(q - corner);
  // Of heights on two sides the sizes add up to the difference. The least number there is, which changes no other,
  // keeps an edge in the plane from 0 / 0.
  const double t = std::abs(height_p) / (std::abs(height_p) + std::abs(height_q) + std::numeric_limits<double>::min());
  const int hits = static_cast<int>((height_p < 0.0) != (height_q < 0.0)) & static_cast<int>(t <= 1.0);  // not of NaN
  return {hits * (2 * static_cast<int>(height_p < 0.0) - 1), t};
}

/// And what is decided by the rims: whether the line through p and q passes all of them on one side.
bool passes_within_rims(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                        const Triangle& indices);

}  // namespace tissue_sim
