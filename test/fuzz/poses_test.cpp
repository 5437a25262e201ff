#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "floating_point_traps.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/ros/frames.h"
#include "tissue_sim/ros/messages.h"

namespace tissue_sim::poses_test {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t second = 1'000'000'000;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double bound = 1.8;  // m; the health check lets no vertex go farther than ten times the 17 cm of the organ
constexpr double force_bound = 1e6;  // N
constexpr double denormal = 1e-310;

Scene scene_of_a_ball(Model model) {
  Organ organ;
  organ.name = "ball";
  organ.mesh = make_sphere(0.05, 8);
  organ.model = model;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.wall_thickness = 0.004;
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
    if (organ.mesh.vertices[static_cast<std::size_t>(v)].x() < -0.04) organ.attached.push_back(v);
  }
  Instrument probe;
  probe.name = "probe";
  probe.parts.push_back({"tip", make_sphere(0.01, 6), true});
  Scene scene;
  scene.frame = "world";
  scene.organs.push_back(organ);
  scene.instruments.push_back(probe);
  return scene;
}

ros::Time time_of(std::int64_t nanoseconds) {
  return {static_cast<std::uint32_t>(nanoseconds / second), static_cast<std::uint32_t>(nanoseconds % second)};
}

/// What comes in and what must be said of it.
struct Shot {
  geometry_msgs::PoseStamped message;
  PoseVerdict expected = PoseVerdict::used;  ///< used: or what its stamp makes of it
  bool off_unit = false;                     ///< its quaternion is to be normalised, and counted
};

/// Poses of an instrument that wanders in and out of the organ, most a millisecond after the one before; every third is
/// broken in one way.
class Gun {
 public:
  explicit Gun(unsigned seed) : random_(seed) {}

  Shot fire(std::int64_t newest) {
    Shot shot;
    shot.message.header.frame_id = roll(4) == 0 ? "arm" : "world";
    std::int64_t stamp = newest + ms;
    auto& p = shot.message.pose.position;
    auto& q = shot.message.pose.orientation;
    for (double& x : place_) x = std::clamp(x + real(-0.003, 0.003), -0.06, 0.06);
    p.x = place_[0];
    p.y = place_[1];
    p.z = place_[2];
    Eigen::Quaterniond unit(1.0, real(-0.1, 0.1), real(-0.1, 0.1), real(-0.1, 0.1));
    if (roll(100) == 0) unit = Eigen::Quaterniond(real(-1, 1), real(-1, 1), real(-1, 1), real(0.1, 1));
    unit.normalize();
    double length = 1.0;
    if (roll(3) == 0) breakage(shot, p, stamp, newest, length);
    if (shot.off_unit || length != 1.0) unit.coeffs() *= length;
    q.x = unit.x();
    q.y = unit.y();
    q.z = unit.z();
    q.w = unit.w();
    if (bad_rotation_) {
      (roll(2) == 0 ? q.x : q.w) = roll(2) == 0 ? nan : -infinity;
      bad_rotation_ = false;
    }
    shot.message.header.stamp = time_of(stamp);
    return shot;
  }

