#include "tissue_sim/geometry/primitives.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tissue_sim::primitives_test {
namespace {

constexpr double pi = 3.14159265358979323846;

TEST(Sphere, HasTheSizesOfTable1) {
  const int n[] = {16, 32, 64};
  const std::size_t triangles[] = {480, 1984, 8064};
  for (int i = 0; i < 3; ++i) {
    const TriangleMesh sphere = make_sphere(0.05, n[i]);
    EXPECT_EQ(sphere.triangles.size(), triangles[i]);
    EXPECT_EQ(sphere.vertices.size(), static_cast<std::size_t>(n[i] * (n[i] - 1) + 2));
    EXPECT_TRUE(inspect(sphere).closed_manifold());
    EXPECT_EQ(inspect(sphere).components, 1);
    for (const Vector3& p : sphere.vertices) EXPECT_NEAR(p.norm(), 0.05, 1e-15);
  }
}

TEST(Sphere, VolumeTendsToTheFormula) {
  // Inscribed, so smaller: 2 pi^2 / (3 n^2) by the slices and pi^2 / (4 n^2) by the stacks.
  const double exact = 4.0 / 3.0 * pi;
  double gap = 1.0;
  for (const int n : {16, 32, 64}) {
    const double volume = enclosed_volume(make_sphere(1.0, n));
    EXPECT_LT(volume, exact);
    EXPECT_NEAR((exact - volume) / exact * n * n, 11.0 / 12.0 * pi * pi, 0.15);
    EXPECT_LT(exact - volume, gap);
    gap = exact - volume;
  }
}

TEST(Sphere, SmallestIsClosed) {
  EXPECT_TRUE(inspect(make_sphere(1.0, 3)).closed_manifold());
}

TEST(Cylinder, VolumeOfThePrism) {
  for (const int segments : {3, 4, 24}) {
    const TriangleMesh cylinder = make_cylinder(0.3, 2.0, segments);
    EXPECT_TRUE(inspect(cylinder).closed_manifold());
    const double base = 0.5 * segments * 0.3 * 0.3 * std::sin(2.0 * pi / segments);
    EXPECT_NEAR(enclosed_volume(cylinder), 2.0 * base, 1e-12);
  }
}

TEST(Box, VolumeAndExtent) {
  const TriangleMesh box = make_box({1.0, 2.0, 3.0});
  EXPECT_TRUE(inspect(box).closed_manifold());
  EXPECT_NEAR(enclosed_volume(box), 6.0, 1e-12);
  for (const Vector3& p : box.vertices) EXPECT_EQ(p.cwiseAbs(), Vector3(0.5, 1.0, 1.5));
}

}  // namespace
}  // namespace tissue_sim::primitives_test
