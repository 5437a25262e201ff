#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/twins.h"
#include "simulation/test_scenes.h"

namespace tissue_sim::coarse_shell_test {
namespace {

constexpr double ball_radius = 0.008;  // m
constexpr double dent = 0.003;         // m
constexpr int press_steps = 80;        // ms
constexpr int still_steps = 250;       // ms, until it is nearly at rest

/// What a press leaves behind.
struct Pressed {
  double force = 0.0;  ///< N
  std::vector<Vector3> displacements;
  double inside = 0.0;  ///< m, of the vertex that is deepest in the ball
};

Pose above(const Organ& organ, int vertex, double height) {
  Vector3 normal = Vector3::Zero();
  for (const Triangle& t : organ.mesh.triangles) {
    if (!std::count(t.begin(), t.end(), vertex)) continue;
    normal += area_normal(organ.mesh.vertices[t[0]], organ.mesh.vertices[t[1]], organ.mesh.vertices[t[2]]);
  }
  return {organ.mesh.vertices[vertex] + (ball_radius + height) * normal.normalized(), Eigen::Quaterniond::Identity()};
}

void press_in(const Organ& organ, int vertex, Simulation& simulation) {
  simulation.start_at(above(organ, vertex, 0.001));
  for (int i = 0; i <= press_steps; ++i) simulation.go_to(above(organ, vertex, -dent * i / press_steps));
}

Pressed press(const Organ& organ, int vertex) {
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  press_in(organ, vertex, simulation);
  const Pose end = above(organ, vertex, -dent);
  for (int i = 0; i < still_steps; ++i) simulation.go_to(end);
  Pressed pressed;
  pressed.force = simulation.report.wrenches[0].force.norm();
  // The flat faces of the ball lie a little inside the sphere that they stand for.
  const TriangleMesh shape = ball(ball_radius).parts[0].mesh;
  double flat = ball_radius;
  for (const auto& [a, b, c] : shape.triangles) {
    const Vector3 normal = area_normal(shape.vertices[a], shape.vertices[b], shape.vertices[c]).normalized();
    flat = std::min(flat, normal.dot(shape.vertices[a]));
  }
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    const Vector3& p = simulation.organ().positions[v];
    pressed.displacements.push_back(p - organ.mesh.vertices[v]);
    pressed.inside = std::max(pressed.inside, flat - (p - end.position).norm());
  }
  return pressed;
}

/// Root of the mean square, over the vertices within `reach` of one.
double difference(const Organ& organ, int vertex, double reach, const Pressed& one, const Pressed& other) {
  double off = 0.0;
  double all = 0.0;
  for (std::size_t v = 0; v < one.displacements.size(); ++v) {
    if ((organ.mesh.vertices[v] - organ.mesh.vertices[vertex]).norm() > reach) continue;
    off += (one.displacements[v] - other.displacements[v]).squaredNorm();
    all += other.displacements[v].squaredNorm();
  }
  return std::sqrt(off / all);
}

/// As the wall of a hollow organ, of 8 * 4^rounds triangles; 30 1/s of drag bring what is pressed to rest soon.
Organ sphere(int rounds, double drag = 30.0) {
  Organ organ = wall_sphere(8);
  organ.mesh = make_octasphere(0.05, rounds);
  organ.material.drag = drag;
  organ.attached.clear();
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
    if (organ.mesh.vertices[v].x() < -0.04) organ.attached.push_back(v);
  }
  return organ;
}

void expect_within(const Organ& organ, const std::vector<int>& places, double tolerance) {
  Organ coarse = organ;
  coarse.levels_tolerance = tolerance;
  double force = 0.0;
  double near = 0.0;
  double whole = 0.0;
  for (const int place : places) {
    const Pressed own = press(organ, place);
    const Pressed levels = press(coarse, place);
    const double part = 1.0 / static_cast<double>(places.size());
    EXPECT_LT(std::abs(levels.force / own.force - 1.0), 2.5 * tolerance) << place;
    EXPECT_LT(levels.inside, contact_margin) << place;
    force += part * (levels.force / own.force - 1.0);
    near += part * difference(organ, place, 0.02, levels, own);
    whole += part * difference(organ, place, 1.0, levels, own);
  }
  EXPECT_LT(std::abs(force), tolerance);
  EXPECT_LT(near, 1.3 * tolerance);
  EXPECT_LT(whole, 2.6 * tolerance);
}

TEST(CoarseShellPressed, IsWithinTheToleranceOnTheLiver) {
  const Organ liver = demo_liver();
  expect_within(liver, {1420, 3406}, 0.05);
}

TEST(CoarseShellPressed, IsWithinTheToleranceOnTheSphere) {
  expect_within(sphere(5), {137}, 0.1);
}

TEST(CoarseShellPressed, GoesToSleepAndLeavesNoTrace) {
  Organ organ = sphere(4, 5.0);
  organ.levels_tolerance = 0.1;
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  press_in(organ, 137, simulation);
  EXPECT_FALSE(simulation.organ().asleep);
  for (int i = 0; i < 6000 && !simulation.organ().asleep; ++i) simulation.go_to(above(organ, 137, 0.05));
  EXPECT_TRUE(simulation.organ().asleep);
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    EXPECT_LT((simulation.organ().positions[v] - organ.mesh.vertices[v]).norm(), 1e-5);
  }
}

TEST(CoarseShellPressed, KeepsADentWithoutRestoration) {
  Organ organ = sphere(4);
  organ.levels_tolerance = 0.1;
  organ.restoration = false;
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  press_in(organ, 137, simulation);
  for (int i = 0; i < 500; ++i) simulation.go_to(above(organ, 137, 0.05));
  const Vector3 moved = simulation.organ().positions[137] - organ.mesh.vertices[137];
  // What shares its triangle pushed too: farther than the ball went, by a little.
  EXPECT_NEAR(moved.norm(), dent, 0.25 * dent);
}

TEST(CoarseShellPressed, AgreesBetweenTheIntegrators) {
  Organ organ = sphere(4);
  organ.levels_tolerance = 0.1;
  organ.integrator = Integrator::explicit_substeps;
  const Pressed one = press(organ, 137);
  organ.integrator = Integrator::vertex_block_descent;
  const Pressed other = press(organ, 137);
  EXPECT_NEAR(other.force / one.force, 1.0, 0.1);
  EXPECT_LT(difference(organ, 137, 0.02, other, one), 0.05);
}

}  // namespace
}  // namespace tissue_sim::coarse_shell_test
