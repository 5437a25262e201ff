#include "tissue_sim/geometry/edge_triangle.h"

#include <gtest/gtest.h>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::edge_triangle_test {
namespace {

const std::array<Vector3, 3> right_angled = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0)};

EdgeTriangleHit hit(const Vector3& p, const Vector3& q, const std::array<Vector3, 3>& corners = right_angled,
                    const Triangle& indices = {0, 1, 2}) {
  return hit_edge_triangle(p, q, {&corners[0], &corners[1], &corners[2]}, indices);
}

EdgeTriangleHit hit(const TriangleMesh& mesh, const Triangle& t, const Vector3& p, const Vector3& q) {
  return hit_edge_triangle(p, q, {&mesh.vertices[t[0]], &mesh.vertices[t[1]], &mesh.vertices[t[2]]}, t);
}

struct Hits {
  int count = 0;
  int sum = 0;
};

Hits count_hits(const TriangleMesh& mesh, const Vector3& p, const Vector3& q) {
  Hits hits;
  for (const Triangle& t : mesh.triangles) {
    const int direction = hit(mesh, t, p, q).direction;
    hits.count += direction != 0 ? 1 : 0;
    hits.sum += direction;
  }
  return hits;
}

TEST(EdgeTriangle, TellsWhereAndWhichWay) {
  const EdgeTriangleHit up = hit({0.25, 0.25, -1}, {0.25, 0.25, 3});
  EXPECT_EQ(up.direction, 1);
  EXPECT_DOUBLE_EQ(up.t, 0.25);
  const EdgeTriangleHit down = hit({0.25, 0.25, 3}, {0.25, 0.25, -1});
  EXPECT_EQ(down.direction, -1);
  EXPECT_DOUBLE_EQ(down.t, 0.75);
  EXPECT_EQ(hit({0.75, 0.75, -1}, {0.75, 0.75, 1}).direction, 0) << "beside it";
  EXPECT_EQ(hit({0.25, 0.25, 1}, {0.25, 0.25, 3}).direction, 0) << "ends before it";
}

TEST(EdgeTriangle, AnEndInThePlaneIsInFront) {
  EXPECT_EQ(hit({0.25, 0.25, 0}, {0.25, 0.25, 1}).direction, 0);
  const EdgeTriangleHit from_plane = hit({0.25, 0.25, 0}, {0.25, 0.25, -1});
  EXPECT_EQ(from_plane.direction, -1);
  EXPECT_EQ(from_plane.t, 0.0);
  const EdgeTriangleHit to_plane = hit({0.25, 0.25, -1}, {0.25, 0.25, 0});
  EXPECT_EQ(to_plane.direction, 1);
  EXPECT_EQ(to_plane.t, 1.0);
}

TEST(EdgeTriangle, InThePlaneThereIsNoHit) {
  EXPECT_EQ(hit({-1, 0.25, 0}, {1, 0.25, 0}).direction, 0);
  EXPECT_EQ(hit({0.1, 0.1, 0}, {0.2, 0.2, 0}).direction, 0);
}

TEST(EdgeTriangle, DegenerateTrianglesAreNeverHit) {
  const Vector3 a(0, 0, 0);
  const Vector3 b(1, 0, 0);
  for (const std::array<Vector3, 3>& corners :
       {std::array<Vector3, 3>{a, a, a}, std::array<Vector3, 3>{a, b, a}, std::array<Vector3, 3>{a, b, 0.5 * b}}) {
    EXPECT_EQ(hit({0.5, 0, -1}, {0.5, 0, 1}, corners).direction, 0);
    EXPECT_EQ(hit({0, 0, -1}, {0, 0, 1}, corners).direction, 0);
    EXPECT_EQ(hit({-1, 0, 0}, {1, 0, 0}, corners).direction, 0);
  }
}

