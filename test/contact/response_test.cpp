#include "tissue_sim/contact/response.h"

#include <gtest/gtest.h>

#include "geometry/twins.h"

namespace tissue_sim::response_test {
namespace {

ContactPoint point_at(const std::array<int, 3>& vertices, const Vector3& weights, const Vector3& direction,
                      double target) {
  ContactPoint point;
  point.weights = weights;
  for (int i = 0; i < 3; ++i) point.bearers.add(vertices[i], weights[i]);
  point.direction = direction;
  point.target = target;
  return point;
}

const std::vector<Vector3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

double behind(const ContactPoint& point, const std::vector<Vector3>& x) {
  return point.target - point.direction.dot(at_point(point, x));
}

Vector3 momentum(const std::vector<Vector3>& velocities, const std::vector<double>& inverse_mass) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    if (inverse_mass[i] > 0.0) sum += velocities[i] / inverse_mass[i];
  }
  return sum;
}

TEST(PushOut, OneVertexGoesToItsPlane) {
  std::vector<Vector3> x = corners;
  std::vector<char> held(3, 0);
  const ContactPoint point = point_at({0, 1, 2}, Vector3::UnitY(), Vector3::UnitZ(), 0.25);
  EXPECT_DOUBLE_EQ(push_out({point}, {1.0, 5.0, 1.0}, x, &held), 0.25);
  EXPECT_EQ(x[0], corners[0]);
  EXPECT_EQ(x[1], Vector3(1, 0, 0.25));
  EXPECT_EQ(x[2], corners[2]);
  EXPECT_EQ(held, (std::vector<char>{0, 1, 0}));
}

TEST(PushOut, WhatIsInFrontStays) {
  std::vector<Vector3> x = corners;
  std::vector<char> held(3, 0);
  EXPECT_EQ(push_out({point_at({0, 1, 2}, Vector3::UnitY(), Vector3::UnitZ(), -0.25)}, {1, 1, 1}, x, &held), 0.0);
  EXPECT_EQ(x, corners);
  EXPECT_EQ(held, std::vector<char>(3, 0));
}

TEST(PushOut, VerticesShareTheWayByWeightAndMobility) {
  std::vector<Vector3> x = corners;
  const Vector3 weights(0.5, 0.25, 0.25);
  const ContactPoint point = point_at({0, 1, 2}, weights, Vector3::UnitZ(), 0.3);
  push_out({point}, {1.0, 2.0, 1.0}, x, nullptr);
  EXPECT_NEAR(behind(point, x), 0.0, 1e-15);
  const double sum = 0.25 + 2.0 * 0.0625 + 0.0625;
  EXPECT_NEAR(x[0].z(), 0.3 * 0.5 / sum, 1e-15);
  EXPECT_NEAR(x[1].z(), 0.3 * 0.5 / sum, 1e-15);
  EXPECT_NEAR(x[2].z(), 0.3 * 0.25 / sum, 1e-15);
}

TEST(PushOut, AttachedVerticesNeverMove) {
  Random random(1);
  const std::vector<double> inverse_mass = {0.0, 1.0, 0.0, 2.0, 0.0, 1.0};
  for (int round = 0; round < 300; ++round) {
    std::vector<Vector3> x;
    for (int i = 0; i < 6; ++i) x.push_back(random_point(random));
    const std::vector<Vector3> before = x;
    std::vector<char> held(6, 0);
    std::vector<ContactPoint> points;
    for (const std::array<int, 3>& vertices : {std::array<int, 3>{0, 1, 2}, {2, 3, 4}, {0, 2, 4}, {3, 4, 5}}) {
      Vector3 weights = random_point(random).cwiseAbs();
      weights /= weights.sum();
      points.push_back(point_at(vertices, weights, random_direction(random), random_in(random, -1.0, 2.0)));
    }
    push_out(points, inverse_mass, x, &held);
    for (const int attached : {0, 2, 4}) {
      EXPECT_EQ(x[attached], before[attached]);
      EXPECT_EQ(held[attached], 0);
    }
    for (const Vector3& p : x) EXPECT_TRUE(p.allFinite());
  }
}

