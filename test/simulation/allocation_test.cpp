#include <gtest/gtest.h>

#include "benchmark/counted_heap.h"
#include "simulation/solid_scenes.h"

namespace tissue_sim::allocation_test {
namespace {

/// 100 ms in, 100 ms out, the same way each time.
void press_once(Simulation& simulation) {
  const Pose in = {{0.042, 0.003, 0.002}, Eigen::Quaterniond::Identity()};
  const Pose out = {{0.062, 0.003, 0.002}, Eigen::Quaterniond::Identity()};
  simulation.slide_to(in, 100);
  simulation.slide_to(out, 100);
}

std::size_t allocations_once_warm(const Organ& organ, bool in_parts) {
  Simulation simulation(scene_of(organ, {ball(0.01)}));
  EXPECT_EQ(!simulation.world.organs[0].regions.empty(), in_parts);
  simulation.start_at({{0.062, 0.003, 0.002}, Eigen::Quaterniond::Identity()});
  for (int i = 0; i < 2; ++i) press_once(simulation);
  const Motion away = {0.001, {{true, simulation.poses[0], simulation.poses[0]}}};
  for (int i = 0; i < 100; ++i) step(simulation.world, away, simulation.state, simulation.workspace, simulation.report);

  Motion motion = away;
  int contacts = 0;
  const std::size_t before = counted_allocations();
  for (int i = 1; i <= 200; ++i) {
    motion.instruments[0].from = motion.instruments[0].to;
    motion.instruments[0].to.position.x() = 0.062 - 0.020 * std::min(i, 200 - i) / 100.0;
    ++simulation.report.step;
    step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
    contacts += static_cast<int>(simulation.report.contacts.size());
  }
  const std::size_t after = counted_allocations();
  EXPECT_GT(contacts, 50);
  return after - before;
}

std::size_t allocations_once_warm(DepthScheme depth, CollidingSet set) {
  Organ organ = wall_sphere(16);
  organ.depth = depth;
  organ.colliding_set = set;
  return allocations_once_warm(organ, false);
}

/// A ball on top of a solid, down and up again, of which the first two times warm it.
std::size_t allocations_of_a_solid(Organ organ, double top, double radius, int threads = 1) {
  organ.material.drag = 60.0;
  Simulation simulation(scene_of(organ, {round_ball(radius, 16)}));
  if (threads > 1) simulation.workspace = build_workspace(simulation.world, threads);
  Pose above = ball_over_block(radius, -0.001);
  above.position.z() += top;
  simulation.start_at(above);
  Motion motion = {0.001, {{true, above, above}}};
  int contacts = 0;
  const auto down_and_up = [&]() {
    for (int i = 1; i <= 100; ++i) {
      motion.instruments[0].from = motion.instruments[0].to;
      motion.instruments[0].to.position.z() = above.position.z() - 0.003 * std::min(i, 100 - i) / 50.0;
      ++simulation.report.step;
      step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
      contacts += static_cast<int>(simulation.report.contacts.size());
    }
    for (int i = 0; i < 100; ++i) {
      motion.instruments[0].from = motion.instruments[0].to;
      step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
    }
  };
  down_and_up();
  down_and_up();
  contacts = 0;
  const std::size_t before = counted_allocations();
  down_and_up();
  const std::size_t after = counted_allocations();
  EXPECT_GT(contacts, 50);
  return after - before;
}

TEST(Allocation, NoneInAWarmStepOfASolid) {
  for (const Model model : {Model::fem, Model::volume}) {
    for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
      EXPECT_EQ(allocations_of_a_solid(soft_block(model, 3, integrator), 0.0, 0.006), 0u);
      EXPECT_EQ(allocations_of_a_solid(soft_block(model, 3, integrator), 0.0, 0.001), 0u) << "thinner than a triangle";
    }
  }
}

TEST(Allocation, NoneInAWarmStepOfSeveralThreads) {
  Organ organ = soft_block(Model::fem, 10);
  organ.material.young = 500.0;
  EXPECT_EQ(allocations_of_a_solid(organ, 0.0, 0.006, 3), 0u);
}

TEST(Allocation, NoneInAWarmStepOfAnEmbeddedSurface) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    Organ organ = embedded_sphere(0.015, 32, 3, Model::fem);
    organ.integrator = integrator;
    EXPECT_EQ(allocations_of_a_solid(organ, organ.mesh.vertices.front().z(), 0.006), 0u);
  }
}

TEST(Allocation, NoneInAWarmStepWithLevels) {
  const Vector3 size(0.08, 0.08, 0.03);
  Organ organ = solid_organ(make_block(size, {24, 24, 9}), size, Model::fem);
  organ.levels_tolerance = 0.05;
  EXPECT_EQ(allocations_of_a_solid(organ, 0.0, 0.006), 0u);
  EXPECT_EQ(allocations_of_a_solid(organ, 0.0, 0.001), 0u) << "thinner than a triangle";
}

TEST(Allocation, NoneInAWarmStep) {
  EXPECT_EQ(allocations_once_warm(DepthScheme::exact, CollidingSet::flood), 0u);
}

/// Lists that grow with the largest contact so far would grow once in hours.
TEST(Allocation, NoneInTheFirstTouch) {
  Simulation simulation(scene_of(wall_sphere(16), {ball(0.01)}));
  const Pose away = {{0.062, 0.003, 0.002}, Eigen::Quaterniond::Identity()};
  simulation.start_at(away);
  Motion motion = {0.001, {{true, away, away}}};
  std::size_t contacts = 0;
  const auto press = [&](double speed) {  // mm a step
    for (int i = 0; i < 100; ++i) {
      motion.instruments[0].from = motion.instruments[0].to;
      motion.instruments[0].to.position.x() -= 0.001 * speed;
      ++simulation.report.step;
      step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
      contacts = std::max(contacts, simulation.report.contacts.size());
    }
  };
  press(0.0);
  ASSERT_EQ(contacts, 0u);
  const std::size_t before = counted_allocations();
  press(0.25);
  const std::size_t after = counted_allocations();
  EXPECT_EQ(after - before, 0u);
  EXPECT_GE(contacts, 3u);
}

TEST(Allocation, NoneInAWarmStepOfAPartOfAWall) {
  Organ organ = wall_sphere(32);
  organ.wall_thickness = 0.001;
  organ.levels_tolerance = 0.05;
  organ.attached.clear();  // held all over, so that a part has an answer of its own
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); v += 7) organ.attached.push_back(v);
  EXPECT_EQ(allocations_once_warm(organ, true), 0u);
}

TEST(Allocation, NoneInAWarmStepOfThePapersScheme) {
  EXPECT_EQ(allocations_once_warm(DepthScheme::paper, CollidingSet::paper), 0u);
}

}  // namespace
}  // namespace tissue_sim::allocation_test
