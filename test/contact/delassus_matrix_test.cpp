#include "tissue_sim/contact/delassus_matrix.h"

#include <gtest/gtest.h>

#include "geometry/twins.h"

namespace tissue_sim::delassus_matrix_test {
namespace {

ContactPoint point_at(const std::array<int, 3>& vertices, const Vector3& weights, const Vector3& direction) {
  ContactPoint point;
  for (int i = 0; i < 3; ++i) point.bearers.add(vertices[i], weights[i]);
  point.direction = direction;
  return point;
}

/// m/s, along its direction, that a point gets when all have their impulses: from the vertices, one by one.
double gained(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
              const std::vector<double>& impulses, std::size_t which) {
  std::vector<Vector3> velocities(inverse_mass.size(), Vector3::Zero());
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (int i = 0; i < points[p].bearers.count; ++i) {
      const int v = points[p].bearers.vertices[i];
      velocities[v] += points[p].bearers.weights[i] * inverse_mass[v] * impulses[p] * points[p].direction;
    }
  }
  return points[which].direction.dot(at_point(points[which], velocities));
}

TEST(DelassusMatrix, GivesEveryPointWhatItLacksAndPullsNone) {
  Random random(11);
  int pressed = 0;
  int free = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<double> inverse_mass;
    for (int v = 0; v < 8; ++v) inverse_mass.push_back(random_in(random, 0.2, 3.0));
    std::vector<ContactPoint> points;
    std::vector<double> lacking;
    for (const std::array<int, 3>& vertices :
         {std::array<int, 3>{0, 1, 2}, {2, 3, 4}, {0, 2, 4}, {5, 6, 7}, {3, 4, 5}}) {
      points.push_back(point_at(vertices, Vector3(0.3, 0.4, 0.3), random_direction(random)));
      lacking.push_back(random_in(random, -1.0, 1.0));
    }
    DelassusMatrix delassus;
    delassus.build(points, inverse_mass);
    ASSERT_EQ(delassus.size(), points.size());
    std::vector<double> impulses(points.size(), 0.0);
    for (int again = 0; again < 40; ++again) delassus.solve(lacking, impulses);  // each starts from the one before
    for (std::size_t p = 0; p < points.size(); ++p) {
      const double more = gained(points, inverse_mass, impulses, p) - lacking[p];
      EXPECT_GE(impulses[p], 0.0);
      EXPECT_GE(more, -1e-4);
      if (impulses[p] > 0.0) {
        EXPECT_NEAR(more, 0.0, 1e-4) << "pushed farther than it lacked";
      }
      (impulses[p] > 0.0 ? pressed : free) += 1;
    }
  }
  EXPECT_GT(pressed, 100);
  EXPECT_GT(free, 100);
}

TEST(DelassusMatrix, PointsThatShareNoVertexAreSolvedAtOnce) {
  const std::vector<ContactPoint> points = {point_at({0, 1, 2}, Vector3::UnitX(), Vector3::UnitZ()),
                                            point_at({0, 1, 2}, Vector3::UnitY(), Vector3::UnitX())};
  DelassusMatrix delassus;
  delassus.build(points, {0.25, 0.5, 1.0});
  std::vector<double> impulses = {0.0, 0.0};
  delassus.solve({3.0, -2.0}, impulses);
  EXPECT_EQ(impulses[0], 12.0) << "4 kg";
  EXPECT_EQ(impulses[1], 0.0);
}

TEST(DelassusMatrix, WhatCannotMoveGetsNothing) {
  const std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ()),
                                            point_at({0, 1, 3}, {0.3, 0.4, 0.3}, Vector3::UnitZ())};
  const std::vector<double> attached_but_one = {0.0, 0.0, 0.0, 1.0};
  DelassusMatrix delassus;
  delassus.build(points, attached_but_one);
  std::vector<double> impulses = {7.0, 0.0};
  for (int again = 0; again < 10; ++again) delassus.solve({1.0, 1.0}, impulses);
  EXPECT_EQ(impulses[0], 0.0);
  EXPECT_NEAR(gained(points, attached_but_one, impulses, 1), 1.0, 1e-4);
}

/// Built anew, it knows nothing of the points before.
TEST(DelassusMatrix, HoldsForItsPointsOnly) {
  const std::vector<double> inverse_mass(6, 1.0);
  const ContactPoint first = point_at({0, 1, 2}, {0.3, 0.3, 0.4}, Vector3::UnitZ());
  const ContactPoint second = point_at({2, 3, 4}, {0.3, 0.3, 0.4}, Vector3::UnitZ());
  DelassusMatrix used;
  used.build({first, second, first}, inverse_mass);
  used.build({second, first}, inverse_mass);
  DelassusMatrix fresh;
  fresh.build({second, first}, inverse_mass);
  std::vector<double> of_used = {0.1, 0.2};
  std::vector<double> of_fresh = of_used;
  used.solve({1.0, 2.0}, of_used);
  fresh.solve({1.0, 2.0}, of_fresh);
  EXPECT_EQ(of_used, of_fresh);
}

}  // namespace
}  // namespace tissue_sim::delassus_matrix_test
