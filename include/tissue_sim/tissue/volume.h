#pragma once

#include <Eigen/Geometry>

#include "tissue_sim/tissue/element.h"

namespace tissue_sim {

/// Volume preservation, Eq. 8 of the paper: C = (1/6 (p_j - p_i) . ((p_k - p_i) x (p_l - p_i)) - V0) / V0, signed and
/// so smooth everywhere. On a surface the four vertices are those of the two triangles at an edge, a flap: its volume
/// changes when the surface bends there.
struct VolumeElement : Element<4> {
  double evaluate(const ElementVectors<VolumeElement>& x, ElementVectors<VolumeElement>& gradient) const {
    const Vector3 a = x[1] - x[0];
    const Vector3 b = x[2] - x[0];
    const Vector3 c = x[3] - x[0];
    const double sixth = 1.0 / (6.0 * scale);
    gradient[1] = sixth * b.cross(c);
    gradient[2] = sixth * c.cross(a);
    gradient[3] = sixth * a.cross(b);
    gradient[0] = -(gradient[1] + gradient[2] + gradient[3]);
    return (a.dot(b.cross(c)) / 6.0 - rest) / scale;
  }

  /// Second derivative of the energy by one corner's position, N/m: k g g^T, exact, since the volume is linear in it.
  Matrix3 block(const ElementVectors<VolumeElement>& x, std::size_t corner) const {
    ElementVectors<VolumeElement> gradient;
    evaluate(x, gradient);
    return stiffness * gradient[corner] * gradient[corner].transpose();
  }
};

}  // namespace tissue_sim
