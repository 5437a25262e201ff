#include "tissue_sim/geometry/embedding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "twins.h"

namespace tissue_sim::embedding_test {
namespace {

/// Barycentric coordinates from a 4 by 4 system: the weights sum to 1 and give the point.
Eigen::Vector4d solve_weights(const Vector3& p, const TetrahedralMesh& solid, const Tetrahedron& t) {
  Eigen::Matrix4d corners;
  for (int i = 0; i < 4; ++i) corners.col(i) << solid.vertices[t[i]], 1.0;
  Eigen::Vector4d point;
  point << p, 1.0;
  return corners.fullPivLu().solve(point);
}

double distance_to_tetrahedron(const Vector3& p, const TetrahedralMesh& solid, const Tetrahedron& t) {
  if (solve_weights(p, solid, t).minCoeff() >= 0.0) return 0.0;
  double nearest = 1e300;
  for (const auto& [a, b, c] : outward_faces) {
    nearest =
        std::min(nearest, distance_to_triangle(p, solid.vertices[t[a]], solid.vertices[t[b]], solid.vertices[t[c]]));
  }
  return nearest;
}

/// A block of uneven cells, its inner vertices moved about and everything turned.
TetrahedralMesh crooked_block(Random& random) {
  TetrahedralMesh solid = make_block({{{-1, -0.3, 0.2, 1}, {-1, 0.1, 1}, {-1, -0.5, 0.4, 1}}});
  const Pose pose = random_pose(random, 0.5);
  for (Vector3& v : solid.vertices) {
    if (v.cwiseAbs().maxCoeff() < 0.99) v += random_point(random, 0.1);
    v = pose.apply(v);
  }
  EXPECT_TRUE(inspect(solid).sound());
  return solid;
}

TEST(Embed, AgreesWithLookingAtEveryTetrahedron) {
  Random random(3);
  for (int round = 0; round < 5; ++round) {
    const TetrahedralMesh solid = crooked_block(random);
    std::vector<Vector3> points;
    for (int i = 0; i < 200; ++i) points.push_back(random_point(random, 1.4));
    const Embedding embedding = embed(points, solid);
    ASSERT_EQ(embedding.corners.size(), points.size());
    double farthest = 0.0;
    int outside = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      double nearest = 1e300;
      for (const Tetrahedron& t : solid.tetrahedra) {
        nearest = std::min(nearest, distance_to_tetrahedron(points[i], solid, t));
      }
      const double found = distance_to_tetrahedron(points[i], solid, embedding.corners[i]);
      EXPECT_NEAR(found, nearest, 1e-12);
      const Eigen::Vector4d expected = solve_weights(points[i], solid, embedding.corners[i]);
      const Eigen::Vector4d weights = Eigen::Map<const Eigen::Vector4d>(embedding.weights[i].data());
      EXPECT_LT((weights - expected).cwiseAbs().maxCoeff(), 1e-11);
      EXPECT_EQ(weights.minCoeff() >= 0.0, nearest == 0.0);
      outside += nearest > 0.0;
      farthest = std::max(farthest, nearest);
      // Of the tetrahedra equally near, none would be continued less far.
      for (const Tetrahedron& t : solid.tetrahedra) {
        if (nearest == 0.0 || distance_to_tetrahedron(points[i], solid, t) > nearest + 1e-12) continue;
        EXPECT_GE(weights.minCoeff(), solve_weights(points[i], solid, t).minCoeff() - 1e-11);
      }
    }
    EXPECT_GT(outside, 20);
    EXPECT_LT(outside, 180);
    EXPECT_NEAR(embedding.farthest_outside, farthest, 1e-12);
  }
}

TEST(Embed, FollowsEveryAffineMotion) {
  Random random(5);
  const TetrahedralMesh solid = crooked_block(random);
  std::vector<Vector3> points;
  for (int i = 0; i < 300; ++i) points.push_back(random_point(random, 1.5));
  const Embedding embedding = embed(points, solid);
  Eigen::Matrix3d stretch;
  stretch << 1.2, 0.3, -0.1, 0.0, 0.7, 0.4, 0.2, -0.5, 1.1;
  const Vector3 shift(3, -2, 1);
  std::vector<Vector3> moved_vertices;
  for (const Vector3& v : solid.vertices) moved_vertices.push_back(stretch * v + shift);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((embedded_point(embedding, i, solid.vertices) - points[i]).norm(), 1e-13);
    EXPECT_LT((embedded_point(embedding, i, moved_vertices) - (stretch * points[i] + shift)).norm(), 1e-12);
    const std::array<double, 4>& w = embedding.weights[i];
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3], 1.0, 1e-14);
  }
}

