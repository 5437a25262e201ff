#include "tissue_sim/ros/frames.h"

#include <ros/serialization.h>
#include <tf2/exceptions.h>

#include <stdexcept>

#include "tissue_sim/ros/messages.h"

namespace tissue_sim {
namespace {

/// Of one transform whose frames have no name: header 16, name of the child 4, seven numbers of 8.
constexpr std::size_t least_transform_bytes = 76;

}  // namespace

std::string without_slash(const std::string& name) {
  return !name.empty() && name[0] == '/' ? name.substr(1) : name;
}

bool into_scene_frame(const tf2::BufferCore& transforms, const std::string& scene_frame,
                      const geometry_msgs::PoseStamped& message, FramedPose& pose, std::string& why) {
  pose.in_scene.stamp = static_cast<std::int64_t>(message.header.stamp.toNSec());
  pose.in_scene.pose = to_pose(message.pose);
  pose.frame = message.header.frame_id;
  pose.frame_to_scene = Eigen::Quaterniond::Identity();

  const std::string source = without_slash(message.header.frame_id);
  const std::string target = without_slash(scene_frame);
  // The timeline refuses a zero stamp, and tf2 would read it as "the latest".
  if (source == target || message.header.stamp.isZero()) return true;
  if (source.empty()) {
    why = "the poses name no frame: fill in header.frame_id";
    return false;
  }

  Pose to_scene;
  try {
    const geometry_msgs::Transform found = transforms.lookupTransform(target, source, message.header.stamp).transform;
    to_scene.position = {found.translation.x, found.translation.y, found.translation.z};
    to_scene.orientation =
        Eigen::Quaterniond(found.rotation.w, found.rotation.x, found.rotation.y, found.rotation.z).normalized();
  } catch (const std::runtime_error& error) {  // tf2's, and ros::Time has one of its own
    why = "no transform from \"" + source + "\" to \"" + target + "\" (" + error.what() +
          "): publish it, or give the scene the frame of the poses";
    return false;
  }
  // Not through Pose's product, which would normalise: a faulty quaternion has to reach the timeline as it is.
  pose.in_scene.pose.position = to_scene.apply(pose.in_scene.pose.position);
  pose.in_scene.pose.orientation = to_scene.orientation * pose.in_scene.pose.orientation;
  pose.frame_to_scene = to_scene.orientation;
  return true;
}

bool deserialize_transforms(std::vector<std::uint8_t>& bytes, tf2_msgs::TFMessage& message) {
  if (bytes.empty()) return false;  // roscpp counts on from where they begin, which is nowhere
  const auto length = static_cast<std::uint32_t>(bytes.size());
  std::uint32_t announced = 0;
  try {
    ros::serialization::IStream counts(bytes.data(), length);
    counts.next(announced);
    if (announced > bytes.size() / least_transform_bytes) return false;
    ros::serialization::IStream stream(bytes.data(), length);
    ros::serialization::deserialize(stream, message);
  } catch (const ros::serialization::StreamOverrunException&) {
    return false;
  }
  return true;
}

bool give_transform(const geometry_msgs::TransformStamped& transform, const std::string& authority, bool is_static,
                    tf2::BufferCore& transforms) {
  // In seconds, rounded: what comes within a second of the end is refused too.
  const double kept_until = transform.header.stamp.toSec() + transforms.getCacheLength().toSec();
  if (kept_until > ros::TIME_MAX.toSec() - 1.0) return false;
  return transforms.setTransform(transform, authority, is_static);
}

const FramedPose* FrameHistory::at(std::int64_t stamp) {
  while (frames_.size() > 1 && frames_[1].in_scene.stamp <= stamp) frames_.pop_front();
  return frames_.empty() ? nullptr : &frames_.front();
}

}  // namespace tissue_sim
