#pragma once

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/pose.h"

namespace tissue_sim {

/// The smallest box in the scene's frame that holds a box of another frame, which is at `pose` there.
Box scene_bounds(const Box& box, const Pose& pose);

/// A box of another frame at a pose, for boxes of the scene to be held against: in both frames, since the box around a
/// shaft that stands askew in the scene is mostly empty. Metres.
class TurnedBox {
 public:
  TurnedBox(const Box& box, const Pose& pose);

  /// Two that are apart may be taken for overlapping, and none that overlap for apart.
  bool overlaps(const Box& of_scene) const {
    if (!in_scene_.overlaps(of_scene)) return false;
    const Vector3 middle = back_ * (0.5 * (of_scene.lower + of_scene.upper) - position_);
    const Vector3 half = spread_ * (0.5 * of_scene.size());
    return own_.overlaps({middle - half, middle + half});
  }

  /// Whether a ball of the scene lies inside.
  bool contains(const Vector3& middle, double radius) const {
    const Vector3 place = back_ * (middle - position_);
    const Vector3 reach = Vector3::Constant(radius + rounding);
    return box_.contains(place - reach) && box_.contains(place + reach);
  }

 private:
  static constexpr double rounding = 1e-9;  ///< m; turning is exact to far less, over any length of a scene

  Box box_;
  Box own_;  ///< grown by what rounding may do
  Box in_scene_;
  Vector3 position_;
  Eigen::Matrix3d back_;    ///< from the scene's directions to the other frame's
  Eigen::Matrix3d spread_;  ///< of its numbers the absolute values
};

}  // namespace tissue_sim