TEST(Embed, OnAFaceTakesTheLowerTetrahedron) {
  const TetrahedralMesh solid = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}},
                                 {{0, 2, 1, 4}, {0, 1, 2, 3}}};
  const Embedding embedding = embed({{0.25, 0.25, 0}, {0.25, 0.25, 0.1}, {0.25, 0.25, -0.1}}, solid);
  EXPECT_EQ(embedding.corners, (std::vector<Tetrahedron>{{0, 2, 1, 4}, {0, 1, 2, 3}, {0, 2, 1, 4}}));
  EXPECT_EQ(embedding.farthest_outside, 0.0);
}

TEST(Embed, ContinuesTheNearestTetrahedronOutside) {
  //       one |\            p lies 0.5 outside the face x = 0 of `one` and 9 from the other.
  //    p      |_\      other, 10 to the right
  TetrahedralMesh solid = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
  for (int v = 0; v < 4; ++v) solid.vertices.push_back(solid.vertices[v] + Vector3(10, 0, 0));
  solid.tetrahedra.push_back({4, 5, 6, 7});
  std::swap(solid.tetrahedra[0], solid.tetrahedra[1]);
  const Embedding embedding = embed({{-0.5, 0.25, 0.25}}, solid);
  EXPECT_EQ(embedding.corners[0], (Tetrahedron{0, 1, 2, 3}));
  EXPECT_EQ(embedding.weights[0], (std::array<double, 4>{1.0, -0.5, 0.25, 0.25}));
  EXPECT_DOUBLE_EQ(embedding.farthest_outside, 0.5);
}

TEST(Embed, PutsEachVertexOfTheSolidOnItself) {
  Random random(7);
  TetrahedralMesh solid = crooked_block(random);
  const Embedding embedding = embed(solid.vertices, solid);
  for (std::size_t v = 0; v < solid.vertices.size(); ++v) {
    EXPECT_LT((embedded_point(embedding, v, solid.vertices) - solid.vertices[v]).norm(), 1e-14);
    EXPECT_GT(*std::max_element(embedding.weights[v].begin(), embedding.weights[v].end()), 1.0 - 1e-12);
  }
  EXPECT_LT(embedding.farthest_outside, 1e-14);
}

/// A shell, and the surface that it was made from: vertices, and normals there.
struct Shell {
  TriangleMesh mesh;
  std::vector<Vector3> points;
  std::vector<Vector3> normals;
};

Shell crooked_shell(Random& random) {
  Shell shell = {make_octasphere(1.0, 2), {}, {}};
  for (Vector3& v : shell.mesh.vertices) v *= random_in(random, 0.95, 1.05);
  for (int i = 0; i < 200; ++i) {
    shell.normals.push_back(random_direction(random));
    shell.points.push_back(random_in(random, 0.9, 1.1) * shell.normals.back());
  }
  return shell;
}

