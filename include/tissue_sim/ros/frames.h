#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim {

/// A pose in the scene's frame that remembers the frame it came in: the wrench goes back there.
struct FramedPose {
  StampedPose in_scene;
  std::string frame;
  Eigen::Quaterniond frame_to_scene = Eigen::Quaterniond::Identity();
};

/// The name of a frame or topic without the slash that older drivers still write before it; tf2 refuses it.
std::string without_slash(const std::string& name);

/// Takes a pose into the scene's frame with the transform at the pose's own stamp. False, with `why`, when there is
/// no such transform (yet). Without a change of frame no transform is looked up at all.
bool into_scene_frame(const tf2::BufferCore& transforms, const std::string& scene_frame,
                      const geometry_msgs::PoseStamped& message, FramedPose& pose, std::string& why);

/// Transforms as they stand in a recording. False where the bytes end too early, or where they announce more transforms
/// than they can hold: roscpp makes room for all that are announced before it reads the first. The bytes stay as they
/// are.
bool deserialize_transforms(std::vector<std::uint8_t>& bytes, tf2_msgs::TFMessage& message);

/// Gives a transform to tf2. False where it is refused: by tf2, or because its stamp is so late that the time for which
/// tf2 keeps it has no ROS stamp any more; tf2 itself ends in an exception there that nobody takes.
bool give_transform(const geometry_msgs::TransformStamped& transform, const std::string& authority, bool is_static,
                    tf2::BufferCore& transforms);

/// The frames that one instrument's poses came in, until the steps have caught up with them.
class FrameHistory {
 public:
  void add(const FramedPose& pose) { frames_.push_back(pose); }
  void clear() { frames_.clear(); }

  /// The last pose at or before `stamp`; forgets the ones before it. Null when there is none.
  const FramedPose* at(std::int64_t stamp);

 private:
  std::deque<FramedPose> frames_;
};

}  // namespace tissue_sim
