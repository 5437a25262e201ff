#include "tissue_sim/simulation/timeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "simulation/test_scenes.h"

namespace tissue_sim::timeline_test {
namespace {

constexpr std::int64_t ms = 1'000'000;     // ns
constexpr std::int64_t start = 1000 * ms;  // ns
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
const Vector3 far_away(0.3, 0.0, 0.0);

Scene quick_scene(int instruments = 1) {
  Organ organ = wall_sphere(8);
  organ.attached.clear();
  organ.model = Model::contact_only;
  std::vector<Instrument> balls;
  for (int i = 0; i < instruments; ++i) balls.push_back(ball(0.01, "ball_" + std::to_string(i)));
  return scene_of(organ, balls);
}

Scene elastic_scene() {
  return scene_of(wall_sphere(12), {ball(0.01)});
}

StampedPose at(std::int64_t stamp, const Vector3& position = far_away) {
  return {stamp, {position, Eigen::Quaterniond::Identity()}};
}

std::uint64_t count(const Timeline& timeline, PoseVerdict verdict) {
  return timeline.counters().poses[static_cast<std::size_t>(verdict)];
}

/// Steps as far as the poses allow; the stamps that were passed.
std::vector<std::int64_t> run(Timeline& timeline) {
  std::vector<std::int64_t> stamps;
  while (timeline.step()) stamps.push_back(timeline.report().stamp);
  return stamps;
}

bool at_rest(const Timeline& timeline, const Scene& scene) {
  const OrganView organ = timeline.organ(0);
  const std::vector<Vector3>& rest = scene.organs.front().mesh.vertices;
  return std::equal(organ.positions.begin(), organ.positions.end(), rest.begin(), rest.end());
}

/// A ball pressed 10 mm into the sphere and back out, one pose every 5 ms.
std::vector<StampedPose> press(std::int64_t first = start) {
  std::vector<StampedPose> poses;
  for (int i = 0; i <= 20; ++i) {
    const double depth = 0.012 * (1.0 - std::abs(i - 10) / 10.0) - 0.002;
    poses.push_back(at(first + 5 * ms * i, {0.06 - depth, 0.002, 0.001}));
  }
  return poses;
}

TEST(Timeline, NothingToDoBeforeTheFirstPose) {
  Timeline timeline(quick_scene());
  EXPECT_FALSE(timeline.step());
  EXPECT_FALSE(timeline.step_holding(start));
  EXPECT_EQ(timeline.now(), 0);
}

TEST(Timeline, TheFirstStepEndsOnTheFirstPosesStamp) {
  Timeline timeline(quick_scene());
  EXPECT_EQ(timeline.add_pose(0, at(start)), PoseVerdict::used);
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start});
  EXPECT_EQ(timeline.report().step, 1u);
  EXPECT_TRUE(timeline.report().pose_reached);
  EXPECT_TRUE(timeline.report().state_due);
  EXPECT_EQ(timeline.report().placed.at(0), 1);
  EXPECT_EQ(timeline.report().poses.at(0).position, far_away);
}

TEST(Timeline, TheWayIsCutEquallyInWholeNanosecondsAndLandsOnTheStamp) {
  Timeline timeline(quick_scene());
  timeline.add_pose(0, at(start));
  run(timeline);
  const std::int64_t gap = 10 * ms + 7;  // 11 steps
  timeline.add_pose(0, at(start + gap, far_away + Vector3(0.011, 0.0, 0.0)));
  const std::vector<std::int64_t> stamps = run(timeline);
  ASSERT_EQ(stamps.size(), 11u);
  std::int64_t before = start;
  for (const std::int64_t stamp : stamps) {
    EXPECT_LE(stamp - before, ms);
    EXPECT_GE(stamp - before, gap / 11);
    EXPECT_LE(stamp - before, gap / 11 + 1);
    before = stamp;
  }
  EXPECT_EQ(stamps.back(), start + gap);
  EXPECT_EQ(timeline.report().poses[0].position, far_away + Vector3(0.011, 0.0, 0.0));
}

TEST(Timeline, StepsLandOnEveryStampOfUnevenPosesAndAreNeverLongerThanTheTimeStep) {
  Timeline timeline(quick_scene());
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int64_t> gap(1, 4 * ms);
  std::vector<std::int64_t> stamps = {start};
  for (int i = 0; i < 300; ++i) stamps.push_back(stamps.back() + gap(random));
  for (const std::int64_t stamp : stamps) ASSERT_EQ(timeline.add_pose(0, at(stamp)), PoseVerdict::used);
  std::int64_t before = start - ms;
  std::size_t next = 0;
  while (timeline.step()) {
    EXPECT_LE(timeline.report().stamp - before, ms);
    EXPECT_GT(timeline.report().stamp, before);
    before = timeline.report().stamp;
    ASSERT_LE(before, stamps.at(next));
    EXPECT_EQ(timeline.report().pose_reached, before == stamps[next]);
    if (before == stamps[next]) ++next;
  }
  EXPECT_EQ(next, stamps.size());
}

