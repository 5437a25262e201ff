#include "tissue_sim/geometry/closest_point.h"

#include <gtest/gtest.h>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::closest_point_test {
namespace {

constexpr double far_away = 1e150;

const Vector3 a(0, 0, 0);
const Vector3 b(4, 0, 0);
const Vector3 c(0, 4, 0);

void expect_closest(const Vector3& p, const Vector3& point, Feature feature) {
  const ClosestOnTriangle closest = closest_on_triangle(p, a, b, c);
  EXPECT_LT((closest.point - point).norm(), 1e-15) << "of " << p.transpose();
  EXPECT_EQ(closest.feature, feature) << "of " << p.transpose();
  const Vector3& w = closest.barycentric;
  EXPECT_LT((w[0] * a + w[1] * b + w[2] * c - point).norm(), 1e-15);
}

TEST(ClosestOnTriangle, EveryFeature) {
  expect_closest({1, 1, 5}, {1, 1, 0}, Feature::face);
  expect_closest({1, 1, -5}, {1, 1, 0}, Feature::face);
  expect_closest({-1, -2, 3}, a, Feature::corner_0);
  expect_closest({6, -1, 1}, b, Feature::corner_1);
  expect_closest({-1, 7, 1}, c, Feature::corner_2);
  expect_closest({2, -3, 1}, {2, 0, 0}, Feature::rim_0);
  expect_closest({4, 4, 1}, {2, 2, 0}, Feature::rim_1);
  expect_closest({-3, 1, 1}, {0, 1, 0}, Feature::rim_2);
  expect_closest(a, a, Feature::corner_0);
  expect_closest({2, 0, 0}, {2, 0, 0}, Feature::rim_0);
}

TEST(ClosestOnTriangle, NothingOfTheTriangleIsNearer) {
  Random random(1);
  constexpr int samples = 40;
  for (int round = 0; round < 1000; ++round) {
    const std::array<Vector3, 3> x = {random_point(random), random_point(random), random_point(random)};
    const Vector3 p = random_point(random, 2.0);
    const ClosestOnTriangle closest = closest_on_triangle(p, x[0], x[1], x[2]);
    const double distance = (closest.point - p).norm();
    const Vector3& w = closest.barycentric;
    EXPECT_GE(w.minCoeff(), 0.0);
    EXPECT_NEAR(w.sum(), 1.0, 1e-14);
    EXPECT_LT((w[0] * x[0] + w[1] * x[1] + w[2] * x[2] - closest.point).norm(), 1e-11);
    EXPECT_NEAR(distance, distance_to_triangle(p, x[0], x[1], x[2]), 1e-11);
    for (int i = 0; i <= samples; ++i) {
      for (int j = 0; i + j <= samples; ++j) {
        const Vector3 sample = (i * x[0] + j * x[1] + (samples - i - j) * x[2]) / samples;
        ASSERT_GE((sample - p).norm(), distance - 1e-12);
      }
    }
  }
}

TEST(ClosestOnTriangle, DegenerateTrianglesAreSegmentsAndPoints) {
  const Vector3 p(1, 2, 0);
  EXPECT_EQ(closest_on_triangle(p, a, a, a).point, a);
  EXPECT_EQ(closest_on_triangle(p, a, b, b).point, Vector3(1, 0, 0));
  EXPECT_EQ(closest_on_triangle(p, a, a, b).point, Vector3(1, 0, 0));
  EXPECT_EQ(closest_on_triangle(p, a, b, 0.5 * b).point, Vector3(1, 0, 0));
  EXPECT_EQ(closest_on_triangle(p, 0.5 * b, a, b).point, Vector3(1, 0, 0));
  Random random(2);
  for (int round = 0; round < 2000; ++round) {  // slivers, some thinner than rounding
    const Vector3 x = random_point(random);
    const Vector3 y = random_point(random);
    const Vector3 z = x + random_in(random, -0.5, 1.5) * (y - x) +
                      std::pow(10.0, random_in(random, -20.0, -3.0)) * random_direction(random);
    const Vector3 q = random_point(random, 2.0);
    const ClosestOnTriangle closest = closest_on_triangle(q, x, y, z);
    EXPECT_TRUE(closest.point.allFinite());
    const double to_rims =
        std::min({distance_to_segment(q, x, y), distance_to_segment(q, y, z), distance_to_segment(q, z, x)});
    EXPECT_LT((closest.point - q).norm(), to_rims + 1e-12);
    EXPECT_LT(distance_to_segment(closest.point, x, y), 1.5 * (y - x).norm());
  }
}

TEST(ClosestOnMesh, EqualsBruteForceWhateverTheGuess) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    const int count = 1 + round % 80;
    const TriangleMesh soup = random_soup(random, count, 0.3);
    const AabbTree tree = tree_of(soup);
    for (int i = 0; i < 5; ++i) {
      const Vector3 p = random_point(random, 1.5);
      const double nearest = distance_to_mesh(soup, p);
      const ClosestOnMesh closest = closest_on_mesh(soup.vertices, soup.triangles, tree, p, far_away);
      ASSERT_GE(closest.triangle, 0);
      EXPECT_NEAR(std::sqrt(closest.squared_distance), nearest, 1e-9);
      for (int guess = 0; guess < count; guess += 7) {
        const ClosestOnMesh guessed = closest_on_mesh(soup.vertices, soup.triangles, tree, p, far_away, guess);
        EXPECT_EQ(guessed.triangle, closest.triangle);
        EXPECT_EQ(guessed.on.point, closest.on.point);
      }
      EXPECT_EQ(closest_on_mesh(soup.vertices, soup.triangles, tree, p, 0.99 * nearest).triangle, -1);
      EXPECT_EQ(closest_on_mesh(soup.vertices, soup.triangles, tree, p, 1.01 * nearest).triangle, closest.triangle);
    }
  }
}

