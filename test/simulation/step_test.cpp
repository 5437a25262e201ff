#include "tissue_sim/simulation/step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "floating_point_traps.h"
#include "simulation/test_scenes.h"
#include "tissue_sim/simulation/health.h"
#include "tissue_sim/simulation/integrator.h"

namespace tissue_sim::step_test {
namespace {

constexpr double ball_radius = 0.01;  // m

Pose ball_at(double depth) {
  return {{0.05 + ball_radius - depth, 0.003, 0.002}, Eigen::Quaterniond::Identity()};
}

Simulation pressed_sphere(double depth, int steps) {
  Simulation simulation(scene_of(wall_sphere(16), {ball(ball_radius)}));
  simulation.start_at(ball_at(-0.002));
  simulation.slide_to(ball_at(depth), steps);
  return simulation;
}

std::uint64_t hash(const Simulation& simulation) {
  return simulation.hash();
}

TEST(Step, TwoRunsGiveTheSameBits) {
  EXPECT_EQ(hash(pressed_sphere(0.008, 60)), hash(pressed_sphere(0.008, 60)));
  EXPECT_NE(hash(pressed_sphere(0.008, 60)), hash(pressed_sphere(0.0081, 60)));
}

TEST(Step, ReportsItsOwnContactsThoughNobodyCountsTheSteps) {
  Simulation counted = pressed_sphere(0.006, 40);
  Simulation uncounted = pressed_sphere(0.006, 40);
  for (int i = 0; i < 10; ++i) {
    const Pose deeper = ball_at(0.006 + 0.00015 * (i + 1));
    counted.go_to(deeper);
    --uncounted.report.step;  // go_to() raises it
    uncounted.go_to(deeper);
    ASSERT_EQ(uncounted.report.contacts.size(), counted.report.contacts.size());
  }
  EXPECT_GT(counted.report.contacts.size(), 0u);
  EXPECT_EQ(hash(uncounted), hash(counted));
}

TEST(Step, ACopiedStateGoesOnTheSameWay) {
  Simulation simulation = pressed_sphere(0.006, 40);
  const State snapshot = simulation.state;
  const Pose pose = simulation.poses[0];
  simulation.slide_to(ball_at(0.009), 30);
  simulation.slide_to(ball_at(-0.005), 30);
  const std::uint64_t straight = hash(simulation);

  simulation.state = snapshot;
  simulation.poses[0] = pose;
  forget(simulation.workspace.organs[0]);
  simulation.slide_to(ball_at(0.009), 30);
  simulation.slide_to(ball_at(-0.005), 30);
  EXPECT_EQ(hash(simulation), straight);

  Simulation fresh(scene_of(wall_sphere(16), {ball(ball_radius)}));
  fresh.state = snapshot;
  fresh.poses[0] = pose;
  forget(fresh.workspace.organs[0]);
  fresh.slide_to(ball_at(0.009), 30);
  fresh.slide_to(ball_at(-0.005), 30);
  EXPECT_EQ(hash(fresh), straight);
}

TEST(Step, ABadNumberIsCaughtInTheSameStepAndTheLastGoodStatePutBack) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    for (const bool in_velocity : {false, true}) {
      Simulation simulation = pressed_sphere(0.006, 40);
      const std::vector<Vector3> good = simulation.organ().positions;
      OrganState& organ = simulation.state.organs[0];
      const WithoutTraps off;  // a bad number is computed with
      (in_velocity ? organ.velocities : organ.positions)[100].y() = bad;
      simulation.go_to(simulation.poses[0]);
      EXPECT_TRUE(simulation.report.recovered) << bad << " " << in_velocity;
      EXPECT_EQ(organ.positions, good) << bad << " " << in_velocity;
      EXPECT_TRUE(healthy(simulation.world.organs[0], organ));
      EXPECT_TRUE(simulation.report.wrenches[0].force.allFinite());
      simulation.go_to(simulation.poses[0]);
      EXPECT_FALSE(simulation.report.recovered) << "it goes on";
    }
  }
}

TEST(Step, AVertexThatRanAwayIsCaught) {
  Simulation simulation = pressed_sphere(0.006, 40);
  simulation.state.organs[0].positions[100] += Vector3(0.0, 1e4 * simulation.rest().size, 0.0);
  simulation.go_to(simulation.poses[0]);
  EXPECT_TRUE(simulation.report.recovered);
}

TEST(Step, AnUntouchedOrganSleepsAndStaysAsItIs) {
  Simulation simulation(scene_of(wall_sphere(16), {ball(ball_radius)}));
  simulation.start_at(ball_at(-0.1));
  const std::uint64_t before = hash(simulation);
  for (int i = 0; i < 50; ++i) simulation.go_to(ball_at(-0.1 - 0.001 * i));
  EXPECT_TRUE(simulation.organ().asleep);
  EXPECT_EQ(hash(simulation), before);
  EXPECT_EQ(simulation.report.substeps, 1);
  EXPECT_EQ(simulation.report.profile.deformation, 0.0);
}

