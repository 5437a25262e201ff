#include "tissue_sim/ros/transform_feed.h"

#include <tf2_msgs/TFMessage.h>

#include "tissue_sim/ros/frames.h"

// What roscpp asks of a type that it is to receive: it announces itself as what it stands for.
namespace ros {
namespace message_traits {

template <>
struct IsMessage<tissue_sim::RawTransforms> : TrueType {};

template <>
struct MD5Sum<tissue_sim::RawTransforms> : MD5Sum<tf2_msgs::TFMessage> {
  static const char* value(const tissue_sim::RawTransforms&) { return MD5Sum<tf2_msgs::TFMessage>::value(); }
  static const char* value() { return MD5Sum<tf2_msgs::TFMessage>::value(); }
};

template <>
struct DataType<tissue_sim::RawTransforms> {
  static const char* value(const tissue_sim::RawTransforms&) { return DataType<tf2_msgs::TFMessage>::value(); }
  static const char* value() { return DataType<tf2_msgs::TFMessage>::value(); }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<tissue_sim::RawTransforms> {
  template <typename Stream>
  static void read(Stream& stream, tissue_sim::RawTransforms& message) {
    const std::uint32_t length = stream.getLength();
    const std::uint8_t* const bytes = stream.advance(length);
    message.bytes.assign(bytes, bytes + length);
  }
};

}  // namespace serialization
}  // namespace ros

namespace tissue_sim {
namespace {

constexpr unsigned queue_size = 100;
constexpr double sender_warning_period = 5.0;  // s

}  // namespace

TransformFeed::TransformFeed(tf2::BufferCore& transforms) : transforms_(transforms) {
  node_.setCallbackQueue(&queue_);
  subscribe("/tf", false, moving_);
  subscribe("/tf_static", true, static_);
  spinner_.start();
}

/// The thread ends before the members that it works on.
TransformFeed::~TransformFeed() {
  spinner_.stop();
}

void TransformFeed::subscribe(const std::string& topic, bool is_static, ros::Subscriber& subscriber) {
  const boost::function<void(const ros::MessageEvent<const RawTransforms>&)> take_event =
      [this, is_static](const ros::MessageEvent<const RawTransforms>& event) {
        take(*event.getConstMessage(), event.getPublisherName(), is_static);
      };
  subscriber = node_.subscribe<RawTransforms>(topic, queue_size, take_event);
}

void TransformFeed::take(const RawTransforms& message, const std::string& sender, bool is_static) {
  const ros::Time now = ros::Time::now();
  if (now < last_) {  // a simulated clock began anew: tf2 keeps refusing what is older than what it holds
    ROS_WARN("the clock went back: transforms are forgotten");
    transforms_.clear();
  }
  last_ = now;
  tf2_msgs::TFMessage parsed;
  std::vector<std::uint8_t> bytes = message.bytes;
  if (!deserialize_transforms(bytes, parsed)) {
    ROS_WARN_STREAM_THROTTLE(sender_warning_period, sender << " sends transforms that are cut short; they are dropped");
    return;
  }
  for (const geometry_msgs::TransformStamped& transform : parsed.transforms) {
    give_transform(transform, sender, is_static, transforms_);
  }
}

}  // namespace tissue_sim
