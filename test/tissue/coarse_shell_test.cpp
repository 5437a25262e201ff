#include "tissue_sim/tissue/coarse_shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/tissue/energy.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim::coarse_shell_test {
namespace {

constexpr double radius = 0.05;

/// A hollow sphere of 2.9 mm edges, held below z = -0.04.
Organ hollow_sphere(double tolerance) {
  Organ organ;
  organ.mesh = make_octasphere(radius, 5);
  organ.model = Model::surface;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.wall_thickness = 0.004;
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    if (organ.mesh.vertices[v].z() < -0.04) organ.attached.push_back(static_cast<int>(v));
  }
  if (tolerance > 0.0) organ.levels_tolerance = tolerance;
  return organ;
}

/// A third of the triangles around each attached vertex.
double attached_area(const TriangleMesh& mesh, const std::vector<int>& attached) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const double third = area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]).norm() / 6.0;
    for (const int v : {a, b, c}) area += std::binary_search(attached.begin(), attached.end(), v) ? third : 0.0;
  }
  return area;
}

TEST(BendingLength, OfASphereIsReissners) {
  // sqrt(R h) / (12 (1 - nu^2))^(1/4)
  const double expected = std::sqrt(radius * 0.004) / std::pow(12.0 * (1.0 - 0.45 * 0.45), 0.25);
  EXPECT_NEAR(bending_length(hollow_sphere(0.0)), expected, 0.02 * expected);
}

TEST(BendingLength, OfAFlatBoxIsFinite) {
  Organ box = hollow_sphere(0.0);
  box.mesh = make_grid_box({0.1, 0.1, 0.02}, 8);
  EXPECT_GT(bending_length(box), 0.001);
  EXPECT_LT(bending_length(box), 0.05);
}

TEST(CoarseShell, FollowsFromTheTolerance) {
  double before = 0.0;
  for (const double tolerance : {0.02, 0.05, 0.1, 0.2}) {
    const Organ organ = hollow_sphere(tolerance);
    const CoarseShell coarse = coarse_shell(organ);
    ASSERT_FALSE(coarse.mesh.triangles.empty());
    EXPECT_TRUE(inspect(coarse.mesh).closed_manifold());
    const MeshTopology topology = build_topology(static_cast<int>(coarse.mesh.vertices.size()), coarse.mesh.triangles);
    const double edge = mean_edge_length(coarse.mesh.vertices, topology.edges);
    EXPECT_NEAR(edge, shell_edge(organ), 0.05 * edge);
    EXPECT_GT(edge, 1.1 * before);
    EXPECT_LT(coarse.bending, 1.0);
    EXPECT_GT(coarse.bending, 0.85);
    before = edge;
  }
}

TEST(CoarseShell, IsThereOnlyWhereAskedForAndWorthIt) {
  EXPECT_TRUE(coarse_shell(hollow_sphere(0.0)).mesh.triangles.empty());
  EXPECT_TRUE(coarse_shell(hollow_sphere(1e-3)).mesh.triangles.empty());
  Organ solid = hollow_sphere(0.05);
  solid.model = Model::fem;
  EXPECT_TRUE(coarse_shell(solid).mesh.triangles.empty());
  EXPECT_TRUE(build_rest_shape(hollow_sphere(1e-3)).shell.empty());
}

TEST(CoarseShell, IsHeldOverTheSameArea) {
  for (const double tolerance : {0.02, 0.05, 0.1}) {
    const Organ organ = hollow_sphere(tolerance);
    const CoarseShell coarse = coarse_shell(organ);
    const double wanted = attached_area(organ.mesh, organ.attached);
    EXPECT_NEAR(attached_area(coarse.mesh, coarse.attached), wanted, 0.1 * wanted) << tolerance;
    EXPECT_TRUE(std::is_sorted(coarse.attached.begin(), coarse.attached.end()));
  }
}

TEST(CoarseShell, HoldsEveryPatchThatIsHeldHoweverSmall) {
  Organ organ = hollow_sphere(0.1);
  organ.attached = {17, 3000};
  const CoarseShell coarse = coarse_shell(organ);
  ASSERT_EQ(coarse.attached.size(), 2u);
  for (const int v : organ.attached) {
    double nearest = 1.0;
    for (const int c : coarse.attached) {
      nearest = std::min(nearest, (coarse.mesh.vertices[c] - organ.mesh.vertices[v]).norm());
    }
    EXPECT_LT(nearest, shell_edge(organ));
  }
  organ.attached.clear();
  EXPECT_TRUE(coarse_shell(organ).attached.empty());
}

TEST(CoarseShell, CarriesTheSurfaceInTheRestShape) {
  const Organ organ = hollow_sphere(0.05);
  const RestShape shape = build_rest_shape(organ);
  const RestShape own = build_rest_shape(hollow_sphere(0.0));
  ASSERT_FALSE(shape.shell.empty());
  EXPECT_EQ(shape.first_simulated, shape.surface_vertices);
  EXPECT_EQ(shape.triangles, organ.mesh.triangles);
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    EXPECT_LT((shape.positions[v] - organ.mesh.vertices[v]).norm(), 1e-15);
    EXPECT_EQ(shape.mass[v], 0.0);
    EXPECT_EQ(shape.attached[v], 0);
  }
  for (const Triangle& t : shape.shell) {
    for (const int v : t) EXPECT_GE(v, shape.first_simulated);
  }
  for (const DistanceElement& e : shape.distances) EXPECT_GE(e.vertices[0], shape.first_simulated);
  EXPECT_NEAR(shape.total_mass - shape.added_mass, own.total_mass - own.added_mass, 0.01 * own.total_mass);
  EXPECT_NEAR(shape.enclosed.rest, own.enclosed.rest, 1e-4 * own.enclosed.rest);
  EXPECT_TRUE(std::isfinite(shape.enclosed.damping));
  EXPECT_GT(shape.stable_substep, 1.5 * own.stable_substep);
  EXPECT_LT(elastic_energy(shape, shape.positions), 1e-20);
}

TEST(CoarseShell, BlownUpItStoresWhatTheOrganDoes) {
  const RestShape shape = build_rest_shape(hollow_sphere(0.05));
  const RestShape own = build_rest_shape(hollow_sphere(0.0));
  const auto blown = [](const RestShape& rest) {
    std::vector<Vector3> x = rest.positions;
    for (Vector3& p : x) p *= 1.001;
    return elastic_energy(rest, x);
  };
  EXPECT_NEAR(blown(shape), blown(own), 0.03 * blown(own));
}

}  // namespace
}  // namespace tissue_sim::coarse_shell_test
