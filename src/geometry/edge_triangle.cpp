#include "tissue_sim/geometry/edge_triangle.h"

#include <Eigen/Geometry>

namespace tissue_sim {

namespace {

/// +1 or -1: the side on which the line p + s * along passes the rim from corner a to corner b.
int side_of_rim(const Vector3& p, const Vector3& along, const Vector3& a, const Vector3& b, bool ascending) {
  const Vector3& low = ascending ? a : b;
  const Vector3& high = ascending ? b : a;
  const int side = along.dot((low - p).cross(high - p)) >= 0.0 ? 1 : -1;
  return ascending ? side : -side;
}

}  // namespace

EdgeTriangleHit hit_edge_triangle(const Vector3& p, const Vector3& q, const std::array<const Vector3*, 3>& points,
                                  const Triangle& indices) {
  const Vector3& a = *points[0];
  const Vector3& b = *points[1];
  const Vector3& c = *points[2];
  const Vector3 normal = area_normal(a, b, c);
  const double height_p = normal.dot(p - a);
  const double height_q = normal.dot(q - a);
  if ((height_p < 0.0) == (height_q < 0.0)) return {};

  const Vector3 along = q - p;
  const int side = side_of_rim(p, along, a, b, indices[0] < indices[1]);
  if (side != side_of_rim(p, along, b, c, indices[1] < indices[2])) return {};
  if (side != side_of_rim(p, along, c, a, indices[2] < indices[0])) return {};

  const double t = height_p / (height_p - height_q);
  if (!(t >= 0.0 && t <= 1.0)) return {};
  return {height_p < 0.0 ? 1 : -1, t};
}

}  // namespace tissue_sim
