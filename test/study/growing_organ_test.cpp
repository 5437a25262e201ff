#include "tissue_sim/study/growing_organ.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace tissue_sim::growing_organ_test {
namespace {

TEST(GrowingOrgan, IsClosedAndAsLargeAsAskedWithEdgesOfTwoMillimetres) {
  for (const int triangles : {10'000, 30'000}) {
    const TriangleMesh mesh = make_tube(triangles);
    const MeshFaults faults = inspect(mesh);
    EXPECT_TRUE(faults.closed_manifold());
    EXPECT_EQ(faults.components, 1);
    EXPECT_EQ(faults.misoriented_edges, 0);
    EXPECT_GT(enclosed_volume(mesh), 0.0);
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), triangles, 0.05 * triangles);
    double shortest = 1.0;
    double longest = 0.0;
    for (const auto& [a, b] : build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles).edges) {
      const double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
    }
    EXPECT_GT(shortest, 0.0012);
    EXPECT_LT(longest, 0.0032);
  }
}

TEST(GrowingOrgan, IsTheSameAroundThePressAtEverySize) {
  const auto near_press = [](int triangles) {
    std::vector<Vector3> near;
    for (const Vector3& p : make_tube(triangles).vertices) {
      if (std::abs(p.x()) < 0.010 && p.z() > 0.0) near.push_back(p);
    }
    return near;
  };
  const std::vector<Vector3> small = near_press(10'000);
  for (const int triangles : {11'000, 20'000, 50'000}) {
    const std::vector<Vector3> large = near_press(triangles);
    ASSERT_EQ(large.size(), small.size());
    for (std::size_t v = 0; v < small.size(); ++v) EXPECT_LT((large[v] - small[v]).norm(), 1e-12);
  }
  EXPECT_GT(small.size(), 300u);
}

TEST(GrowingOrgan, ThePressEndsFourMillimetresDeep) {
  EXPECT_GT(press_pose(0).position.z(), 0.035);
  EXPECT_NEAR(press_pose(press_steps).position.z(), 0.030 + 0.005 - 0.004, 1e-12);
  EXPECT_EQ(press_pose(press_steps).position, press_pose(press_steps / 2).position);
}

}  // namespace
}  // namespace tissue_sim::growing_organ_test