TEST(EmbedOnShell, AgreesWithLookingAtEveryTriangle) {
  Random random(11);
  const Shell shell = crooked_shell(random);
  const Embedding embedding = embed(shell.points, shell.normals, shell.mesh);
  double farthest = 0.0;
  for (std::size_t i = 0; i < shell.points.size(); ++i) {
    double nearest = 1e300;
    for (const auto& [a, b, c] : shell.mesh.triangles) {
      const auto& x = shell.mesh.vertices;
      if (area_normal(x[a], x[b], x[c]).dot(shell.normals[i]) > 0.0)
        nearest = std::min(nearest, distance_to_triangle(shell.points[i], x[a], x[b], x[c]));
    }
    const auto& [a, b, c, d] = embedding.corners[i];
    const auto& x = shell.mesh.vertices;
    EXPECT_NEAR(distance_to_triangle(shell.points[i], x[a], x[b], x[c]), nearest, 1e-12);
    EXPECT_EQ(d, a);
    EXPECT_EQ(embedding.weights[i][3], 0.0);
    EXPECT_LT((embedded_point(embedding, i, x) - shell.points[i]).norm(), 1e-14);
    farthest = std::max(farthest, nearest);
  }
  EXPECT_NEAR(embedding.farthest_outside, farthest, 1e-12);
}

TEST(EmbedOnShell, FollowsEveryRigidMotionAndStretchAlongATriangle) {
  Random random(13);
  const Shell shell = crooked_shell(random);
  const Embedding embedding = embed(shell.points, shell.normals, shell.mesh);
  const Pose pose = random_pose(random, 2.0);
  std::vector<Vector3> moved_vertices = shell.mesh.vertices;
  for (Vector3& v : moved_vertices) v = pose.apply(v);
  for (std::size_t i = 0; i < shell.points.size(); ++i) {
    EXPECT_LT((embedded_point(embedding, i, moved_vertices) - pose.apply(shell.points[i])).norm(), 1e-14);
  }
  // Blown up twice as large, what lies above a triangle is as far above it as before.
  for (Vector3& v : moved_vertices) v *= 2.0;
  for (std::size_t i = 0; i < shell.points.size(); ++i) {
    const Vector3 above = embedded_point(embedding, i, moved_vertices) - embedded_foot(embedding, i, moved_vertices);
    EXPECT_NEAR(above.norm(), std::abs(embedding.offsets[i]), 1e-14);
  }
}

TEST(EmbedOnShell, KeepsToTheWallThatFacesTheSameWay) {
  //   ______ the point is 0.4 below this one, which faces up
  //   ______ and 0.1 above this one, which faces down
  TriangleMesh walls = {{{0, 0, 0.5}, {1, 0, 0.5}, {0, 1, 0.5}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                        {{0, 1, 2}, {3, 5, 4}}};
  const std::vector<Vector3> points = {{0.2, 0.2, 0.1}};
  EXPECT_EQ(embed(points, {{0, 0, 1}}, walls).corners[0], (Tetrahedron{0, 1, 2, 0}));
  EXPECT_NEAR(embed(points, {{0, 0, 1}}, walls).offsets[0], -0.4, 1e-15);
  EXPECT_EQ(embed(points, {{0, 0, -1}}, walls).corners[0], (Tetrahedron{3, 5, 4, 3}));
  // Where none does, the nearest of all.
  EXPECT_EQ(embed(points, {{0, 0, 0}}, walls).corners[0], (Tetrahedron{3, 5, 4, 3}));
}

TEST(EmbedOnShell, AboveATriangleThatHasCollapsedIsOnIt) {
  const TriangleMesh shell = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  const Embedding embedding = embed({{0.2, 0.3, 0.1}}, {{0, 0, 1}}, shell);
  EXPECT_EQ(embedded_point(embedding, 0, std::vector<Vector3>(3, Vector3(1, 2, 3))), Vector3(1, 2, 3));
}

TEST(Embed, ManagesNoPoints) {
  const Embedding embedding = embed({}, make_block({1, 1, 1}, {1, 1, 1}));
  EXPECT_TRUE(embedding.corners.empty());
  EXPECT_EQ(embedding.farthest_outside, 0.0);
}

}  // namespace
}  // namespace tissue_sim::embedding_test
