#include "tissue_sim/geometry/coarsening.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/primitives.h"
#include "twins.h"

namespace tissue_sim::coarsening_test {
namespace {

std::vector<double> sorted_edges(const TriangleMesh& mesh) {
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  std::vector<double> lengths;
  for (const Edge& e : topology.edges) lengths.push_back((mesh.vertices[e[1]] - mesh.vertices[e[0]]).norm());
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

int handles(const TriangleMesh& mesh) {
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  const int euler = static_cast<int>(mesh.vertices.size()) - static_cast<int>(topology.edges.size()) +
                    static_cast<int>(mesh.triangles.size());
  return inspect(mesh).components - euler / 2;
}

double distance_between(const TriangleMesh& mesh, const TriangleMesh& surface) {
  const AabbTree tree = tree_of(surface);
  double farthest = 0.0;
  for (const Vector3& p : mesh.vertices) {
    farthest = std::max(farthest, closest_on_mesh(surface.vertices, surface.triangles, tree, p, 1.0).squared_distance);
  }
  return std::sqrt(farthest);
}

struct Shape {
  const char* name;
  TriangleMesh mesh;
  double edge;      ///< m, asked for
  double distance;  ///< m, of a vertex from the surface: about edge^2 / (8 radius)
};

std::vector<Shape> shapes() {
  TriangleMesh two = make_octasphere(0.05, 4);
  const TriangleMesh torus = make_torus(0.05, 0.02, 48);
  const int first = static_cast<int>(two.vertices.size());
  for (const Vector3& p : torus.vertices) two.vertices.push_back(p + Vector3(0.2, 0, 0));
  for (const auto& [a, b, c] : torus.triangles) two.triangles.push_back({first + a, first + b, first + c});
  TriangleMesh bumpy = make_octasphere(0.05, 5);
  for (Vector3& p : bumpy.vertices) p *= 1.0 + 0.05 * std::sin(200.0 * p.x()) * std::sin(200.0 * p.y());
  return {{"octasphere", make_octasphere(0.05, 5), 0.006, 0.0002},
          {"uv sphere, thin at the poles", make_sphere(0.05, 64), 0.008, 0.0003},
          {"torus", make_torus(0.05, 0.02, 64), 0.006, 0.0004},
          {"sphere and torus", two, 0.006, 0.0004},
          {"bumpy", bumpy, 0.006, 0.001}};
}

TEST(Coarsen, KeepsASurfaceClosedAndItsEdgesAlike) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    const TriangleMesh coarse = coarsen(shape.mesh, shape.edge);
    EXPECT_TRUE(inspect(coarse).closed_manifold());
    EXPECT_EQ(inspect(coarse).components, inspect(shape.mesh).components);
    EXPECT_EQ(handles(coarse), handles(shape.mesh));
    EXPECT_NEAR(enclosed_volume(coarse), enclosed_volume(shape.mesh), 1e-4 * enclosed_volume(shape.mesh));
    const std::vector<double> edges = sorted_edges(coarse);
    EXPECT_NEAR(edges[edges.size() / 2], shape.edge, 0.06 * shape.edge);
    EXPECT_GT(edges.front(), 0.4 * shape.edge);
    EXPECT_LT(edges.back(), 1.9 * shape.edge);
    EXPECT_GT(edges[edges.size() / 20], 0.65 * shape.edge);
    EXPECT_LT(edges[edges.size() - edges.size() / 20], 1.45 * shape.edge);
    EXPECT_LT(distance_between(coarse, shape.mesh), shape.distance);
  }
}

TEST(Coarsen, FacesOutwardEverywhere) {
  const TriangleMesh coarse = coarsen(make_octasphere(0.05, 5), 0.006);
  for (const auto& [a, b, c] : coarse.triangles) {
    const Vector3& p = coarse.vertices[a];
    const Vector3 normal = area_normal(p, coarse.vertices[b], coarse.vertices[c]);
    EXPECT_GT(normal.normalized().dot(p.normalized()), 0.95);
  }
}

TEST(Coarsen, KeepsTheShapeOfABox) {
  const Vector3 size(0.1, 0.05, 0.03);
  const TriangleMesh coarse = coarsen(make_grid_box(size, 16), 0.01);
  EXPECT_TRUE(inspect(coarse).closed_manifold());
  EXPECT_NEAR(enclosed_volume(coarse), size.prod(), 1e-3 * size.prod());
  EXPECT_LT((bounds_of(coarse.vertices).size() - size).cwiseAbs().maxCoeff(), 0.004);
}

TEST(Coarsen, GoesOnUntilTheTopologyForbidsMore) {
  for (const TriangleMesh& mesh : {make_octasphere(0.05, 4), make_torus(0.05, 0.02, 24)}) {
    const TriangleMesh coarse = coarsen(mesh, 1.0);
    EXPECT_TRUE(inspect(coarse).closed_manifold());
    EXPECT_EQ(handles(coarse), handles(mesh));
    EXPECT_LT(coarse.triangles.size(), mesh.triangles.size() / 10);
  }
}

TEST(Coarsen, LeavesAMeshThatIsAsCoarse) {
  const TriangleMesh mesh = make_octasphere(0.05, 3);
  EXPECT_EQ(coarsen(mesh, 0.005).triangles, mesh.triangles);
  EXPECT_EQ(coarsen(mesh, 0.005).vertices, mesh.vertices);
  EXPECT_TRUE(coarsen({}, 0.01).triangles.empty());
}

TEST(Coarsen, GivesTheSameBitsAgain) {
  const TriangleMesh mesh = make_sphere(0.05, 48);
  const TriangleMesh one = coarsen(mesh, 0.007);
  const TriangleMesh other = coarsen(mesh, 0.007);
  EXPECT_EQ(one.triangles, other.triangles);
  EXPECT_EQ(one.vertices, other.vertices);
}

}  // namespace
}  // namespace tissue_sim::coarsening_test
