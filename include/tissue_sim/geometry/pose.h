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

/// A turn by `angle` (rad) about a unit axis, counterclockwise as seen against it.
Eigen::Quaterniond turn(double angle, const Eigen::Vector3d& axis);

/// rad, of the shorter arc from one orientation to the other.
double angle_between(const Pose& a, const Pose& b);

/// Position on the line, rotation by slerp over the shorter arc. The ends come out exactly.
Pose interpolate(const Pose& from, const Pose& to, double fraction);

}  // namespace tissue_sim