TEST(Step, AnOrganFallsAsleepOnceItHasSettled) {
  Simulation simulation = pressed_sphere(0.004, 30);
  EXPECT_FALSE(simulation.organ().asleep);
  simulation.slide_to(ball_at(-0.05), 50);
  for (int i = 0; i < 20'000 && !simulation.organ().asleep; ++i) simulation.go_to(ball_at(-0.05));
  EXPECT_TRUE(simulation.organ().asleep);
  EXPECT_LT(rms_from_rest(simulation.rest(), simulation.organ().positions), 1e-6);
}

TEST(Step, ContactOnlyHasNoForceAndStaysWhereItWasPushed) {
  Organ organ = wall_sphere(16);
  organ.model = Model::contact_only;
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  simulation.start_at(ball_at(-0.002));
  simulation.slide_to(ball_at(0.008), 50);
  ASSERT_FALSE(simulation.report.contacts.empty());
  EXPECT_TRUE(simulation.report.wrenches[0].force.isZero());
  for (const OrganContact& contact : simulation.report.contacts) EXPECT_TRUE(contact.force.isZero());
  const std::vector<Vector3> pushed = simulation.organ().positions;
  simulation.slide_to(ball_at(-0.002), 50);
  EXPECT_EQ(simulation.organ().positions, pushed);
}

TEST(Step, AttachedVerticesNeverMove) {
  Organ organ = wall_sphere(16);
  Scene scene = scene_of(organ, {ball(0.02)});
  scene.gravity = {0.0, 0.0, -9.81};
  Simulation simulation(scene);
  simulation.start_at({{-0.08, 0.0, 0.0}, Eigen::Quaterniond::Identity()});
  simulation.slide_to({{-0.05, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, 40);
  ASSERT_FALSE(simulation.report.contacts.empty());
  ASSERT_FALSE(organ.attached.empty());
  for (const int v : organ.attached) EXPECT_EQ(simulation.organ().positions[v], simulation.rest().positions[v]);
}

TEST(Step, AnUnattachedOrganFallsFreely) {
  Organ organ = wall_sphere(16);
  organ.attached.clear();
  organ.material.drag = 0.0;
  Scene scene = scene_of(organ, {ball(ball_radius)});
  scene.gravity = {0.0, 0.0, -9.81};
  Simulation simulation(scene);
  simulation.start_at(ball_at(-0.5));
  const int steps = 200;
  for (int i = 0; i < steps; ++i) simulation.go_to(ball_at(-0.5));
  const double t = 1e-3 * steps;
  for (std::size_t v = 0; v < simulation.rest().positions.size(); ++v) {
    const Vector3 fallen = simulation.organ().positions[v] - simulation.rest().positions[v];
    // The explicit substeps add g t dt / 2 to g t^2 / 2.
    EXPECT_NEAR(fallen.z(), -0.5 * 9.81 * t * t, 0.5 * 9.81 * t * 1e-3 + 1e-9);
    EXPECT_NEAR(fallen.head<2>().norm(), 0.0, 1e-9);
  }
}

TEST(Step, TheForceOfAHeldProbeIsThatOfTheElementsItHolds) {
  Simulation simulation = pressed_sphere(0.008, 80);
  for (int i = 0; i < 3000; ++i) simulation.go_to(simulation.poses[0]);
  const StepReport& report = simulation.report;
  ASSERT_FALSE(report.contacts.empty());

  std::vector<Vector3> forces(simulation.organ().positions.size());
  ElementRoom room;
  prepare(room, simulation.rest());
  element_forces(simulation.rest(), simulation.organ(), forces, room);
  std::set<int> touched;
  Vector3 on_organ = Vector3::Zero();
  for (const OrganContact& contact : report.contacts) {
    on_organ += contact.force;
    for (int i = 0; i < 3; ++i) {
      if (contact.barycentric[i] > 0.0) touched.insert(simulation.rest().triangles[contact.triangle][i]);
    }
  }
  Vector3 elastic = Vector3::Zero();
  for (const int v : touched) elastic += forces[v];
  const Vector3& on_instrument = report.wrenches[0].force;
  EXPECT_GT(on_instrument.x(), 0.01);
  EXPECT_LT((on_instrument - elastic).norm(), 0.01 * elastic.norm())
      << on_instrument.transpose() << " N against " << elastic.transpose() << " N";
  EXPECT_NEAR((on_instrument + on_organ).norm(), 0.0, 1e-12 * on_instrument.norm()) << "action and reaction";
}

TEST(Step, TheAttachmentBearsWhatTheProbePresses) {
  Simulation simulation = pressed_sphere(0.008, 80);
  for (int i = 0; i < 3000; ++i) simulation.go_to(simulation.poses[0]);
  std::vector<Vector3> forces(simulation.organ().positions.size());
  ElementRoom room;
  prepare(room, simulation.rest());
  element_forces(simulation.rest(), simulation.organ(), forces, room);
  Vector3 borne = Vector3::Zero();
  for (std::size_t v = 0; v < forces.size(); ++v) {
    if (simulation.rest().attached[v]) borne += forces[v];
  }
  const Vector3& pressed = simulation.report.wrenches[0].force;
  EXPECT_LT((borne + pressed).norm(), 0.01 * pressed.norm());
}

TEST(Step, AnInstrumentWithoutAPoseIsNotThere) {
  // A second ball lies across the organ's wall where poses begin; it has none yet.
  for (const CollidingSet set : {CollidingSet::flood, CollidingSet::paper}) {
    Organ organ = wall_sphere(16);
    organ.colliding_set = set;
    Instrument across = ball(0.03, "across");
    for (Vector3& v : across.parts[0].mesh.vertices) v.x() += 0.05;
    Simulation simulation(scene_of(organ, {ball(ball_radius), across}));
    simulation.start_at(ball_at(-0.05));
    for (int i = 0; i < 3; ++i) simulation.go_to(ball_at(-0.05));
    EXPECT_TRUE(simulation.report.contacts.empty());
    EXPECT_TRUE(simulation.organ().asleep);
    EXPECT_EQ(simulation.organ().positions, simulation.rest().positions);
    for (const std::vector<char>& memory : simulation.organ().colliding) {
      EXPECT_EQ(std::count(memory.begin(), memory.end(), 1), 0);
    }

    Motion placed = {0.001, {{true, ball_at(-0.05), ball_at(-0.05)}, {true, Pose(), Pose()}}};
    step(simulation.world, placed, simulation.state, simulation.workspace, simulation.report);
    EXPECT_FALSE(simulation.report.contacts.empty()) << "given a pose, it is";
  }
}

/// Of an organ that is inside out all the world is below the surface. A recovery forgets how far it reaches, and what
/// stood 5 m away once poked into it then.
TEST(Step, WhatIsFarFromAnOrganInsideOutDoesNotPoke) {
  Simulation simulation(scene_of(wall_sphere(8), {ball(0.01)}));
  const Pose away = {{0.0, 0.0, 5.0}, Eigen::Quaterniond::Identity()};
  simulation.start_at(away);
  for (Vector3& v : simulation.state.organs[0].positions) v.z() = -v.z();
  simulation.state.organs[0].asleep = false;
  forget(simulation.workspace.organs[0]);
  simulation.go_to(away);
  EXPECT_FALSE(simulation.report.recovered);
  EXPECT_TRUE(simulation.report.contacts.empty());
}

TEST(Step, ARecoveryOfOneOrganLeavesTheOthersWrench) {
  // Two balls of one instrument press an organ each.
  Scene scene = scene_of(wall_sphere(16), {ball(ball_radius)});
  scene.organs.push_back(wall_sphere(16));
  for (Vector3& v : scene.organs[1].mesh.vertices) v.y() += 0.15;
  InstrumentPart second = scene.instruments[0].parts[0];
  for (Vector3& v : second.mesh.vertices) v.y() += 0.15;
  scene.instruments[0].parts.push_back(second);
  Simulation simulation(scene);
  simulation.start_at(ball_at(-0.002));
  simulation.slide_to(ball_at(0.006), 60);
  for (int i = 0; i < 300; ++i) simulation.go_to(simulation.poses[0]);
  const double both = simulation.report.wrenches[0].force.x();

  const WithoutTraps off;  // a NaN is computed with
  simulation.state.organs[1].positions[100].y() = std::numeric_limits<double>::quiet_NaN();
  simulation.go_to(simulation.poses[0]);
  EXPECT_TRUE(simulation.report.recovered);
  Vector3 of_first = Vector3::Zero();
  for (const OrganContact& contact : simulation.report.contacts) {
    EXPECT_EQ(contact.organ, 0);
    of_first -= contact.force;
  }
  const Vector3& force = simulation.report.wrenches[0].force;
  EXPECT_LT((force - of_first).norm(), 1e-15);
  EXPECT_TRUE(simulation.report.wrenches[0].torque.allFinite());
  EXPECT_NEAR(force.x(), 0.5 * both, 0.1 * both);
  EXPECT_GT(force.x(), 0.0);
}

}  // namespace
}  // namespace tissue_sim::step_test
