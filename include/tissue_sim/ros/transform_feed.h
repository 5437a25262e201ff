#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2/buffer_core.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tissue_sim {

/// A tf2_msgs/TFMessage as it came over the wire.
struct RawTransforms {
  std::vector<std::uint8_t> bytes;
};

/// Carries /tf and /tf_static into a buffer of tf2, in a thread of its own. As tf2_ros::TransformListener does, which
/// anybody in the graph can end together with its node: by one transform stamped in the year 2106, or by a message of a
/// hundred bytes that announces a hundred million transforms.
class TransformFeed {
 public:
  explicit TransformFeed(tf2::BufferCore& transforms);
  ~TransformFeed();
  TransformFeed(const TransformFeed&) = delete;
  TransformFeed& operator=(const TransformFeed&) = delete;

 private:
  void subscribe(const std::string& topic, bool is_static, ros::Subscriber& subscriber);
  void take(const RawTransforms& message, const std::string& sender, bool is_static);

  tf2::BufferCore& transforms_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber moving_, static_;
  ros::Time last_;  ///< on the clock, of the last message
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace tissue_sim
