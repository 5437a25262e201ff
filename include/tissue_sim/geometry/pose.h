#pragma once

#include <Eigen/Geometry>

namespace tissue_sim {

/// A rigid transform: p_parent = orientation * p_own + position. Metres; unit quaternion.
struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();

  Eigen::Vector3d apply(const Eigen::Vector3d& p) const { return orientation * p + position; }
  Eigen::Vector3d apply_inverse(const Eigen::Vector3d& p) const { return orientation.conjugate() * (p - position); }
};

inline Pose operator*(const Pose& parent, const Pose& child) {
  return {parent.apply(child.position), (parent.orientation * child.orientation).normalized()};
}

/// Position on the line, rotation by slerp over the shorter arc. The ends come out exactly.
inline Pose interpolate(const Pose& from, const Pose& to, double fraction) {
  if (fraction <= 0.0) return from;
  if (fraction >= 1.0) return to;
  return {from.position + fraction * (to.position - from.position), from.orientation.slerp(fraction, to.orientation)};
}

}  // namespace tissue_sim
