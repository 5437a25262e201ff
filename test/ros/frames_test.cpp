#include "tissue_sim/ros/frames.h"

#include <gtest/gtest.h>
#include <ros/serialization.h>

#include <cmath>
#include <vector>

#include "floating_point_traps.h"

namespace tissue_sim::frames_test {
namespace {

constexpr double half_root = 0.70710678118654752;

geometry_msgs::PoseStamped pose_at(std::uint32_t seconds, const std::string& frame) {
  geometry_msgs::PoseStamped message;
  message.header.stamp = ros::Time(seconds, 0);
  message.header.frame_id = frame;
  message.pose.position.x = 1.0;
  message.pose.orientation.w = 1.0;
  return message;
}

/// `arm` stands at (0, 0, height) of `world`, a quarter turn about z.
geometry_msgs::TransformStamped arm_at(std::uint32_t seconds, double height) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = ros::Time(seconds, 0);
  message.header.frame_id = "world";
  message.child_frame_id = "arm";
  message.transform.translation.z = height;
  message.transform.rotation.w = half_root;
  message.transform.rotation.z = half_root;
  return message;
}

TEST(Frames, TheScenesOwnFrameNeedsNoTransform) {
  const tf2::BufferCore empty;
  FramedPose pose;
  std::string why;
  ASSERT_TRUE(into_scene_frame(empty, "world", pose_at(5, "world"), pose, why));
  EXPECT_EQ(pose.in_scene.stamp, 5'000'000'000);
  EXPECT_EQ(pose.in_scene.pose.position, Vector3::UnitX());
  EXPECT_TRUE(into_scene_frame(empty, "world", pose_at(5, "/world"), pose, why));
  EXPECT_EQ(pose.frame, "/world");  // the wrench goes back with the name that came
}

TEST(Frames, TheTransformIsTheOneAtTheStamp) {
  tf2::BufferCore transforms;
  transforms.setTransform(arm_at(10, 0.0), "test");
  transforms.setTransform(arm_at(12, 4.0), "test");
  FramedPose pose;
  std::string why;
  ASSERT_TRUE(into_scene_frame(transforms, "world", pose_at(11, "arm"), pose, why)) << why;
  EXPECT_TRUE(pose.in_scene.pose.position.isApprox(Vector3(0.0, 1.0, 2.0), 1e-9));
  EXPECT_TRUE((pose.frame_to_scene * Vector3::UnitX()).isApprox(Vector3::UnitY(), 1e-9));
}

TEST(Frames, WhatIsMissingIsNamed) {
  tf2::BufferCore transforms;
  transforms.setTransform(arm_at(10, 0.0), "test");
  FramedPose pose;
  std::string why;
  EXPECT_FALSE(into_scene_frame(transforms, "world", pose_at(10, "nowhere"), pose, why));
  EXPECT_NE(why.find("\"nowhere\""), std::string::npos);
  EXPECT_NE(why.find("\"world\""), std::string::npos);
  EXPECT_FALSE(into_scene_frame(transforms, "world", pose_at(11, "arm"), pose, why));  // nothing is extrapolated
  EXPECT_FALSE(into_scene_frame(transforms, "world", pose_at(10, ""), pose, why));
  EXPECT_NE(why.find("header.frame_id"), std::string::npos);
}

TEST(Frames, AFaultyQuaternionStaysFaulty) {
  tf2::BufferCore transforms;
  transforms.setTransform(arm_at(10, 0.0), "test");
  geometry_msgs::PoseStamped message = pose_at(10, "arm");
  FramedPose pose;
  std::string why;
  message.pose.orientation.w = 0.0;
  ASSERT_TRUE(into_scene_frame(transforms, "world", message, pose, why));
  EXPECT_EQ(pose.in_scene.pose.orientation.norm(), 0.0);
  message.pose.orientation.w = 2.0;
  ASSERT_TRUE(into_scene_frame(transforms, "world", message, pose, why));
  EXPECT_NEAR(pose.in_scene.pose.orientation.norm(), 2.0, 1e-12);
}

TEST(Frames, AZeroStampIsLeftToTheTimeline) {
  const tf2::BufferCore empty;
  FramedPose pose;
  std::string why;
  EXPECT_TRUE(into_scene_frame(empty, "world", pose_at(0, "nowhere"), pose, why));
  EXPECT_EQ(pose.in_scene.stamp, 0);
}

TEST(Transforms, OfTheLastSecondsOfRosTimeAreRefusedNotThrown) {
  tf2::BufferCore transforms;  // keeps 10 s
  geometry_msgs::TransformStamped arm;
  arm.header.frame_id = "world";
  arm.child_frame_id = "arm";
  arm.transform.rotation.w = 1.0;
  for (const std::uint32_t second : {4294967295U, 4294967290U, 4294967285U}) {
    arm.header.stamp = ros::Time(second, 999999999);
    EXPECT_FALSE(give_transform(arm, "test", false, transforms)) << second;
  }
  arm.header.stamp = ros::Time(4294967280U, 0);
  EXPECT_TRUE(give_transform(arm, "test", false, transforms));
  arm.transform.rotation.w = std::nan("");
  const WithoutTraps off;  // it compares it
  EXPECT_FALSE(give_transform(arm, "test", false, transforms)) << "tf2 takes no NaN";
}

TEST(Transforms, AreCountedBeforeThereIsRoomForThem) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(2);
  message.transforms[1].child_frame_id = "arm";
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);

  tf2_msgs::TFMessage read;
  ASSERT_TRUE(deserialize_transforms(bytes, read));
  EXPECT_EQ(read.transforms.size(), 2U);
  EXPECT_EQ(read.transforms[1].child_frame_id, "arm");
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<long>(length));
    EXPECT_FALSE(deserialize_transforms(cut, read)) << length;
  }
  bytes[3] = 0xff;  // four billion of them
  EXPECT_FALSE(deserialize_transforms(bytes, read));
}

TEST(FrameHistory, GivesTheLastPoseAtOrBefore) {
  FrameHistory history;
  EXPECT_EQ(history.at(5), nullptr);
  for (const std::int64_t stamp : {10, 20, 30}) {
    FramedPose pose;
    pose.in_scene.stamp = stamp;
    history.add(pose);
  }
  EXPECT_EQ(history.at(15)->in_scene.stamp, 10);
  EXPECT_EQ(history.at(20)->in_scene.stamp, 20);
  EXPECT_EQ(history.at(99)->in_scene.stamp, 30);
  history.clear();
  EXPECT_EQ(history.at(99), nullptr);
}

}  // namespace
}  // namespace tissue_sim::frames_test
