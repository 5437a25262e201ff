#pragma once

#include <Eigen/Geometry>
#include <algorithm>

#include "tissue_sim/tissue/element.h"

namespace tissue_sim {

/// Area preservation, Eq. 7 of the paper with the norm that its print lacks: C = (1/2 |(p_j - p_i) x (p_k - p_i)| - A0)
/// / A0.
struct AreaElement : Element<3> {
  /// The area grows fastest when a corner moves in the plane, away from the opposite side: 1/2 n x side. A triangle
  /// without area has no normal: the gradient is zero there.
  double evaluate(const ElementVectors<AreaElement>& x, ElementVectors<AreaElement>& gradient) const {
    const Vector3 normal = area_normal(x[0], x[1], x[2]);
    const double twice_area = normal.norm();
    const Vector3 half = normal * (twice_area > 0.0 ? 1.0 / (2.0 * twice_area * scale) : 0.0);
    gradient[0] = half.cross(x[2] - x[1]);
    gradient[1] = half.cross(x[0] - x[2]);
    gradient[2] = half.cross(x[1] - x[0]);
    return (0.5 * twice_area - rest) / scale;
  }

  /// Second derivative of the energy by one corner's position, N/m: k g g^T, and where the triangle is stretched k C
  /// times that of the area, side^2 / (4 area) n n^T, for a corner that leaves the plane. Positive semi-definite.
  Matrix3 block(const ElementVectors<AreaElement>& x, std::size_t corner) const {
    const Vector3 normal = area_normal(x[0], x[1], x[2]);
    const double twice_area = normal.norm();
    if (!(twice_area > 0.0)) return Matrix3::Zero();
    const Vector3 n = normal / twice_area;
    const Vector3 side = x[(corner + 2) % 3] - x[(corner + 1) % 3];
    const Vector3 gradient = n.cross(side) / (2.0 * scale);
    const double stretch = std::max(0.0, 0.5 * twice_area - rest) / (scale * scale);
    return stiffness *
           (gradient * gradient.transpose() + stretch * side.squaredNorm() / (2.0 * twice_area) * n * n.transpose());
  }
};

}  // namespace tissue_sim
