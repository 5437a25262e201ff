#include "tissue_sim/tissue/enclosed_volume.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace tissue_sim {

double EnclosedVolume::evaluate(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                                std::vector<Vector3>& gradient) const {
  // Six times the volume is the sum of p_a . (p_b x p_c). Taken from a vertex of the surface, not from the origin: far
  // from the origin the terms would cancel to nothing.
  const Vector3& origin = positions.front();
  std::fill(gradient.begin(), gradient.end(), Vector3::Zero());
  const double sixth = 1.0 / (6.0 * rest);
  double six_volumes = 0.0;
  for (const auto& [a, b, c] : triangles) {
    const Vector3 p_a = positions[a] - origin;
    const Vector3 p_b = positions[b] - origin;
    const Vector3 p_c = positions[c] - origin;
    const Vector3 from_a = p_b.cross(p_c);
    six_volumes += p_a.dot(from_a);
    gradient[a] += sixth * from_a;
    gradient[b] += sixth * p_c.cross(p_a);
    gradient[c] += sixth * p_a.cross(p_b);
  }
  return (six_volumes / 6.0 - rest) / rest;
}

}  // namespace tissue_sim
