#include "tissue_sim/contact/penetration.h"

#include "contact/test_organ.h"
#include "tissue_sim/contact/propagation.h"

namespace tissue_sim::penetration_test {
namespace {

/// A tetrahedron whose vertex 0 is p and whose edges from there run along x, y and z.
TriangleMesh spike(const Vector3& p, const Vector3& lengths) {
  return {
      {p, p + lengths.x() * Vector3::UnitX(), p + lengths.y() * Vector3::UnitY(), p + lengths.z() * Vector3::UnitZ()},
      {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

const InstrumentSurface cube = build_instrument_surface(make_box(Vector3::Ones()), true);

/// Detection shifts what it looks at by 1 nm, and weights go with the square of a distance of 0.1.
constexpr double close = 1e-7;

// Eq. 1: omega(x_i, p) = 1 / |x_i - p|^2.
TEST(Penetration, Equation1ByHand) {
  EXPECT_DOUBLE_EQ(inverse_square_weight({0, 0, 0}, {0, 3, 4}), 1.0 / 25.0);
  EXPECT_DOUBLE_EQ(inverse_square_weight({1, 1, 1}, {1, 1, 1}), 1e18);
  EXPECT_DOUBLE_EQ(inverse_square_weight({0, 0, 0}, {1e-10, 0, 0}), 1e18);
}

// Eq. 2: d(p) = sum w_i (x_i - p) . n_i / sum w_i. Eq. 3: r(p) = sum w_i n_i / sum w_i, to unit length.
TEST(Penetration, Equations2And3ByHand) {
  TestOrgan organ(
      spike({0.4, 0.3, 0.25}, Vector3::Ones()));  // 0.1, 0.2 and 0.25 below three faces: weights 100, 25, 16
  ASSERT_EQ(organ.detect_in(cube), std::vector<int>{0});
  penetrate_border(organ.surface(), cube, organ.detection, organ.penetration);
  EXPECT_NEAR(organ.penetration.depth[0], (100 * 0.1 + 25 * 0.2 + 16 * 0.25) / 141.0, close);
  EXPECT_LT((organ.penetration.direction[0] - Vector3(100, 25, 16).normalized()).norm(), close);
}

TEST(Penetration, BelowOneFaceTheDepthIsExact) {
  const Vector3 p(0.1, -0.1, 0.3);
  TestOrgan organ({{p, p + Vector3(0.3, 0, 1), p + Vector3(0, 0.3, 0.7), p + Vector3(-0.2, -0.2, 0.9)},
                   {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  ASSERT_EQ(organ.detect_in(cube), std::vector<int>{0});
  penetrate_border(organ.surface(), cube, organ.detection, organ.penetration);
  EXPECT_NEAR(organ.penetration.depth[0], 0.2, close);
  EXPECT_LT((organ.penetration.direction[0] - Vector3::UnitZ()).norm(), close);
}

TEST(Penetration, OfAnEdgeThatLeavesTwiceTheNearestCrossingCounts) {
  // Edges up and down a fork of two prongs: the crossing at the prong that p is in is 0.1 away, the others farther.
  TriangleMesh prongs = moved(make_box({1, 1, 0.2}), at(0, 0, 0.0));
  const TriangleMesh other = moved(prongs, at(0, 0, 0.5));
  for (const auto& [a, b, c] : other.triangles) prongs.triangles.push_back({a + 8, b + 8, c + 8});
  prongs.vertices.insert(prongs.vertices.end(), other.vertices.begin(), other.vertices.end());
  const InstrumentSurface fork = build_instrument_surface(prongs, true);
  const Vector3 p(0.0, 0.0, 0.05);
  TestOrgan organ({{p, p + Vector3(0.01, 0, 1), p + Vector3(0, 0.02, 1), p + Vector3(-0.02, 0, 1)},
                   {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  ASSERT_EQ(organ.detect_in(fork), std::vector<int>{0});
  penetrate_border(organ.surface(), fork, organ.detection, organ.penetration);
  EXPECT_NEAR(organ.penetration.depth[0], 0.05, close);
}

TEST(Penetration, NormalsThatCancelGiveWayToTheClosestFeature) {
  // The middle of a plate, edges straight up and down.
  const InstrumentSurface plate = build_instrument_surface(make_box({1, 1, 0.02}), true);
  TestOrgan organ({{{0, 0, 0}, {0, 0, 1}, {0, 0, -1}, {2, 0, 0}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  organ.mesh.vertices[3] = {0.3, 0, 0.0};  // inside as well: its edge is crossed by nothing
  organ.detect_in(plate);
  ASSERT_TRUE(organ.collides(0));
  penetrate_border(organ.surface(), plate, organ.detection, organ.penetration);
  EXPECT_NEAR(organ.penetration.depth[0], 0.01, close);
  EXPECT_NEAR(std::abs(organ.penetration.direction[0].z()), 1.0, close);
}

TEST(Penetration, AVertexOnTheSurfaceIsFinite) {
  for (const double off : {0.0, 1e-12, -1e-12, 1e-9, -1e-9, -1e-8}) {
    TestOrgan organ(spike({0.1, 0.1, 0.5 + off}, Vector3::Ones()));
    organ.detect_in(cube);
    penetrate_border(organ.surface(), cube, organ.detection, organ.penetration);
    for (const int v : organ.detection.border) {
      EXPECT_TRUE(std::isfinite(organ.penetration.depth[v]));
      EXPECT_GE(organ.penetration.depth[v], 0.0);
      EXPECT_LT(organ.penetration.depth[v], 2e-8);
      EXPECT_LT((organ.penetration.direction[v] - Vector3::UnitZ()).norm(), 1e-3);
    }
  }
}

TEST(Penetration, IsNeverNegativeAndItsDirectionIsUnit) {
  Random random(1);
  TestOrgan organ(make_octasphere(0.03, 2));
  for (const TriangleMesh& mesh :
       {make_torus(0.015, 0.004, 12), make_cylinder(0.004, 0.06, 12), make_box({0.03, 0.03, 0.001})}) {
    const InstrumentSurface instrument = build_instrument_surface(mesh, true);
    for (int round = 0; round < 100; ++round) {
      organ.detect_in(instrument, random_pose(random, 0.04));
      penetrate_border(organ.surface(), instrument, organ.detection, organ.penetration);
      for (const int v : organ.detection.border) {
        EXPECT_GE(organ.penetration.depth[v], 0.0);
        EXPECT_NEAR(organ.penetration.direction[v].norm(), 1.0, 1e-12);
      }
    }
  }
}

TEST(Penetration, ExactIsTheClosestPointForAll) {
  Random random(2);
  TestOrgan organ(make_octasphere(0.03, 2));
  const TriangleMesh mesh = make_octasphere(0.02, 2);
  const InstrumentSurface instrument = build_instrument_surface(mesh, true);
  for (int round = 0; round < 50; ++round) {
    const Pose pose = random_pose(random, 0.02);
    organ.detect_in(instrument, pose);
    penetrate_exactly(instrument, organ.detection, organ.penetration);
    for (const int v : organ.detection.colliding) {
      const Vector3 local = pose.apply_inverse(organ.mesh.vertices[v]);
      EXPECT_NEAR(organ.penetration.depth[v], distance_to_mesh(mesh, local), undecided);
      EXPECT_LT(distance_to_mesh(mesh, local + organ.penetration.depth[v] * organ.penetration.direction[v]), undecided);
    }
  }
}

}  // namespace
}  // namespace tissue_sim::penetration_test