 private:
  void breakage(Shot& shot, geometry_msgs::Point& p, std::int64_t& stamp, std::int64_t newest, double& length) {
    double& axis = roll(2) == 0 ? p.x : p.z;
    switch (roll(15)) {
      case 0:
        axis = roll(2) == 0 ? nan : infinity;
        shot.expected = PoseVerdict::non_finite;
        break;
      case 1:
        axis = roll(2) == 0 ? 1e300 : -1e4;
        shot.expected = PoseVerdict::too_far;
        break;
      case 2:
        axis = roll(2) == 0 ? denormal : -1e-300;
        break;
      case 3:
        axis = real(-900.0, 900.0);
        break;
      case 4:
        length = 0.0;
        shot.expected = PoseVerdict::zero_quaternion;
        break;
      case 5:
        length = roll(2) == 0 ? denormal : 1e-300;
        shot.expected = PoseVerdict::zero_quaternion;
        break;
      case 6:
        length = roll(2) == 0 ? 1e300 : real(1.1, 100.0);
        shot.off_unit = true;
        break;
      case 7:
        bad_rotation_ = true;
        shot.expected = PoseVerdict::non_finite;
        break;
      case 8:
        stamp = 0;
        shot.message.header.frame_id = "world";
        shot.expected = PoseVerdict::zero_stamp;
        break;
      case 9:
        stamp = 4'294'967'295 * second + roll(second);
        shot.message.header.frame_id = "world";
        shot.expected = PoseVerdict::late_stamp;
        break;
      case 10:
        stamp = newest;
        break;
      case 11:
        stamp = std::max<std::int64_t>(1, newest - roll(400 * ms));
        break;
      case 12:
        stamp = std::max<std::int64_t>(1, newest - roll(2 * second));
        break;
      case 13:
        stamp = newest + roll(5 * ms);
        break;
      default:
        stamp = 1 + roll(4'000'000'000 * second);  // any day of 130 years
        break;
    }
  }

  std::int64_t roll(std::int64_t below) { return std::uniform_int_distribution<std::int64_t>(0, below - 1)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  std::mt19937_64 random_;
  std::array<double, 3> place_{0.0, 0.0, 0.06};
  bool bad_rotation_ = false;
};

/// The path that the node and the replay take, and what a second look at each pose expects of it.
class Range {
 public:
  explicit Range(Model model) : scene_(scene_of_a_ball(model)), timeline_(scene_) {
    geometry_msgs::TransformStamped arm;
    arm.header.frame_id = "world";
    arm.child_frame_id = "arm";
    arm.header.stamp = time_of(second);
    arm.transform.rotation.w = arm.transform.rotation.z = std::sqrt(0.5);
    EXPECT_TRUE(give_transform(arm, "test", true, transforms_));
  }

  std::int64_t newest() const { return newest_; }

  void take(const Shot& shot) {
    FramedPose pose;
    std::string why;
    {
      const WithoutTraps off;  // tf2 computes with what it is given
      ASSERT_TRUE(into_scene_frame(transforms_, scene_.frame, shot.message, pose, why)) << why;
    }
    PoseVerdict expected = shot.expected;
    if (expected == PoseVerdict::used && newest_ > 0) {
      const std::int64_t stamp = pose.in_scene.stamp;
      if (newest_ - stamp > second / 2 || stamp - newest_ > 10 * second) {
        expected = PoseVerdict::new_run;
      } else if (stamp <= newest_) {
        expected = PoseVerdict::stale;
      }
    }
    const PoseVerdict verdict = timeline_.add_pose(0, pose.in_scene);
    ASSERT_EQ(verdict, expected) << shot.message;
    ++counted_[static_cast<std::size_t>(expected)];
    const bool taken = verdict == PoseVerdict::used || verdict == PoseVerdict::new_run;
    // A stale pose of a length that is not one was normalised too before its stamp was looked at.
    normalised_ += shot.off_unit;
    if (!taken) {
      ASSERT_FALSE(timeline_.step()) << "a step towards a pose that was dropped";
      return;
    }
    newest_ = pose.in_scene.stamp;
    while (timeline_.step()) look();
    // Nothing was clamped: the instrument stands where the pose says.
    const Pose& reached = timeline_.report().poses[0];
    ASSERT_EQ(timeline_.now(), newest_);
    ASSERT_EQ(reached.position, pose.in_scene.pose.position);
    ASSERT_NEAR(reached.orientation.norm(), 1.0, 1e-9);
  }

  /// Far away for two steps, in a leap that is no motion (one that is drags along what lies before it): nothing may
  /// collide any more.
  void leave() {
    Shot away;
    away.message.header.frame_id = "world";
    away.message.pose.orientation.w = 1.0;
    away.message.pose.position.z = 5.0;
    for (int step = 0; step < 2; ++step) {
      away.message.header.stamp = time_of(newest_ + ms);
      take(away);
    }
    ASSERT_TRUE(timeline_.report().contacts.empty());
    for (const double depth : timeline_.organ(0).depths) ASSERT_EQ(depth, 0.0);
    ASSERT_EQ(timeline_.report().wrenches[0].force, Vector3(0, 0, 0));
  }

  void check_counters() const {
    const TimelineCounters& counters = timeline_.counters();
    for (std::size_t verdict = 0; verdict < counted_.size(); ++verdict) {
      EXPECT_EQ(counters.poses[verdict], counted_[verdict]) << to_string(static_cast<PoseVerdict>(verdict));
      EXPECT_GT(counted_[verdict], 0U) << to_string(static_cast<PoseVerdict>(verdict));
    }
    EXPECT_EQ(counters.normalised_quaternions, normalised_);
    EXPECT_GT(contacts_, 0U);
  }

 private:
  void look() {
    const StepReport& report = timeline_.report();
    fill_contacts(scene_, report, contacts_message_);
    contacts_ += contacts_message_.contacts.size();
    for (const Contact& contact : contacts_message_.contacts) {
      const auto& p = contact.position;
      ASSERT_LT(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z), contact.depth}), bound);
      ASSERT_GE(contact.depth, 0.0);
      const auto& f = contact.force;
      ASSERT_LT(std::max({std::abs(f.x), std::abs(f.y), std::abs(f.z)}), force_bound);
      const auto& d = contact.direction;
      ASSERT_NEAR(d.x * d.x + d.y * d.y + d.z * d.z, 1.0, 1e-6);
    }
    const Wrench& wrench = report.wrenches[0];
    ASSERT_LT(wrench.force.norm(), force_bound);  // false for NaN
    ASSERT_LT(wrench.torque.norm(), force_bound);
    fill_state(scene_, timeline_, 0, 1, state_message_);
    for (const float x : state_message_.positions) ASSERT_LT(std::abs(x), bound);
    for (const float depth : state_message_.depths) ASSERT_TRUE(depth >= 0.0F && depth < bound);
    ASSERT_EQ(state_message_.header.stamp, to_ros_time(report.stamp));
  }

  Scene scene_;
  Timeline timeline_;
  tf2::BufferCore transforms_;
  TissueState state_message_;
  Contacts contacts_message_;
  std::int64_t newest_ = 0;
  std::array<std::uint64_t, pose_verdicts> counted_{};
  std::uint64_t normalised_ = 0, contacts_ = 0;
};

void shoot(Model model, int poses, unsigned seed) {
  Gun gun(seed);
  Range range(model);
  for (int i = 0; i < poses && !testing::Test::HasFatalFailure(); ++i) {
    SCOPED_TRACE("pose " + std::to_string(i));
    range.take(gun.fire(range.newest()));
    if (i % 100 == 99) range.leave();
  }
  range.check_counters();
}

/// A hundredth of them in the ordinary run; all with TISSUE_SIM_LONG=1.
int share_of(int poses) {
  return std::getenv("TISSUE_SIM_LONG") != nullptr ? poses : poses / 100;
}

TEST(HostilePoses, OfTenMillionEachIsUsedOrCountedByCause) {
  shoot(Model::contact_only, share_of(9'000'000), 1);
}

TEST(HostilePoses, LeaveAnElasticOrganFiniteAndInItsPlace) {
  shoot(Model::surface, share_of(1'000'000), 2);
}

}  // namespace
}  // namespace tissue_sim::poses_test