TEST(PushOut, NoVertexIsThrown) {
  // A corner with a small weight beside attached ones would have to go 1 / weight times as far as the point.
  for (const double weight : {0.5, 0.1, 1e-3, 1e-9}) {
    std::vector<Vector3> x = corners;
    push_out({point_at({0, 1, 2}, {weight, 0.5 * (1.0 - weight), 0.5 * (1.0 - weight)}, Vector3::UnitZ(), 0.1)},
             {1.0, 0.0, 0.0}, x, nullptr);
    EXPECT_LE(x[0].z(), 2.0 * 0.1 * (1.0 + 1e-12)) << "weight " << weight;
  }
}

TEST(PushOut, PointsThatShareVerticesAllComeOut) {
  // Eight points over a fan of triangles around vertex 0, all to be lifted to one height.
  std::vector<Vector3> x = {Vector3::Zero()};
  std::vector<ContactPoint> points;
  for (int i = 0; i < 8; ++i) x.emplace_back(std::cos(0.785 * i), std::sin(0.785 * i), 0.0);
  for (int i = 0; i < 8; ++i)
    points.push_back(point_at({0, 1 + i, 1 + (i + 1) % 8}, Vector3::Constant(1.0 / 3.0), Vector3::UnitZ(), 1e-3));
  push_out(points, std::vector<double>(x.size(), 1.0), x, nullptr);
  for (const ContactPoint& point : points) EXPECT_LT(behind(point, x), contact_margin);
}

TEST(PushOut, TellsHowFarAVertexWentAtMost) {
  Random random(2);
  for (int round = 0; round < 200; ++round) {
    std::vector<Vector3> x;
    for (int i = 0; i < 9; ++i) x.push_back(random_point(random));
    const std::vector<Vector3> before = x;
    std::vector<ContactPoint> points;
    for (int i = 0; i < 3; ++i) {
      points.push_back(point_at({3 * i, 3 * i + 1, 3 * i + 2}, {0.2, 0.3, 0.5}, random_direction(random), 0.5));
    }
    const double farthest = push_out(points, std::vector<double>(9, 1.0), x, nullptr);
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LE((x[i] - before[i]).norm(), farthest * (1.0 + 1e-12));
  }
}

void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        const std::vector<Vector3>& positions, double dt, std::vector<Vector3>& velocities) {
  ResponseRoom room;
  room.delassus.build(points, inverse_mass);
  tissue_sim::stop_at_instrument(points, inverse_mass, positions, dt, velocities, room);
}

/// With every point where its target is: nothing to close, the instrument's own velocity counts.
void stop(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
          std::vector<Vector3>& velocities) {
  const std::vector<Vector3> at_origin(velocities.size(), Vector3::Zero());
  for (ContactPoint& point : points) point.target = 0.0;
  stop_at_instrument(points, inverse_mass, at_origin, 1.0, velocities);
}

TEST(StopAtInstrument, AnInelasticStopTakesMassTimesVelocity) {
  std::vector<Vector3> v = {{0.5, 0, -3}, {0, 0, 0}, {0, 0, 0}};
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, Vector3::UnitX(), Vector3::UnitZ(), 0.0)};
  stop(points, {0.25, 1.0, 1.0}, v);  // 4 kg
  EXPECT_DOUBLE_EQ(points[0].impulse, 12.0);
  EXPECT_LT((v[0] - Vector3(0.5, 0, 0)).norm(), 1e-15) << "without friction the rest goes on";
}