TEST(EdgeTriangle, WhatIsNoNumberIsNoHit) {
  const WithoutTraps off;  // a NaN is compared
  for (int i = 0; i < 3; ++i) {
    Vector3 p(0.25, 0.25, -1);
    p[i] = std::nan("");
    EXPECT_EQ(hit(p, {0.25, 0.25, 1}).direction, 0);
    EXPECT_EQ(hit({0.25, 0.25, 1}, p).direction, 0);
    std::array<Vector3, 3> corners = right_angled;
    corners[i] = p;
    EXPECT_EQ(hit({0.25, 0.25, -1}, {0.25, 0.25, 1}, corners).direction, 0);
  }
}

TEST(EdgeTriangle, AnyCornerMayComeFirst) {
  Random random(1);
  int hits = 0;
  for (int round = 0; round < 20000; ++round) {
    const std::array<Vector3, 3> c = {random_point(random), random_point(random), random_point(random)};
    const Vector3 p = random_point(random);
    const Vector3 q = random_point(random);
    const EdgeTriangleHit once = hit(p, q, c, {0, 1, 2});
    const EdgeTriangleHit turned = hit(p, q, {c[1], c[2], c[0]}, {1, 2, 0});
    const EdgeTriangleHit flipped = hit(p, q, {c[0], c[2], c[1]}, {0, 2, 1});
    const EdgeTriangleHit back = hit(q, p, c, {0, 1, 2});
    EXPECT_EQ(once.direction, turned.direction);
    EXPECT_EQ(once.direction, -flipped.direction);
    EXPECT_EQ(once.direction, -back.direction);
    if (once.direction == 0) continue;
    ++hits;
    const Vector3 at = p + once.t * (q - p);
    EXPECT_LT(distance_to_triangle(at, c[0], c[1], c[2]), 1e-12);
    EXPECT_NEAR(back.t, 1.0 - once.t, 1e-9);
  }
  EXPECT_GT(hits, 500);
}

/// Through closed surfaces: every hit outward is one more than the hits inward where the edge leads from inside to
/// outside.
TEST(EdgeTriangle, ClosedMeshesAreWatertight) {
  Random random(2);
  const std::vector<TriangleMesh> meshes = {make_octasphere(1.0, 2), make_sphere(1.0, 9), make_torus(0.7, 0.25, 11),
                                            make_grid_box({1.2, 1.0, 0.8}, 3), make_cylinder(0.5, 1.5, 9)};
  for (const TriangleMesh& mesh : meshes) {
    ASSERT_TRUE(inspect(mesh).closed_manifold());
    for (int round = 0; round < 2000; ++round) {
      const Vector3 p = random_point(random, 1.3);
      const Vector3 q = random_point(random, 1.3);
      EXPECT_EQ(count_hits(mesh, p, q).sum, (is_inside(mesh, p) ? 1 : 0) - (is_inside(mesh, q) ? 1 : 0));
    }
  }
}

/// From inside a convex surface to outside, aimed at a vertex or at the middle of an edge as nearly as numbers allow:
/// one hit.
TEST(EdgeTriangle, CornersAndRimsAreHitOnce) {
  Random random(3);
  const std::vector<TriangleMesh> meshes = {make_octasphere(1.0, 2), make_sphere(1.0, 9),
                                            make_grid_box({1.2, 1.0, 0.8}, 3), make_cylinder(0.5, 1.5, 9)};
  for (const TriangleMesh& mesh : meshes) {
    const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
    std::vector<Vector3> aims = mesh.vertices;
    for (const auto& [a, b] : topology.edges) aims.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    for (int round = 0; round < 10; ++round) {
      // First from the middle, where symmetry makes the ties exact.
      const Vector3 from = round == 0 ? Vector3::Zero() : random_point(random, 0.2);
      for (const Vector3& aim : aims) {
        const Vector3 beyond = from + 2.0 * (aim - from);
        const Hits out = count_hits(mesh, from, beyond);
        EXPECT_EQ(out.count, 1) << "from " << from.transpose() << " through " << aim.transpose();
        EXPECT_EQ(out.sum, 1);
        const Hits in = count_hits(mesh, beyond, from);
        EXPECT_EQ(in.count, 1);
        EXPECT_EQ(in.sum, -1);
      }
    }
  }
}

}  // namespace
}  // namespace tissue_sim::edge_triangle_test
