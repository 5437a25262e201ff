#include "tissue_sim/replay/replay.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <cstdlib>
#include <fstream>
#include <set>

#include "ros/ball_scene.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::replay_test {
namespace {

bool exists(const std::string& path) {
  return std::ifstream(path).good();
}

class ReplayTest : public testing::Test {
 protected:
  void SetUp() override {
    options.input = (folder.path / "in.bag").string();
    options.output = (folder.path / "out.bag").string();
  }

  /// 50 poses in 0.5 s, from above the ball to 4 mm inside it.
  void record(const std::string& topic, rosbag::Bag& bag) const {
    for (std::uint32_t i = 0; i < 50; ++i) {
      geometry_msgs::PoseStamped message;
      message.header.frame_id = "world";
      message.header.stamp = ros::Time(100, i * 10'000'000);
      message.pose.position.z = 0.037 - 0.006 * i / 49.0;
      message.pose.orientation.w = 1.0;
      bag.write(topic, message.header.stamp, message);
    }
  }
  void record(const std::string& topic) const {
    rosbag::Bag bag(options.input, rosbag::bagmode::Write);
    record(topic, bag);
  }

  /// What replay() says; empty where it says nothing.
  std::string refusal() const {
    try {
      replay(ball_scene(12, 8), options);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder;
  ReplayOptions options;
};

TEST_F(ReplayTest, WritesWhatTheNodePublishes) {
  record("/test/measured_cp");  // with a slash, which the scene does not write
  const ReplaySummary summary = replay(ball_scene(12, 8), options);
  EXPECT_EQ(summary.poses_used, 50U);
  EXPECT_EQ(summary.poses_dropped(), 0U);
  EXPECT_EQ(summary.rows.size(), 50U);
  EXPECT_NEAR(summary.sim_seconds, 0.49, 1e-9);
  EXPECT_GT(summary.contact_steps, 0U);
  EXPECT_GT(summary.depth_max, 0.003);
  EXPECT_EQ(summary.non_finite, 0U);

  rosbag::Bag bag(options.output);
  const auto count = [&](const std::string& topic) {
    return rosbag::View(bag, rosbag::TopicQuery("/tissue_sim/" + topic)).size();
  };
  EXPECT_EQ(count("ball/topology"), 1U);
  EXPECT_EQ(count("contacts"), 50U);
  EXPECT_EQ(count("probe/measured_cf"), 50U);
  EXPECT_EQ(count("ball/state"), 25U);  // on the stamps of poses, 10 ms apart, that are 16 ms or more apart
  EXPECT_FALSE(exists(options.output + ".unfinished"));
}

TEST_F(ReplayTest, TwiceIsTheSame) {
  record("test/measured_cp");
  const std::uint64_t first = replay(ball_scene(12, 8), options).hash;
  EXPECT_EQ(replay(ball_scene(12, 8), options).hash, first);
}

TEST_F(ReplayTest, WritesAHashAStep) {
  record("test/measured_cp");
  options.hashes = (folder.path / "hashes.txt").string();
  const ReplaySummary summary = replay(ball_scene(12, 8), options);
  std::ifstream file(options.hashes);
  std::uint64_t steps = 0;
  std::uint64_t step = 0;
  std::int64_t stamp = 0;
  std::string hash;
  std::set<std::string> different;
  while (file >> step >> stamp >> hash) {
    EXPECT_EQ(step, ++steps);
    EXPECT_EQ(stamp, 100'000'000'000 + (static_cast<std::int64_t>(steps) - 1) * 1'000'000);
    different.insert(hash);
  }
  EXPECT_EQ(steps, summary.steps);
  EXPECT_EQ(different.size(), steps) << "each is of all states so far";
  EXPECT_EQ(hash, hash_text(summary.hash));
  options.hashes = (folder.path / "nowhere" / "hashes.txt").string();
  EXPECT_NE(refusal().find("nowhere/hashes.txt: cannot be written"), std::string::npos) << refusal();
}

TEST_F(ReplayTest, HoldGoesOnAfterTheLastPose) {
  record("test/measured_cp");
  options.hold = 0.25;
  EXPECT_NEAR(replay(ball_scene(12, 8), options).sim_seconds, 0.74, 1e-9);
}

TEST_F(ReplayTest, MissingBag) {
  EXPECT_NE(refusal().find("in.bag: cannot be read"), std::string::npos) << refusal();
  EXPECT_FALSE(exists(options.output));
}

TEST_F(ReplayTest, NotABag) {
  std::ofstream(options.input) << "frame: world\n";
  EXPECT_NE(refusal().find("in.bag: not a bag"), std::string::npos) << refusal();
  std::ofstream(options.input, std::ios::trunc).close();
  EXPECT_NE(refusal().find("in.bag: not a bag"), std::string::npos) << refusal();
  EXPECT_FALSE(exists(options.output));
}

TEST_F(ReplayTest, UnindexedBagNamesTheCure) {
  {
    // The index is written when a bag is closed: a copy from before has none.
    rosbag::Bag bag((folder.path / "cut.bag").string(), rosbag::bagmode::Write);
    bag.setChunkThreshold(1);
    record("test/measured_cp", bag);
    std::ifstream source((folder.path / "cut.bag").string(), std::ios::binary);
    std::ofstream(options.input, std::ios::binary) << source.rdbuf();
  }
  EXPECT_NE(refusal().find("rosbag reindex"), std::string::npos) << refusal();
}

TEST_F(ReplayTest, MissingTopicListsTheOthers) {
  record("/PSM1/measured_cp");
  EXPECT_NE(refusal().find("test/measured_cp"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find("/PSM1/measured_cp"), std::string::npos) << refusal();
  EXPECT_FALSE(exists(options.output));
}

TEST_F(ReplayTest, TopicOfAnotherType) {
  rosbag::Bag bag(options.input, rosbag::bagmode::Write);
  bag.write("/test/measured_cp", ros::Time(100, 0), geometry_msgs::TransformStamped());
  bag.close();
  EXPECT_NE(refusal().find("is geometry_msgs/TransformStamped, not geometry_msgs/PoseStamped"), std::string::npos)
      << refusal();
}

TEST_F(ReplayTest, OutputThatCannotBeWritten) {
  record("test/measured_cp");
  options.output = (folder.path / "nowhere" / "out.bag").string();
  EXPECT_NE(refusal().find("cannot be written"), std::string::npos) << refusal();
  options.output = options.input;
  EXPECT_NE(refusal().find("another name"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace tissue_sim::replay_test