TEST(StopAtInstrument, TakesTheInstrumentsVelocityAlongTheDirectionOnly) {
  std::vector<Vector3> v(3, Vector3::Zero());
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0)};
  points[0].instrument_velocity = {7, 8, 2};
  stop(points, {1.0, 1.0, 1.0}, v);
  EXPECT_NEAR(0.2 * v[0].z() + 0.3 * v[1].z() + 0.5 * v[2].z(), 2.0, 1e-14);
  for (const Vector3& velocity : v) EXPECT_EQ(velocity.head<2>(), Eigen::Vector2d(0, 0));
}

TEST(StopAtInstrument, NeverPulls) {
  std::vector<Vector3> v = {{0, 0, 3}, {0, 0, 3}, {0, 0, 3}};
  const std::vector<Vector3> before = v;
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0)};
  points[0].impulse = 99.0;  // of the substep before
  stop(points, {1.0, 1.0, 1.0}, v);
  EXPECT_EQ(points[0].impulse, 0.0);
  for (std::size_t i = 0; i < v.size(); ++i) EXPECT_LT((v[i] - before[i]).norm(), 1e-13);
}

TEST(StopAtInstrument, ImpulsesAreTheChangeOfMomentum) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    std::vector<Vector3> v;
    std::vector<double> inverse_mass;
    for (int i = 0; i < 6; ++i) {
      v.push_back(random_point(random));
      inverse_mass.push_back(random_in(random, 0.1, 2.0));
    }
    const std::vector<Vector3> before = v;
    std::vector<ContactPoint> points;
    for (const std::array<int, 3>& vertices : {std::array<int, 3>{0, 1, 2}, {2, 3, 4}, {0, 2, 4}, {3, 4, 5}}) {
      // Not so uneven that the mobility is bounded: there a point is stopped in part only.
      points.push_back(point_at(vertices, Vector3(0.3, 0.4, 0.3), random_direction(random), 0.0));
      points.back().instrument_velocity = random_point(random);
    }
    stop(points, inverse_mass, v);
    Vector3 impulses = Vector3::Zero();
    for (const ContactPoint& point : points) {
      EXPECT_GE(point.impulse, 0.0);
      impulses += point.impulse * point.direction;
    }
    EXPECT_LT((momentum(v, inverse_mass) - momentum(before, inverse_mass) - impulses).norm(), 1e-12);
  }
}

TEST(StopAtInstrument, AttachedVerticesTakeNoVelocity) {
  std::vector<Vector3> v(3, Vector3::Zero());
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0)};
  points[0].instrument_velocity = {0, 0, 1};
  stop(points, {0.0, 0.0, 1.0}, v);
  EXPECT_EQ(v[0], Vector3::Zero());
  EXPECT_EQ(v[1], Vector3::Zero());
  EXPECT_NEAR(0.5 * v[2].z(), 1.0, 1e-12);

  std::vector<Vector3> still(3, Vector3::Zero());
  stop(points, {0.0, 0.0, 0.0}, still);
  EXPECT_EQ(points[0].impulse, 0.0);
  EXPECT_EQ(still, std::vector<Vector3>(3, Vector3::Zero()));
}

TEST(StopAtInstrument, AGapMayBeClosedButNotPassed) {
  // 2 mm above its target with 1 ms to go: 2 m/s are let through, and what is faster is slowed to that.
  for (const double speed : {1.0, 5.0}) {
    std::vector<Vector3> v(3, Vector3(0, 0, -speed));
    std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), -0.002)};
    stop_at_instrument(points, {1.0, 1.0, 1.0}, corners, 0.001, v);
    EXPECT_NEAR(at_point(points[0], v).z(), -std::min(speed, 2.0), 1e-12);
    EXPECT_EQ(points[0].impulse > 0.0, speed > 2.0);
  }
  // Behind its target it is stopped: push_out has done what was to be done, and throws nothing.
  std::vector<Vector3> v(3, Vector3(0, 0, -1));
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.002)};
  stop_at_instrument(points, {1.0, 1.0, 1.0}, corners, 0.001, v);
  EXPECT_NEAR(at_point(points[0], v).z(), 0.0, 1e-12);
}

