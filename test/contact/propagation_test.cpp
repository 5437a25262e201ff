#include "tissue_sim/contact/propagation.h"

#include "contact/test_organ.h"

namespace tissue_sim::propagation_test {
namespace {

// Eq. 4: mu(p_j, p) = 1 / |p_j - p|^2. Eq. 5: d(p) = sum mu_j ((p_j - p) . r(p_j) + d(p_j)) / sum mu_j.
// Eq. 6: r(p) = sum mu_j r(p_j) / sum mu_j, to unit length.
TEST(Propagation, Equations4To6ByHand) {
  // p at the origin among three border vertices 1, 2 and 4 away: weights 1, 1/4 and 1/16.
  TestOrgan organ({{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  const InstrumentSurface big = build_instrument_surface(make_box(Vector3::Constant(20)), true);
  Detection& d = organ.detection;
  d.colliding = {0, 1, 2, 3};
  d.border = {1, 2, 3};
  d.local = organ.mesh.vertices;
  organ.penetration.depth = {0.0, 0.5, 1.0, 3.0};
  organ.penetration.direction = {Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitX()};
  propagate(organ.surface(), big, d, organ.penetration);
  const double sum = 1.0 + 0.25 + 0.0625;
  EXPECT_NEAR(organ.penetration.depth[0], (1.0 * (1.0 + 0.5) + 0.25 * (2.0 + 1.0) + 0.0625 * (0.0 + 3.0)) / sum, 1e-14);
  EXPECT_LT((organ.penetration.direction[0] - Vector3(1.0625, 0.25, 0.0).normalized()).norm(), 1e-14);
  EXPECT_EQ(organ.penetration.depth[1], 0.5) << "the border keeps what stage 2 found";
}

TEST(Propagation, DepthIsNeverNegative) {
  TestOrgan organ({{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}});
  const InstrumentSurface big = build_instrument_surface(make_box(Vector3::Constant(20)), true);
  organ.detection.colliding = {0, 1};
  organ.detection.border = {1};
  organ.detection.local = organ.mesh.vertices;
  organ.penetration.depth[1] = 0.25;
  organ.penetration.direction[1] = -Vector3::UnitX();  // p is 1 beyond it: 0.25 - 1
  propagate(organ.surface(), big, organ.detection, organ.penetration);
  EXPECT_EQ(organ.penetration.depth[0], 0.0);
}

/// Layers from the border inward, each from the layers before it: written down once more with maps.
void propagate_plainly(const TestOrgan& organ, std::map<int, double>& depth, std::map<int, Vector3>& direction) {
  const Detection& d = organ.detection;
  for (bool more = true; more;) {
    std::map<int, double> new_depth;
    std::map<int, Vector3> new_direction;
    for (const int v : d.colliding) {
      if (depth.count(v) != 0) continue;
      double weights = 0.0;
      double depths = 0.0;
      Vector3 directions = Vector3::Zero();
      for (const auto& [a, b] : organ.topology.edges) {
        const int n = a == v ? b : b == v ? a : -1;
        if (n < 0 || depth.count(n) == 0) continue;
        const Vector3 way = d.local[n] - d.local[v];
        const double weight = 1.0 / way.squaredNorm();
        weights += weight;
        depths += weight * (way.dot(direction[n]) + depth[n]);
        directions += weight * direction[n];
      }
      if (weights == 0.0) continue;
      new_depth[v] = std::max(0.0, depths / weights);
      new_direction[v] = directions.normalized();
    }
    more = !new_depth.empty();
    depth.insert(new_depth.begin(), new_depth.end());
    direction.insert(new_direction.begin(), new_direction.end());
  }
}

TEST(Propagation, EqualsItsPlainTwin) {
  Random random(1);
  TestOrgan organ(make_octasphere(0.03, 3));
  const InstrumentSurface instrument = build_instrument_surface(make_octasphere(0.02, 2), true);
  std::size_t inner = 0;
  for (int round = 0; round < 30; ++round) {
    const Pose pose = {random_in(random, 0.03, 0.045) * random_direction(random), Eigen::Quaterniond::Identity()};
    organ.detect_in(instrument, pose);
    penetrate_border(organ.surface(), instrument, organ.detection, organ.penetration);
    std::map<int, double> depth;
    std::map<int, Vector3> direction;
    for (const int v : organ.detection.border) {
      depth[v] = organ.penetration.depth[v];
      direction[v] = organ.penetration.direction[v];
    }
    propagate_plainly(organ, depth, direction);
    propagate(organ.surface(), instrument, organ.detection, organ.penetration);
    ASSERT_EQ(depth.size(), organ.detection.colliding.size());
    for (const auto& [v, expected] : depth) {
      EXPECT_NEAR(organ.penetration.depth[v], expected, 1e-14);
      EXPECT_LT((organ.penetration.direction[v] - direction[v]).norm(), 1e-10);
    }
    inner += depth.size() - organ.detection.border.size();
  }
  EXPECT_GT(inner, 100u);
}

TEST(Propagation, WithoutAnyBorderTheClosestFeatureDecides) {
  TestOrgan organ(make_octasphere(0.01, 1));
  const TriangleMesh mesh = make_box(Vector3::Constant(0.05));
  const InstrumentSurface instrument = build_instrument_surface(mesh, true);
  organ.detect_in(instrument);
  ASSERT_EQ(organ.detection.colliding.size(), organ.mesh.vertices.size());
  penetrate_border(organ.surface(), instrument, organ.detection, organ.penetration);
  propagate(organ.surface(), instrument, organ.detection, organ.penetration);
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(organ.penetration.depth[v], distance_to_mesh(mesh, organ.mesh.vertices[v]), undecided);
    EXPECT_NEAR(organ.penetration.direction[v].norm(), 1.0, 1e-12);
  }
}

TEST(Propagation, AVertexThatNoLayerReachesTakesTheClosestFeature) {
  TestOrgan organ(make_octasphere(0.02, 2));
  const TriangleMesh mesh = make_box(Vector3::Constant(0.05));
  const InstrumentSurface instrument = build_instrument_surface(mesh, true);
  organ.detect_in(instrument);
  // Two far apart alone collide, as the paper's memory can leave them; one of them is border.
  organ.detection.colliding = {0, 1};
  organ.detection.border = {0};
  organ.penetration.depth[0] = 0.001;
  organ.penetration.direction[0] = Vector3::UnitX();
  organ.penetration.depth[1] = 123.0;  // of a step long ago
  propagate(organ.surface(), instrument, organ.detection, organ.penetration);
  EXPECT_EQ(organ.penetration.depth[0], 0.001);
  EXPECT_NEAR(organ.penetration.depth[1], distance_to_mesh(mesh, organ.mesh.vertices[1]), undecided);
}

TEST(Propagation, LeavesItsWorkingListClean) {
  TestOrgan organ(make_octasphere(0.03, 2));
  const InstrumentSurface instrument = build_instrument_surface(make_octasphere(0.02, 2), true);
  organ.detect_in(instrument, at(0.03, 0, 0));
  penetrate_border(organ.surface(), instrument, organ.detection, organ.penetration);
  propagate(organ.surface(), instrument, organ.detection, organ.penetration);
  for (const int layer : organ.penetration.layer_of) EXPECT_EQ(layer, -1);
}

}  // namespace
}  // namespace tissue_sim::propagation_test