TEST(ClosestOnMesh, OfEqualDistancesTheLowestTriangleWins) {
  const TriangleMesh mesh = make_octasphere(1.0, 2);
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  const AabbTree tree = tree_of(mesh);
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
    const int lowest = *topology.vertex_triangles.begin(v);
    for (int guess = -1; guess < static_cast<int>(mesh.triangles.size()); ++guess) {
      EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, mesh.vertices[v], far_away, guess).triangle,
                lowest);
    }
  }
}

TEST(ClosestOnMesh, WhatIsNoNumberIsNearNothing) {
  const WithoutTraps off;  // a NaN is compared
  const TriangleMesh mesh = make_octasphere(1.0, 1);
  const AabbTree tree = tree_of(mesh);
  const Vector3 p(0, std::nan(""), 0);
  EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, far_away).triangle, -1);
  EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, far_away, 3).triangle, -1);
}

TEST(Pseudonormal, TellsInsideFromOutside) {
  Random random(4);
  const std::vector<TriangleMesh> meshes = {make_octasphere(1.0, 2), make_torus(0.7, 0.25, 9),
                                            make_box({1.0, 0.5, 1.4}), make_cylinder(0.5, 1.5, 7)};
  int kinds[3] = {0, 0, 0};
  for (const TriangleMesh& mesh : meshes) {
    const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
    const AabbTree tree = tree_of(mesh);
    for (int round = 0; round < 4000; ++round) {
      const Vector3 p = random_point(random, 1.2);
      const ClosestOnMesh closest = closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, far_away);
      if (closest.squared_distance < 1e-18) continue;
      const Vector3 normal =
          pseudonormal(mesh.vertices, mesh.triangles, topology, closest.triangle, closest.on.feature);
      EXPECT_EQ(normal.dot(closest.on.point - p) > 0.0, is_inside(mesh, p)) << p.transpose();
      ++kinds[closest.on.feature == Feature::face ? 2 : closest.on.feature >= Feature::rim_0 ? 1 : 0];
    }
  }
  for (const int kind : kinds) EXPECT_GT(kind, 500);
}

TEST(Pseudonormal, DoesNotDependOnTheTriangleAsked) {
  const TriangleMesh box = make_box(Vector3::Ones());
  const MeshTopology topology = build_topology(8, box.triangles);
  for (int t = 0; t < 12; ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      // The three faces at a corner of a cube count alike, into however many triangles they are cut.
      const Vector3 normal = pseudonormal(box.vertices, box.triangles, topology, t, static_cast<Feature>(corner));
      EXPECT_LT((normal.normalized() - box.vertices[box.triangles[t][corner]].normalized()).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace tissue_sim::closest_point_test