/// Once the instrument has left: the room is still that of the points before.
TEST(StopAtInstrument, WithoutPointsNothingHappens) {
  const std::vector<double> inverse_mass(3, 1.0);
  std::vector<ContactPoint> points = {point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0)};
  ResponseRoom room;
  room.delassus.build(points, inverse_mass);
  std::vector<Vector3> v(3, Vector3(0, 0, -1));
  tissue_sim::stop_at_instrument(points, inverse_mass, corners, 0.001, v, room);
  const std::vector<Vector3> stopped = v;
  const std::vector<double> impulses = room.impulses;
  points.clear();
  tissue_sim::stop_at_instrument(points, inverse_mass, corners, 0.001, v, room);
  bear_forces(inverse_mass, v, points, room);
  EXPECT_EQ(v, stopped);
  EXPECT_EQ(room.impulses, impulses);
}

/// A point that twelve vertices bear, as one of an embedded surface.
ContactPoint widely_borne(Random& random, int first) {
  ContactPoint point;
  double sum = 0.0;
  for (int i = 0; i < Bearers::most; ++i) {
    point.bearers.add(first + i, random_in(random, 0.2, 1.0));
    sum += point.bearers.weights[i];
  }
  for (double& weight : point.bearers.weights) weight /= sum;
  point.direction = random_direction(random);
  return point;
}

TEST(Bearers, AVertexThatBearsAlreadyBearsMore) {
  Bearers bearers;
  bearers.add(4, 0.25);
  bearers.add(7, 0.0);
  bearers.add(2, 0.5);
  bearers.add(4, 0.25);
  ASSERT_EQ(bearers.count, 2);
  EXPECT_EQ(bearers.vertices[0], 4);
  EXPECT_EQ(bearers.weights[0], 0.5);
  EXPECT_EQ(bearers.vertices[1], 2);
}

TEST(Bearers, TwelveShareTheWayAndTheImpulse) {
  Random random(4);
  for (int round = 0; round < 100; ++round) {
    std::vector<Vector3> x;
    std::vector<Vector3> v;
    std::vector<double> inverse_mass;
    for (int i = 0; i < 20; ++i) {
      x.push_back(random_point(random));
      v.push_back(random_point(random));
      inverse_mass.push_back(random_in(random, 0.5, 2.0));
    }
    std::vector<ContactPoint> points = {widely_borne(random, 0), widely_borne(random, 8)};
    for (ContactPoint& point : points) point.target = point.direction.dot(at_point(point, x)) + 1e-3;
    std::vector<ContactPoint> first = {points[0]};
    const std::vector<Vector3> before = x;
    push_out(first, inverse_mass, x, nullptr);
    EXPECT_NEAR(behind(first[0], x), 0.0, 1e-15);
    for (int i = 1; i < Bearers::most; ++i) {
      const double way = (x[i] - before[i]).norm() / (inverse_mass[i] * first[0].bearers.weights[i]);
      EXPECT_NEAR(way, (x[0] - before[0]).norm() / (inverse_mass[0] * first[0].bearers.weights[0]), 1e-12 * way);
    }
    push_out(points, inverse_mass, x, nullptr);
    for (const ContactPoint& point : points) EXPECT_LT(behind(point, x), contact_margin);

    const Vector3 momentum_before = momentum(v, inverse_mass);
    for (ContactPoint& point : points) point.instrument_velocity = at_point(point, v) + point.direction;
    std::vector<ContactPoint> one = {points[0]};
    std::vector<Vector3> stopped = v;
    stop_at_instrument(one, inverse_mass, x, 1.0, stopped);
    EXPECT_GT(one[0].impulse, 0.0);
    EXPECT_LT((momentum(stopped, inverse_mass) - momentum_before - one[0].impulse * one[0].direction).norm(), 1e-12);
    stop_at_instrument(points, inverse_mass, x, 1.0, v);
    const Vector3 given = points[0].impulse * points[0].direction + points[1].impulse * points[1].direction;
    EXPECT_LT((momentum(v, inverse_mass) - momentum_before - given).norm(), 1e-12);
  }
}