TEST(Timeline, PositionGoesInALineAndRotationTheShortWay) {
  Timeline timeline(quick_scene());
  StampedPose first = at(start);
  StampedPose second = at(start + 4 * ms, far_away + Vector3(0.0, 0.004, 0.0));
  second.pose.orientation = Eigen::AngleAxisd(0.8, Vector3::UnitZ());
  timeline.add_pose(0, first);
  run(timeline);
  timeline.add_pose(0, second);
  ASSERT_TRUE(timeline.step());
  const Pose& quarter = timeline.report().poses[0];
  EXPECT_NEAR((quarter.position - far_away - Vector3(0.0, 0.001, 0.0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(quarter.orientation.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vector3::UnitZ()))), 0.0,
              1e-7);
}

TEST(Timeline, AQuaternionAndItsNegativeGiveTheSameBits) {
  const auto hash = [](double sign) {
    Scene scene = elastic_scene();
    scene.instruments[0].parts[0].mesh = make_box({0.02, 0.01, 0.015});
    Timeline timeline(scene);
    int i = 0;
    for (StampedPose pose : press()) {
      pose.pose.orientation = Eigen::AngleAxisd(0.1 * i, Vector3(1.0, 2.0, 3.0).normalized());
      if (i++ % 2 == 1) pose.pose.orientation.coeffs() *= sign;
      timeline.add_pose(0, pose);
    }
    run(timeline);
    EXPECT_GT(timeline.counters().poses[0], 0u);
    return timeline.hash();
  };
  EXPECT_EQ(hash(1.0), hash(-1.0));
}

TEST(Timeline, PosesOfNoUseAreNamedAndCounted) {
  Timeline timeline(quick_scene());
  timeline.add_pose(0, at(start));
  run(timeline);

  EXPECT_EQ(timeline.add_pose(0, at(0)), PoseVerdict::zero_stamp);
  EXPECT_EQ(timeline.add_pose(0, at(-5)), PoseVerdict::zero_stamp);
  for (const double bad : {not_a_number, infinity, -infinity}) {
    EXPECT_EQ(timeline.add_pose(0, at(start + ms, {0.0, bad, 0.0})), PoseVerdict::non_finite) << bad;
  }
  for (const double far : {1e300, -1001.0}) {
    EXPECT_EQ(timeline.add_pose(0, at(start + ms, {0.0, far, 0.0})), PoseVerdict::too_far) << far;
  }
  // A day before the end of a ros::Time and later.
  const std::int64_t end = (std::int64_t{1} << 32) * 1'000'000'000;
  EXPECT_EQ(timeline.add_pose(0, at(end - 1)), PoseVerdict::late_stamp);
  EXPECT_EQ(timeline.add_pose(0, at(end - 86'400 * 1'000'000'000LL)), PoseVerdict::late_stamp);
  StampedPose pose = at(start + ms);
  pose.pose.orientation.coeffs() << 0.0, 0.0, not_a_number, 1.0;
  EXPECT_EQ(timeline.add_pose(0, pose), PoseVerdict::non_finite);
  pose.pose.orientation.coeffs() << 0.0, infinity, 0.0, 1.0;
  EXPECT_EQ(timeline.add_pose(0, pose), PoseVerdict::non_finite);
  pose.pose.orientation.coeffs().setZero();
  EXPECT_EQ(timeline.add_pose(0, pose), PoseVerdict::zero_quaternion);
  EXPECT_EQ(timeline.add_pose(0, at(start)), PoseVerdict::stale);
  EXPECT_EQ(timeline.add_pose(0, at(start - 558)), PoseVerdict::stale);
  EXPECT_EQ(timeline.add_pose(0, at(start - 500 * ms)), PoseVerdict::stale);

  EXPECT_EQ(count(timeline, PoseVerdict::used), 1u);
  EXPECT_EQ(count(timeline, PoseVerdict::zero_stamp), 2u);
  EXPECT_EQ(count(timeline, PoseVerdict::late_stamp), 2u);
  EXPECT_EQ(count(timeline, PoseVerdict::non_finite), 5u);
  EXPECT_EQ(count(timeline, PoseVerdict::too_far), 2u);
  EXPECT_EQ(count(timeline, PoseVerdict::zero_quaternion), 1u);
  EXPECT_EQ(count(timeline, PoseVerdict::stale), 3u);
  EXPECT_FALSE(timeline.step());
  EXPECT_EQ(timeline.now(), start);
  EXPECT_EQ(timeline.report().poses[0].position, far_away);
}

