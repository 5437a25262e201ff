#include "tissue_sim/ros/messages.h"

#include <gtest/gtest.h>

#include "ros/ball_scene.h"

namespace tissue_sim::messages_test {
namespace {

constexpr double half_root = 0.70710678118654752;

TEST(Messages, HashIsSixteenDigits) {
  EXPECT_EQ(hash_text(0), "0000000000000000");
  EXPECT_EQ(hash_text(0xfedcba9876543210U), "fedcba9876543210");
}

TEST(Messages, TimeKeepsEveryNanosecond) {
  const ros::Time time = to_ros_time(1'600'000'000'123'456'789);
  EXPECT_EQ(time.sec, 1'600'000'000U);
  EXPECT_EQ(time.nsec, 123'456'789U);
  EXPECT_TRUE(to_ros_time(-1).isZero());
}

TEST(Messages, PoseIsTakenAsItIs) {
  geometry_msgs::Pose message;
  message.position.y = 2.0;
  EXPECT_EQ(to_pose(message).orientation.norm(), 0.0);  // the timeline has to see that it is faulty
  EXPECT_EQ(to_pose(message).position, Vector3(0.0, 2.0, 0.0));
}

TEST(Messages, TopologyHoldsTheRestShape) {
  Scene scene = ball_scene(8, 6);
  const TissueTopology topology = topology_message(scene, 0);
  const TriangleMesh& mesh = scene.organs[0].mesh;
  ASSERT_EQ(topology.triangles.size(), 3 * mesh.triangles.size());
  ASSERT_EQ(topology.rest_positions.size(), 3 * mesh.vertices.size());
  EXPECT_EQ(topology.triangles[4], static_cast<std::uint32_t>(mesh.triangles[1][1]));
  EXPECT_EQ(topology.rest_positions[5], static_cast<float>(mesh.vertices[1].z()));
  EXPECT_EQ(topology.organ, "ball");
  EXPECT_EQ(topology.header.frame_id, "world");

  scene.organs[0].mesh.vertices[3].x() += 0.001;
  EXPECT_NE(topology_message(scene, 0).topology_id, topology.topology_id);
}

TEST(Messages, ContactsAreNamed) {
  const Scene scene = ball_scene(8, 6);
  StepReport report;
  report.step = 7;
  report.stamp = 2'000'000'001;
  OrganContact contact;
  contact.triangle = 5;
  contact.barycentric = {0.25, 0.5, 0.25};
  contact.point = {0.0, 0.0, 0.03};
  contact.direction = -Vector3::UnitZ();
  contact.depth = 0.002;
  contact.force = {0.0, 0.0, -0.5};
  report.contacts.push_back(contact);
  const Contacts message = contacts_message(scene, report);
  EXPECT_EQ(message.step, 7U);
  EXPECT_EQ(message.header.stamp, ros::Time(2, 1));
  ASSERT_EQ(message.contacts.size(), 1U);
  EXPECT_EQ(message.contacts[0].organ, "ball");
  EXPECT_EQ(message.contacts[0].instrument, "probe");
  EXPECT_EQ(message.contacts[0].link, "tip");
  EXPECT_EQ(message.contacts[0].triangle, 5U);
  EXPECT_EQ(message.contacts[0].barycentric[1], 0.5F);
  EXPECT_EQ(message.contacts[0].direction.z, -1.0);
  EXPECT_EQ(message.contacts[0].force.z, -0.5);
}

TEST(Messages, AMessageFilledAgainIsAsANewOne) {
  const Scene scene = ball_scene(8, 6);
  Timeline timeline(scene);
  const auto press = [&](std::int64_t stamp, double depth) {
    timeline.add_pose(0, {stamp, {Vector3(0.0, 0.0, 0.035 - depth), Eigen::Quaterniond::Identity()}});
    while (timeline.step()) {
    }
  };
  press(1'000'000'000, 0.004);
  TissueState state = state_message(scene, timeline, 0, 77);
  Contacts contacts = contacts_message(scene, timeline.report());
  ASSERT_GT(contacts.contacts.size(), 1U);
  const float* const room = state.positions.data();

  press(1'001'000'000, 0.003);
  fill_state(scene, timeline, 0, 77, state);
  fill_contacts(scene, timeline.report(), contacts);
  EXPECT_EQ(state, state_message(scene, timeline, 0, 77));
  EXPECT_EQ(contacts, contacts_message(scene, timeline.report()));
  EXPECT_EQ(state.positions.data(), room) << "nothing is allocated again";
  const OrganView view = timeline.organ(0);
  ASSERT_EQ(state.positions.size(), 3 * view.positions.size());
  for (std::size_t v = 0; v < view.positions.size(); ++v) {
    EXPECT_EQ(state.positions[3 * v + 2], static_cast<float>(view.positions[v].z()));
    EXPECT_EQ(state.depths[v], static_cast<float>(view.depths[v]));
  }

  press(1'002'000'000, -0.010);
  fill_contacts(scene, timeline.report(), contacts);
  EXPECT_TRUE(contacts.contacts.empty());
}

TEST(Messages, WrenchTurnsIntoThePosesFrame) {
  Wrench wrench;
  wrench.force = Vector3::UnitX();
  wrench.torque = Vector3::UnitZ();
  // A quarter turn about y: the frame's z axis is the scene's x axis.
  const Eigen::Quaterniond frame_to_scene(half_root, 0.0, half_root, 0.0);
  const geometry_msgs::WrenchStamped message = wrench_message(wrench, 3, "arm", frame_to_scene);
  EXPECT_EQ(message.header.frame_id, "arm");
  EXPECT_NEAR(message.wrench.force.z, 1.0, 1e-15);
  EXPECT_NEAR(message.wrench.force.x, 0.0, 1e-15);
  EXPECT_NEAR(message.wrench.torque.x, -1.0, 1e-15);
}

TEST(Messages, MarkersBeforeTheFirstStep) {
  const Scene scene = ball_scene(8, 6);
  const Timeline timeline(scene);
  const visualization_msgs::MarkerArray array = markers_message(scene, timeline);
  ASSERT_GE(array.markers.size(), 2U);
  EXPECT_EQ(array.markers[0].points.size(), 3 * scene.organs[0].mesh.triangles.size());
  EXPECT_EQ(array.markers[0].colors.size(), array.markers[0].points.size());
  // rviz calls a list without points an error.
  EXPECT_EQ(array.markers[1].ns, "contacts");
  EXPECT_EQ(array.markers[1].action, visualization_msgs::Marker::DELETE);
}

}  // namespace
}  // namespace tissue_sim::messages_test