std::vector<ContactPoint> borne(const std::vector<double>& inverse_mass, const std::vector<Vector3>& forces,
                                std::vector<ContactPoint> points) {
  ResponseRoom room;
  room.delassus.build(points, inverse_mass);
  bear_forces(inverse_mass, forces, points, room);
  return points;
}

TEST(BearForces, OneVertexLeansOnTheInstrumentWithItsForceAlongTheDirection) {
  const ContactPoint point = point_at({0, 1, 2}, Vector3::UnitY(), Vector3(0, 0.6, -0.8), 0.0);
  const std::vector<Vector3> forces = {{9, 9, 9}, {1, -2, 3}, {9, 9, 9}};
  for (const double inverse_mass : {0.1, 10.0}) {
    EXPECT_NEAR(borne({1.0, inverse_mass, 1.0}, forces, {point})[0].force, 0.6 * 2.0 + 0.8 * 3.0, 1e-12);
  }
}

TEST(BearForces, NothingPulls) {
  const ContactPoint point = point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0);
  EXPECT_EQ(borne({1.0, 1.0, 1.0}, {{0, 0, 1}, {0, 0, 2}, {0, 0, 1}}, {point})[0].force, 0.0);
}

TEST(BearForces, WhatIsAttachedIsBorneElsewhere) {
  const ContactPoint point = point_at({0, 1, 2}, {0.2, 0.3, 0.5}, Vector3::UnitZ(), 0.0);
  const std::vector<Vector3> forces(3, Vector3(0, 0, -5));
  EXPECT_EQ(borne({0.0, 0.0, 0.0}, forces, {point})[0].force, 0.0);
  // The free corner's 5 N at a lever of a half hang on a point that would have to press with 10 N.
  EXPECT_NEAR(borne({0.0, 0.0, 2.0}, forces, {point})[0].force, 10.0, 1e-9);
}

TEST(BearForces, PointsThatShareVerticesBearWhatTheyHold) {
  // Forces that four presses hold exactly are found to be those presses, whatever the masses.
  Random random(5);
  const std::vector<std::array<int, 3>> triangles = {{0, 1, 2}, {2, 3, 4}, {0, 2, 4}, {3, 4, 5}};
  for (int round = 0; round < 100; ++round) {
    std::vector<double> inverse_mass;
    for (int i = 0; i < 6; ++i) inverse_mass.push_back(random_in(random, 0.5, 2.0));
    std::vector<Vector3> forces(6, Vector3::Zero());
    std::vector<ContactPoint> points;
    std::vector<double> presses;
    for (const std::array<int, 3>& vertices : triangles) {
      const Vector3 direction = (Vector3::UnitZ() + 0.3 * random_direction(random)).normalized();
      points.push_back(point_at(vertices, Vector3(0.3, 0.4, 0.3), direction, 0.0));
      presses.push_back(random_in(random, 0.5, 1.0));
      for (int i = 0; i < 3; ++i) {
        forces[vertices[i]] -= presses.back() * points.back().bearers.weights[i] * direction;
      }
    }
    Vector3 held = Vector3::Zero();
    for (const Vector3& force : forces) held += force;
    for (int substep = 0; substep < 20; ++substep) points = borne(inverse_mass, forces, points);  // as a step goes on
    for (std::size_t p = 0; p < points.size(); ++p) {
      EXPECT_NEAR(points[p].force, presses[p], 1e-3);
      held += points[p].force * points[p].direction;
    }
    EXPECT_LT(held.norm(), 1e-3);
  }
}

}  // namespace
}  // namespace tissue_sim::response_test