TEST(Timeline, AQuaternionOffUnitLengthIsNormalisedAndCounted) {
  Timeline timeline(quick_scene());
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.7, Vector3::UnitY()));
  StampedPose pose = at(start);
  for (const double length : {1.0, 1.0 + 1e-6, 2.0, 1e-3, 1e300}) {
    pose.pose.orientation.coeffs() = length * turned.coeffs();
    EXPECT_EQ(timeline.add_pose(0, pose), PoseVerdict::used);
    run(timeline);
    EXPECT_NEAR((timeline.report().poses[0].orientation.coeffs() - turned.coeffs()).norm(), 0.0, 1e-14) << length;
    pose.stamp += ms;
  }
  EXPECT_EQ(timeline.counters().normalised_quaternions, 3u);
}

TEST(Timeline, AFarBackwardJumpIsANewRunWithTheOrgansAtRest) {
  const Scene scene = quick_scene();
  Timeline timeline(scene);
  timeline.add_pose(0, at(start + 2000 * ms, {0.065, 0.0, 0.0}));
  timeline.add_pose(0, at(start + 2010 * ms, {0.050, 0.0, 0.0}));
  run(timeline);
  ASSERT_FALSE(at_rest(timeline, scene));
  const std::uint64_t step = timeline.report().step;

  EXPECT_EQ(timeline.add_pose(0, at(start)), PoseVerdict::new_run);
  EXPECT_TRUE(at_rest(timeline, scene));
  EXPECT_EQ(timeline.counters().resets, 1u);
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start});
  EXPECT_EQ(timeline.report().step, step + 1);
  EXPECT_TRUE(timeline.report().state_due);
  EXPECT_EQ(timeline.add_pose(0, at(start + ms)), PoseVerdict::used);
}

TEST(Timeline, PosesFartherApartThanTheLongestGapStartANewRun) {
  Timeline timeline(quick_scene());
  timeline.add_pose(0, at(start));
  run(timeline);
  EXPECT_EQ(timeline.add_pose(0, at(start + 10'001 * ms)), PoseVerdict::new_run);
  EXPECT_EQ(run(timeline).size(), 1u);
  const std::int64_t late = ((std::int64_t{1} << 32) - 100'000) * 1'000'000'000;  // a day and more before stamps end
  EXPECT_EQ(timeline.add_pose(0, at(late)), PoseVerdict::new_run);
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{late});
  EXPECT_EQ(timeline.add_pose(0, at(start)), PoseVerdict::new_run);
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start});
}

TEST(Timeline, NewestOnlyPassesOverThePosesBefore) {
  TimelineOptions options;
  options.newest_only = true;
  Timeline timeline(quick_scene(), options);
  timeline.add_pose(0, at(start));
  run(timeline);
  for (int i = 1; i <= 4; ++i) timeline.add_pose(0, at(start + i * ms / 4));
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start + ms});
  EXPECT_EQ(timeline.counters().poses_superseded, 3u);
}

TEST(Timeline, HoldingStepsOnWithTheLastPose) {
  Timeline timeline(quick_scene());
  timeline.add_pose(0, at(start));
  std::vector<std::int64_t> stamps;
  while (timeline.step_holding(start + 3 * ms + 1)) stamps.push_back(timeline.report().stamp);
  EXPECT_EQ(stamps, (std::vector<std::int64_t>{start, start + ms, start + 2 * ms, start + 3 * ms}));
  EXPECT_FALSE(timeline.report().pose_reached);
  EXPECT_EQ(timeline.report().poses[0].position, far_away);
  EXPECT_EQ(timeline.add_pose(0, at(start + 2 * ms)), PoseVerdict::stale);
  EXPECT_EQ(timeline.add_pose(0, at(start + 4 * ms)), PoseVerdict::used);
}

TEST(Timeline, StatesAreDueOncePerPeriodAndOnPoses) {
  Timeline timeline(quick_scene());
  for (int i = 0; i < 50; ++i) timeline.add_pose(0, at(start + i * 5 * ms));
  std::int64_t last = 0;
  int due = 0;
  while (timeline.step()) {
    const StepReport& report = timeline.report();
    if (!report.state_due) continue;
    EXPECT_TRUE(report.pose_reached);
    if (last > 0) {
      EXPECT_EQ(report.stamp - last, 20 * ms);  // the first pose after 16 ms
    }
    last = report.stamp;
    ++due;
  }
  EXPECT_EQ(due, 13);
}

