#include "tissue_sim/geometry/edge_triangle.h"

#include <Eigen/Geometry>

namespace tissue_sim {

namespace {

/// Of the product of its three lengths: below this a side is rounding error.
constexpr double rounding = 1e-15;

/// +1 or -1: the side on which the line along `along` passes the rim from corner a to corner b, which are seen from a
/// point of the line. A line through the rim is taken to pass where it would after a small shift by (d, d^2, d^3): the
/// rims of a corner then agree, so that a line through a corner hits one of its triangles and not none or three.
inline int side_of_rim(const Vector3& along, double along_squared, const Vector3& to_a, const Vector3& to_b,
                       bool ascending) {
  const Vector3& to_low = ascending ? to_a : to_b;
  const Vector3& to_high = ascending ? to_b : to_a;
  double side = along.dot(to_low.cross(to_high));
  const double squares = along_squared * to_low.squaredNorm() * to_high.squaredNorm();
  if (side * side <= rounding * rounding * squares) {
    const Vector3 by_shift = along.cross(to_high - to_low);
    side = by_shift.x() != 0.0 ? by_shift.x() : by_shift.y() != 0.0 ? by_shift.y() : by_shift.z();
  }
  return (side >= 0.0) == ascending ? 1 : -1;
}

}  // namespace

bool passes_within_rims(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                        const Triangle& indices) {
  const Vector3 along = q - p;
  const double squared = along.squaredNorm();
  const Vector3 to_a = *points[0] - p;
  const Vector3 to_b = *points[1] - p;
  const Vector3 to_c = *points[2] - p;
  const int side = side_of_rim(along, squared, to_a, to_b, indices[0] < indices[1]);
  return side == side_of_rim(along, squared, to_b, to_c, indices[1] < indices[2]) &&
         side == side_of_rim(along, squared, to_c, to_a, indices[2] < indices[0]);
}

EdgeTriangleHit hit_edge_triangle(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                                  const Triangle& indices) {
  const EdgeTriangleHit hit = hit_plane(p, q, *points[0], area_normal(*points[0], *points[1], *points[2]));
  if (hit.direction == 0 || !passes_within_rims(p, q, points, indices)) return {};
  return hit;
}

}  // namespace tissue_sim
