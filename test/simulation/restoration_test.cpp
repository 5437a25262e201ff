#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulation/test_scenes.h"

namespace tissue_sim::restoration_test {
namespace {

constexpr double ball_radius = 0.005;  // m
constexpr double dent = 0.010;         // m
constexpr int press_steps = 200;       // ms
constexpr int withdraw_steps = 100;    // ms

struct Dent {
  Vector3 place;   ///< on the organ's surface
  Vector3 normal;  ///< unit, out of the organ

  /// The ball's lowest point `depth` below the place.
  Pose ball_at(double depth) const { return {place + (ball_radius - depth) * normal, Eigen::Quaterniond::Identity()}; }
};

Dent dent_at(const RestShape& rest, int vertex) {
  Vector3 normal = Vector3::Zero();
  const FlatLists& triangles = rest.topology.vertex_triangles;
  for (const int* t = triangles.begin(vertex); t != triangles.end(vertex); ++t) {
    const auto& [a, b, c] = rest.triangles[*t];
    normal += area_normal(rest.positions[a], rest.positions[b], rest.positions[c]);
  }
  return {rest.positions[vertex], normal.normalized()};
}

int farthest_along(const RestShape& rest, const Vector3& direction) {
  int best = 0;
  for (int v = 0; v < static_cast<int>(rest.positions.size()); ++v) {
    if (rest.positions[v].dot(direction) > rest.positions[best].dot(direction)) best = v;
  }
  return best;
}

/// Presses, withdraws until nothing touches any more, and stays away.
void press_and_leave(Simulation& simulation, const Dent& place) {
  simulation.start_at(place.ball_at(-0.001));
  simulation.slide_to(place.ball_at(dent), press_steps);
  ASSERT_FALSE(simulation.report.contacts.empty());
  EXPECT_GT(rms_from_rest(simulation.rest(), simulation.organ().positions), 0.05e-3);
  simulation.slide_to(place.ball_at(-0.020), withdraw_steps);
  EXPECT_TRUE(simulation.report.contacts.empty());
}

/// Nothing is left to wait for: a tenth of the bound away, and slower than what would lead back to it in two seconds.
bool settled(Simulation& simulation) {
  double fastest = 0.0;
  for (const Vector3& v : simulation.organ().velocities) fastest = std::max(fastest, v.norm());
  return fastest < 1e-6 && rms_from_rest(simulation.rest(), simulation.organ().positions) < 1e-6;
}

/// m, root mean square from rest after so many milliseconds without a touch.
double rest_for(Simulation& simulation, int steps) {
  for (int i = 0; i < steps && !settled(simulation); ++i) simulation.go_to(simulation.poses[0]);
  return rms_from_rest(simulation.rest(), simulation.organ().positions);
}

void expect_dent_comes_out(const Organ& organ, const Vector3& towards) {
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  press_and_leave(simulation, dent_at(simulation.rest(), farthest_along(simulation.rest(), towards)));
  const double rms = rest_for(simulation, 2000);
  EXPECT_LT(rms, 0.01e-3);
  testing::Test::RecordProperty("rms_nm", static_cast<int>(1e9 * rms));
}

void expect_dent_stays(Organ organ, const Vector3& towards) {
  organ.restoration = false;
  Simulation simulation(scene_of(organ, {ball(ball_radius)}));
  const int vertex = farthest_along(simulation.rest(), towards);
  const Dent place = dent_at(simulation.rest(), vertex);
  press_and_leave(simulation, place);
  const Vector3 left_at = simulation.organ().positions[vertex];
  EXPECT_GT((place.place - left_at).dot(place.normal), 0.008);
  rest_for(simulation, 1000);
  EXPECT_LT((simulation.organ().positions[vertex] - left_at).norm(), 0.001);
}

const Vector3 oblique(1.0, 0.3, 0.2);

TEST(Restoration, LiverDentComesOut) {
  expect_dent_comes_out(demo_liver(), Vector3::UnitZ());
}
TEST(Restoration, SphereOf480TrianglesDentComesOut) {
  expect_dent_comes_out(wall_sphere(16), oblique);
}
TEST(Restoration, SphereOf1984TrianglesDentComesOut) {
  expect_dent_comes_out(wall_sphere(32), oblique);
}
TEST(Restoration, SphereOf8064TrianglesDentComesOut) {
  expect_dent_comes_out(wall_sphere(64), oblique);
}
TEST(Restoration, OffTheLiverKeepsItsDent) {
  expect_dent_stays(demo_liver(), Vector3::UnitZ());
}
TEST(Restoration, OffTheSphereKeepsItsDent) {
  expect_dent_stays(wall_sphere(32), oblique);
}

}  // namespace
}  // namespace tissue_sim::restoration_test