TEST(Timeline, BetweenPosesThatAreFarApartStatesAreDueEveryPeriod) {
  Timeline timeline(quick_scene());
  timeline.add_pose(0, at(start));
  timeline.add_pose(0, at(start + 100 * ms));
  std::vector<std::int64_t> due;
  while (timeline.step()) {
    if (timeline.report().state_due) due.push_back((timeline.report().stamp - start) / ms);
  }
  EXPECT_EQ(due, (std::vector<std::int64_t>{0, 16, 32, 48, 64, 80, 100}));
}

TEST(Timeline, ResetBetweenStepsPutsTheOrganAtRest) {
  const Scene scene = elastic_scene();
  Timeline timeline(scene);
  const std::vector<StampedPose> poses = press();
  for (std::size_t i = 0; i <= 10; ++i) timeline.add_pose(0, poses[i]);
  run(timeline);
  ASSERT_FALSE(at_rest(timeline, scene));
  const std::int64_t now = timeline.now();
  const std::uint64_t step = timeline.report().step;
  timeline.reset(-1);
  EXPECT_TRUE(at_rest(timeline, scene));
  EXPECT_EQ(timeline.counters().resets, 1u);
  EXPECT_EQ(timeline.now(), now);
  EXPECT_EQ(timeline.kinetic_energy(), 0.0);
  EXPECT_NEAR(timeline.elastic_energy(), 0.0, 1e-15);
  EXPECT_EQ(timeline.active_vertices(), 0);
  timeline.add_pose(0, at(now + ms));
  ASSERT_TRUE(timeline.step());
  EXPECT_EQ(timeline.report().step, step + 1);
}

TEST(Timeline, TwoInstrumentsWaitForEachOther) {
  Timeline timeline(quick_scene(2));
  timeline.add_pose(0, at(start));
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start});
  EXPECT_EQ(timeline.report().placed, (std::vector<char>{1, 0}));
  timeline.add_pose(1, at(start + ms, -far_away));
  EXPECT_TRUE(run(timeline).empty()) << "the first has not said where it will be";
  timeline.add_pose(0, at(start + 3 * ms, far_away + Vector3(0.003, 0.0, 0.0)));
  EXPECT_EQ(run(timeline), std::vector<std::int64_t>{start + ms}) << "and now the second has not";
  EXPECT_NEAR(timeline.report().poses[0].position.x(), far_away.x() + 0.001, 1e-12) << "a third of its way";
  timeline.add_pose(1, at(start + 3 * ms, -far_away));
  run(timeline);
  EXPECT_EQ(timeline.now(), start + 3 * ms);
  EXPECT_EQ(timeline.report().placed, (std::vector<char>{1, 1}));
  EXPECT_EQ(timeline.report().poses[0].position, far_away + Vector3(0.003, 0.0, 0.0));
}

TEST(Timeline, AnInstrumentThatFallsSilentIsHeldAndNotWaitedFor) {
  Timeline timeline(quick_scene(2));
  timeline.add_pose(0, at(start));
  timeline.add_pose(1, at(start + 1, -far_away));
  timeline.add_pose(0, at(start + 499 * ms));
  run(timeline);
  EXPECT_LT(timeline.now(), start + 499 * ms);
  timeline.add_pose(0, at(start + 501 * ms));
  run(timeline);
  EXPECT_EQ(timeline.now(), start + 501 * ms);
  EXPECT_EQ(timeline.report().poses[1].position, -far_away);
  EXPECT_EQ(timeline.report().placed[1], 1);
}

TEST(Timeline, TheSamePosesGiveTheSameHashHoweverTheyArrive) {
  const Scene scene = elastic_scene();
  Timeline all_at_once(scene);
  Timeline one_by_one(scene);
  for (const StampedPose& pose : press()) all_at_once.add_pose(0, pose);
  run(all_at_once);
  for (const StampedPose& pose : press()) {
    one_by_one.add_pose(0, pose);
    run(one_by_one);
  }
  EXPECT_EQ(all_at_once.hash(), one_by_one.hash());
  EXPECT_NE(all_at_once.hash(), 0u);
  EXPECT_EQ(all_at_once.report().step, one_by_one.report().step);
}

