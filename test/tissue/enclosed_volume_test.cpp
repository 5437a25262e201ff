#include "tissue_sim/tissue/enclosed_volume.h"

#include <gtest/gtest.h>

#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::enclosed_volume_test {
namespace {

TEST(EnclosedVolume, IsTheChangeOfVolumeOverTheRest) {
  TriangleMesh box = make_box({1.0, 2.0, 3.0});
  std::vector<Vector3> gradient(box.vertices.size());
  const EnclosedVolume enclosed = {6.0, 1.0, 0.0};
  EXPECT_NEAR(enclosed.evaluate(box.vertices, box.triangles, gradient), 0.0, 1e-14);
  for (Vector3& v : box.vertices) v.x() *= 1.5;
  EXPECT_NEAR(enclosed.evaluate(box.vertices, box.triangles, gradient), 0.5, 1e-14);
}

TEST(EnclosedVolume, GradientIsItsSlopeAndMovesNothingAsAWhole) {
  Random random(1);
  TriangleMesh torus = make_torus(0.7, 0.25, 7);
  for (Vector3& v : torus.vertices) v += random_point(random, 0.05);
  const EnclosedVolume enclosed = {enclosed_volume(torus), 1.0, 0.0};
  std::vector<Vector3> gradient(torus.vertices.size());
  std::vector<Vector3> unused(torus.vertices.size());
  enclosed.evaluate(torus.vertices, torus.triangles, gradient);
  Vector3 force = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
  double size = 0.0;
  for (std::size_t v = 0; v < gradient.size(); ++v) {
    force += gradient[v];
    torque += torus.vertices[v].cross(gradient[v]);
    size = std::max(size, gradient[v].norm());
  }
  EXPECT_LT(force.norm(), 1e-12 * size);
  EXPECT_LT(torque.norm(), 1e-12 * size);
  constexpr double h = 1e-5;
  for (std::size_t v = 0; v < gradient.size(); ++v) {  // the first vertex too, from which the volume is measured
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Vector3> x = torus.vertices;
      x[v][axis] += h;
      const double above = enclosed.evaluate(x, torus.triangles, unused);
      x[v][axis] -= 2.0 * h;
      const double below = enclosed.evaluate(x, torus.triangles, unused);
      EXPECT_NEAR(gradient[v][axis], (above - below) / (2.0 * h), 1e-8 * size);
    }
  }
}

TEST(EnclosedVolume, DoesNotChangeWithThePlace) {
  TriangleMesh sphere = make_sphere(0.05, 16);
  const EnclosedVolume enclosed = {enclosed_volume(sphere), 1.0, 0.0};
  std::vector<Vector3> gradient(sphere.vertices.size());
  // Measured from the origin instead of from a vertex, 1 km away costs nine digits.
  const Pose far = {Vector3(1000.0, -700.0, 300.0), Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Vector3::UnitY()))};
  EXPECT_NEAR(enclosed.evaluate(moved(sphere, far).vertices, sphere.triangles, gradient), 0.0, 1e-9);
}

}  // namespace
}  // namespace tissue_sim::enclosed_volume_test
