#pragma once

#include <algorithm>

#include "tissue_sim/tissue/element.h"

namespace tissue_sim {

/// Distance preservation, Eq. 6 of the paper: C = (|p_j - p_i| - D0) / D0.
struct DistanceElement : Element<2> {
  /// Two points in one place have no direction: the gradient is zero there.
  double evaluate(const ElementVectors<DistanceElement>& x, ElementVectors<DistanceElement>& gradient) const {
    const Vector3 along = x[1] - x[0];
    const double length = along.norm();
    gradient[1] = along * (length > 0.0 ? 1.0 / (length * scale) : 0.0);
    gradient[0] = -gradient[1];
    return (length - rest) / scale;
  }

  /// Second derivative of the energy by one end's position, N/m: k / scale^2 (n n^T + (1 - rest/length) (1 - n n^T)),
  /// the second part left out where the edge is shortened, so that it is positive semi-definite.
  Matrix3 block(const ElementVectors<DistanceElement>& x, std::size_t) const {
    const Vector3 along = x[1] - x[0];
    const double length = along.norm();
    if (!(length > 0.0)) return Matrix3::Zero();
    const double across = std::max(0.0, 1.0 - rest / length);
    const Vector3 n = along / length;
    return stiffness / (scale * scale) * ((1.0 - across) * n * n.transpose() + across * Matrix3::Identity());
  }
};

}  // namespace tissue_sim