/// Poses at random, up to 200 m/s fast, with every fault among them. Returns how often the health check had to put a
/// state back.
std::uint64_t feed_hostile_poses(const Scene& scene, int poses) {
  Timeline timeline(scene);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::uniform_int_distribution<int> kind(0, 19);
  std::int64_t stamp = start;
  int contacts = 0;
  for (int i = 0; i < poses; ++i) {
    stamp += 1 + static_cast<std::int64_t>(0.5 * static_cast<double>(ms) * (1.0 + unit(random)));
    StampedPose pose = at(stamp, 0.1 * Vector3(unit(random), unit(random), unit(random)));
    pose.pose.orientation.coeffs() << unit(random), unit(random), unit(random), unit(random);
    switch (kind(random)) {
      case 0:
        pose.pose.position.x() = not_a_number;
        break;
      case 1:
        pose.pose.position.z() = infinity;
        break;
      case 2:
        pose.pose.orientation.coeffs() *= 0.0;
        break;
      case 3:
        pose.pose.orientation.coeffs() *= 1e300;
        break;
      case 4:
        pose.stamp -= 558;
        break;
      case 5:
        pose.stamp = 0;
        break;
      case 6:
        pose.pose.position *= 1e4;
        break;
      default:
        break;
    }
    timeline.add_pose(0, pose);
    while (timeline.step()) {
      const StepReport& report = timeline.report();
      EXPECT_TRUE(report.wrenches[0].force.allFinite() && report.wrenches[0].torque.allFinite());
      for (const OrganContact& contact : report.contacts) {
        EXPECT_TRUE(contact.point.allFinite() && contact.direction.allFinite() && contact.force.allFinite());
        EXPECT_TRUE(std::isfinite(contact.depth) && contact.depth >= 0.0);
      }
      contacts += static_cast<int>(report.contacts.size());
      const OrganView organ = timeline.organ(0);
      for (std::size_t v = 0; v < organ.positions.size(); ++v) {
        EXPECT_TRUE(organ.positions[v].allFinite()) << "pose " << i << " vertex " << v;
        EXPECT_TRUE(std::isfinite(organ.depths[v])) << "pose " << i << " vertex " << v;
      }
    }
  }
  EXPECT_GT(contacts, poses / 20);
  EXPECT_GT(count(timeline, PoseVerdict::used), static_cast<std::uint64_t>(poses) / 2);
  EXPECT_GT(count(timeline, PoseVerdict::non_finite), 0u);
  return timeline.counters().recoveries;
}

TEST(Timeline, WithoutForcesAllElseIsTheSame) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    Scene scene = elastic_scene();
    scene.organs[0].integrator = integrator;
    Timeline with(scene), without(scene);
    without.set_forces_wanted(false);
    double largest = 0.0;
    for (const StampedPose& pose : press()) {
      with.add_pose(0, pose);
      without.add_pose(0, pose);
      while (with.step()) {
        ASSERT_TRUE(without.step());
        ASSERT_EQ(with.hash(), without.hash());
        ASSERT_EQ(with.report().contacts.size(), without.report().contacts.size());
        largest = std::max(largest, with.report().wrenches[0].force.norm());
        EXPECT_EQ(without.report().wrenches[0].force, Vector3(0, 0, 0));
        for (const OrganContact& contact : without.report().contacts) EXPECT_EQ(contact.force, Vector3(0, 0, 0));
      }
    }
    EXPECT_GT(largest, 0.01) << to_string(integrator);
  }
}

TEST(Timeline, HostilePosesNeverMakeAReportNonFinite) {
  Scene scene = quick_scene();
  scene.instruments[0].parts[0].mesh = make_box({0.02, 0.03, 0.025});
  EXPECT_EQ(feed_hostile_poses(scene, 10'000), 0u);
}

TEST(Timeline, HostilePosesNeverMakeAnElasticOrganNonFinite) {
  Scene scene = scene_of(wall_sphere(8), {ball(0.01)});
  scene.instruments[0].parts[0].mesh = make_box({0.02, 0.03, 0.025});
  EXPECT_GT(feed_hostile_poses(scene, 1'000), 0u) << "the health check was never asked";
}

TEST(Timeline, ATimeStepThatCannotBeMetIsRefusedWithOneThatCan) {
  Scene scene = elastic_scene();
  scene.organs[0].material.young = 1e12;
  try {
    Timeline timeline(scene);
    FAIL() << "it was taken";
  } catch (const SceneError& error) {
    const std::string text = error.what();
    const std::size_t key = text.find("time_step: ");
    ASSERT_NE(key, std::string::npos) << text;
    EXPECT_NE(text.find("organ sphere"), std::string::npos) << text;
    scene.time_step = std::stod(text.substr(key + 11));
    EXPECT_NO_THROW(Timeline{scene}) << text;
  }
}

}  // namespace
}  // namespace tissue_sim::timeline_test
