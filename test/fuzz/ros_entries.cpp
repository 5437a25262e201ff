#include <geometry_msgs/PoseStamped.h>
#include <ros/serialization.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "entries.h"
#include "ros/ball_scene.h"
#include "tissue_sim/replay/replay.h"
#include "tissue_sim/ros/frames.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim {
namespace {

constexpr double bound = 10.0;  ///< m: the organ is 6 cm across, at the origin

/// Long steps: the time goes into what is read.
Scene slow_scene() {
  Scene scene = ball_scene(8, 4);
  scene.time_step = 0.1;
  return scene;
}

/// As roscpp reads what comes in. False, with nothing kept, where the bytes end too early.
template <class Message>
bool read(const std::string& bytes, Message& message) {
  std::string copy = bytes;
  ros::serialization::IStream stream(reinterpret_cast<std::uint8_t*>(&copy[0]),
                                     static_cast<std::uint32_t>(copy.size()));
  try {
    ros::serialization::deserialize(stream, message);
  } catch (const ros::serialization::StreamOverrunException&) {
    return false;
  }
  return true;
}

template <class Message>
void require_writable(const Message& message) {
  const std::uint32_t length = ros::serialization::serializationLength(message);
  std::vector<std::uint8_t> bytes(length);
  ros::serialization::OStream stream(bytes.data(), length);
  ros::serialization::serialize(stream, message);
}

void require_bounded(double value) {
  require(std::isfinite(value), "a value that is no number is published");
}

/// Everything that the node would publish.
void require_sound_output(const Scene& scene, const Timeline& timeline, FrameHistory& frames) {
  const TissueState state = state_message(scene, timeline, 0, 1);
  for (const float x : state.positions) require(std::abs(x) < bound, "a vertex far away");
  for (const float depth : state.depths) require(depth >= 0.0F && depth < bound, "a depth out of range");
  const Contacts contacts = contacts_message(scene, timeline.report());
  for (const Contact& contact : contacts.contacts) {
    for (const double x : {contact.position.x, contact.position.y, contact.position.z, contact.depth, contact.force.x,
                           contact.force.y, contact.force.z, contact.direction.x, contact.direction.y}) {
      require_bounded(x);
    }
  }
  require_writable(state);
  require_writable(contacts);
  const FramedPose* pose = frames.at(timeline.report().stamp);
  if (pose != nullptr) {
    const auto wrench =
        wrench_message(timeline.report().wrenches[0], timeline.report().stamp, pose->frame, pose->frame_to_scene);
    for (const double x : {wrench.wrench.force.x, wrench.wrench.force.y, wrench.wrench.torque.z}) require_bounded(x);
    require_writable(wrench);
  }
  require_writable(markers_message(scene, timeline));
}

}  // namespace

std::string enter_bag(const std::string& bytes) {
  static const TemporaryFolder folder;
  static const Scene scene = slow_scene();
  ReplayOptions options;
  options.input = folder.write("in.bag", bytes);
  options.output = (folder.path / "out.bag").string();
  try {
    const ReplaySummary summary = replay(scene, options);
    require(summary.non_finite == 0, "values that are no numbers");
    require(summary.depth_max < bound && std::isfinite(summary.force_max), "a summary out of range");
  } catch (const std::runtime_error& error) {
    const std::string line = error.what();
    require(line.compare(0, options.input.size(), options.input) == 0, "the error does not name the bag: " + line);
    require(line.find('\n') == std::string::npos, "not one line: " + line);
    return line;
  }
  return "";
}

std::string enter_messages(const std::string& bytes) {
  static const Scene scene = slow_scene();
  Timeline timeline(scene);
  tf2::BufferCore transforms;
  FrameHistory frames;
  std::string refused;
  for (std::size_t at = 0; at + 3 <= bytes.size();) {
    const std::size_t length =
        static_cast<unsigned char>(bytes[at + 1]) + 256U * static_cast<unsigned char>(bytes[at + 2]);
    const std::string body = bytes.substr(at + 3, length);
    const char kind = bytes[at];
    at += 3 + length;
    if (kind == 't') {
      tf2_msgs::TFMessage message;
      std::vector<std::uint8_t> raw(body.begin(), body.end());
      if (!deserialize_transforms(raw, message)) {
        refused = "transforms are cut short";
        continue;
      }
      for (const auto& transform : message.transforms) {
        if (!give_transform(transform, "fuzz", false, transforms)) refused = "a transform of no use";
      }
      continue;
    }
    geometry_msgs::PoseStamped message;
    if (!read(body, message)) {
      refused = "a pose is cut short";
      continue;
    }
    FramedPose pose;
    std::string why;
    if (!into_scene_frame(transforms, scene.frame, message, pose, why)) {
      require(!why.empty(), "a pose is dropped without a reason");
      refused = why;
      continue;
    }
    const PoseVerdict verdict = timeline.add_pose(0, pose.in_scene);
    if (verdict == PoseVerdict::new_run) frames.clear();
    if (verdict != PoseVerdict::used && verdict != PoseVerdict::new_run) {
      refused = to_string(verdict);
      continue;
    }
    frames.add(pose);
    while (timeline.step()) {
      if (timeline.report().pose_reached) require_sound_output(scene, timeline, frames);
    }
  }
  return refused;
}

}  // namespace tissue_sim
