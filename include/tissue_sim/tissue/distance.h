#pragma once

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
};

}  // namespace tissue_sim
