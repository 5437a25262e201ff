#include "tissue_sim/geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "floating_point_traps.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::triangle_mesh_test {
namespace {

TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

/// Every triangle with corners of its own, each coordinate moved by up to `noise`: what an STL file holds.
TriangleMesh soup_of(const TriangleMesh& mesh, double noise, std::mt19937& random) {
  std::uniform_real_distribution<double> offset(-noise, noise);
  TriangleMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const int first = static_cast<int>(soup.vertices.size());
    for (const int v : t) {
      soup.vertices.push_back(mesh.vertices[v] + Vector3(offset(random), offset(random), offset(random)));
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

std::vector<Triangle> random_triangles(int vertex_count, int triangle_count, std::mt19937& random) {
  std::uniform_int_distribution<int> vertex(0, vertex_count - 1);
  std::vector<Triangle> triangles;
  while (static_cast<int>(triangles.size()) < triangle_count) {
    const Triangle t{vertex(random), vertex(random), vertex(random)};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back(t);
  }
  return triangles;
}

TEST(Topology, AgreesWithMapsOnRandomTriangles) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    const int vertex_count = 3 + round % 20;
    const std::vector<Triangle> triangles = random_triangles(vertex_count, 1 + round % 60, random);
    std::map<Edge, std::vector<int>> expected;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax(triangles[t][i], triangles[t][(i + 1) % 3]);
        expected[{low, high}].push_back(static_cast<int>(t));
      }
    }
    const MeshTopology topology = build_topology(vertex_count, triangles);
    ASSERT_EQ(topology.edges.size(), expected.size());
    std::size_t e = 0;
    for (const auto& [edge, users] : expected) {
      EXPECT_EQ(topology.edges[e], edge);
      EXPECT_EQ(topology.edge_triangles[e][0], users[0]);
      EXPECT_EQ(topology.edge_triangles[e][1], users.size() > 1 ? users[1] : -1);
      ++e;
    }
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax(triangles[t][i], triangles[t][(i + 1) % 3]);
        EXPECT_EQ(topology.edges[topology.triangle_edges[t][i]], (Edge{low, high}));
      }
    }
    for (int v = 0; v < vertex_count; ++v) {
      std::vector<int> edges, around;
      for (std::size_t i = 0; i < topology.edges.size(); ++i) {
        if (topology.edges[i][0] == v || topology.edges[i][1] == v) edges.push_back(static_cast<int>(i));
      }
      for (std::size_t t = 0; t < triangles.size(); ++t) {
        if (std::count(triangles[t].begin(), triangles[t].end(), v)) around.push_back(static_cast<int>(t));
      }
      EXPECT_EQ(std::vector<int>(topology.vertex_edges.begin(v), topology.vertex_edges.end(v)), edges);
      EXPECT_EQ(std::vector<int>(topology.vertex_triangles.begin(v), topology.vertex_triangles.end(v)), around);
    }
  }
}

TEST(Topology, OfNothingIsEmpty) {
  const MeshTopology topology = build_topology(0, {});
  EXPECT_TRUE(topology.edges.empty());
  EXPECT_EQ(topology.vertex_edges.first, std::vector<int>{0});
}

TEST(Inspect, AgreesWithMapsOnRandomTriangles) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  for (int round = 0; round < 300; ++round) {
    TriangleMesh mesh;
    for (int v = 0; v < 4 + round % 12; ++v) {
      mesh.vertices.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    }
    mesh.triangles = random_triangles(static_cast<int>(mesh.vertices.size()), 1 + round % 25, random);

    std::map<Edge, std::vector<bool>> edges;
    std::map<std::set<int>, int> corners;
    for (const Triangle& t : mesh.triangles) {
      ++corners[{t[0], t[1], t[2]}];
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
        edges[{low, high}].push_back(t[i] == low);
      }
    }
    MeshFaults expected;
    for (const auto& [edge, forward] : edges) {
      expected.boundary_edges += forward.size() == 1;
      expected.non_manifold_edges += forward.size() > 2;
      expected.misoriented_edges += forward.size() == 2 && forward[0] == forward[1];
    }
    for (const auto& [corner, count] : corners) expected.duplicate_triangles += count - 1;

    // Fans and surfaces by growing sets until nothing changes.
    std::set<int> unvisited;
    for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
      std::vector<std::set<int>> fans;
      for (const Triangle& t : mesh.triangles) {
        if (!std::count(t.begin(), t.end(), v)) continue;
        std::set<int> fan(t.begin(), t.end());
        fan.erase(v);
        for (auto other = fans.begin(); other != fans.end();) {
          const bool meets = std::any_of(other->begin(), other->end(), [&](int c) { return fan.count(c) > 0; });
          if (meets) fan.insert(other->begin(), other->end());
          other = meets ? fans.erase(other) : std::next(other);
        }
        fans.push_back(fan);
      }
      expected.unreferenced_vertices += fans.empty();
      expected.non_manifold_vertices += fans.size() > 1;
      if (!fans.empty()) unvisited.insert(v);
    }
    while (!unvisited.empty()) {
      ++expected.components;
      std::set<int> surface{*unvisited.begin()};
      for (std::size_t size = 0; size != surface.size();) {
        size = surface.size();
        for (const Triangle& t : mesh.triangles) {
          if (surface.count(t[0]) || surface.count(t[1]) || surface.count(t[2])) surface.insert(t.begin(), t.end());
        }
      }
      for (const int v : surface) unvisited.erase(v);
    }

    const MeshFaults faults = inspect(mesh);
    EXPECT_EQ(faults.boundary_edges, expected.boundary_edges);
    EXPECT_EQ(faults.non_manifold_edges, expected.non_manifold_edges);
    EXPECT_EQ(faults.misoriented_edges, expected.misoriented_edges);
    EXPECT_EQ(faults.duplicate_triangles, expected.duplicate_triangles);
    EXPECT_EQ(faults.non_manifold_vertices, expected.non_manifold_vertices);
    EXPECT_EQ(faults.unreferenced_vertices, expected.unreferenced_vertices);
    EXPECT_EQ(faults.components, expected.components);
  }
}

TEST(Inspect, SoundMeshHasNoFault) {
  const MeshFaults faults = inspect(tetrahedron());
  EXPECT_TRUE(faults.closed_manifold());
  EXPECT_EQ(faults.components, 1);
}

TEST(Inspect, NothingIsNotASurface) {
  EXPECT_FALSE(inspect(TriangleMesh{}).closed_manifold());
}

TEST(Inspect, CountsIndicesThatAreNotThere) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.push_back({0, 1, 4});
  mesh.triangles.push_back({-1, 1, 2});
  EXPECT_EQ(inspect(mesh).bad_indices, 2);
  EXPECT_FALSE(inspect(mesh).closed_manifold());
}

TEST(Inspect, CountsNonFiniteVertices) {
  const WithoutTraps off;  // an infinity less itself tells that it is one
  TriangleMesh mesh = tetrahedron();
  mesh.vertices[1].x() = std::numeric_limits<double>::quiet_NaN();
  mesh.vertices[2].y() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(inspect(mesh).non_finite_vertices, 2);
  EXPECT_FALSE(inspect(mesh).closed_manifold());
}

TEST(Inspect, CountsRepeatedCorners) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.push_back({1, 1, 2});
  EXPECT_EQ(inspect(mesh).repeated_corners, 1);
  EXPECT_EQ(inspect(mesh).non_manifold_edges, 0);
}

TEST(Inspect, CountsTrianglesWithoutArea) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.emplace_back(0.5, 0.0, 0.0);
  mesh.triangles[1] = {0, 1, 4};  // all on the x axis
  EXPECT_EQ(inspect(mesh).degenerate_triangles, 1);
}

TEST(Inspect, CountsDuplicatesWhateverTheirCornerOrder) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.push_back({1, 2, 0});
  mesh.triangles.push_back({0, 1, 2});
  EXPECT_EQ(inspect(mesh).duplicate_triangles, 2);
  EXPECT_EQ(inspect(mesh).non_manifold_edges, 3);
}

TEST(Inspect, CountsBoundaryEdges) {
  TriangleMesh mesh = tetrahedron();
  mesh.triangles.pop_back();
  EXPECT_EQ(inspect(mesh).boundary_edges, 3);
}

TEST(Inspect, CountsMisorientedEdges) {
  TriangleMesh mesh = tetrahedron();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_EQ(inspect(mesh).misoriented_edges, 3);
}

TEST(Inspect, CountsVerticesWhereTwoFansMeet) {
  //  two tetrahedra tip to tip:  >•<
  TriangleMesh mesh = tetrahedron();
  for (const Triangle& t : tetrahedron().triangles) {
    Triangle other;
    for (std::size_t i = 0; i < 3; ++i) other[i] = t[i] == 0 ? 0 : t[i] + 3;
    std::swap(other[1], other[2]);
    mesh.triangles.push_back(other);
  }
  for (int v = 1; v < 4; ++v) mesh.vertices.push_back(-mesh.vertices[v]);
  EXPECT_EQ(inspect(mesh).non_manifold_vertices, 1);
  EXPECT_EQ(inspect(mesh).components, 1);
  EXPECT_EQ(inspect(mesh).boundary_edges, 0);
}

TEST(Inspect, CountsUnreferencedVertices) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.emplace_back(2, 2, 2);
  EXPECT_EQ(inspect(mesh).unreferenced_vertices, 1);
}

TEST(Weld, ClosesASoupAndKeepsTheOrder) {
  std::mt19937 random(3);
  const TriangleMesh sphere = make_sphere(0.05, 32);
  for (const double noise : {0.0, 1e-9}) {
    TriangleMesh soup = soup_of(sphere, noise, random);
    const TriangleMesh before = soup;
    EXPECT_EQ(inspect(soup).boundary_edges, static_cast<int>(3 * sphere.triangles.size()));
    const WeldReport report = weld(soup, noise > 0.0 ? 1e-8 : 0.0);
    EXPECT_EQ(report.merged_vertices, static_cast<int>(3 * sphere.triangles.size() - sphere.vertices.size()));
    EXPECT_EQ(report.removed_triangles, 0);
    EXPECT_TRUE(inspect(soup).closed_manifold());
    ASSERT_EQ(soup.vertices.size(), sphere.vertices.size());
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_LE((soup.vertices[soup.triangles[t][i]] - before.vertices[3 * t + i]).norm(), 1e-8);
      }
    }
  }
}

TEST(Weld, AgreesWithComparingAllPairs) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  for (const double tolerance : {0.0, 0.05, 0.3, 1.0}) {
    TriangleMesh mesh;
    for (int v = 0; v < 300; ++v) {
      mesh.vertices.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    }
    for (int v = 0; v < 30; ++v) mesh.vertices.push_back(mesh.vertices[7 * v]);
    mesh.triangles = random_triangles(330, 400, random);

    std::vector<int> keeper(330);
    std::vector<int> kept;
    for (int v = 0; v < 330; ++v) {
      const auto found = std::find_if(kept.begin(), kept.end(),
                                      [&](int k) { return (mesh.vertices[k] - mesh.vertices[v]).norm() <= tolerance; });
      keeper[v] = found == kept.end() ? v : *found;
      if (keeper[v] == v) kept.push_back(v);
    }
    std::vector<std::array<Vector3, 3>> expected;
    for (const Triangle& t : mesh.triangles) {
      const Triangle merged{keeper[t[0]], keeper[t[1]], keeper[t[2]]};
      if (merged[0] == merged[1] || merged[1] == merged[2] || merged[2] == merged[0]) continue;
      expected.push_back({mesh.vertices[merged[0]], mesh.vertices[merged[1]], mesh.vertices[merged[2]]});
    }
    const WeldReport report = weld(mesh, tolerance);
    EXPECT_EQ(report.merged_vertices, 330 - static_cast<int>(kept.size()));
    EXPECT_EQ(report.removed_triangles, 400 - static_cast<int>(expected.size()));
    ASSERT_EQ(mesh.triangles.size(), expected.size());
    for (std::size_t t = 0; t < expected.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(mesh.vertices[mesh.triangles[t][i]], expected[t][i]);
    }
  }
}

TEST(Weld, RemovesCollapsedTrianglesAndLooseVertices) {
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.emplace_back(1e-9, 0.0, 0.0);
  mesh.vertices.emplace_back(9.0, 9.0, 9.0);
  mesh.triangles.push_back({0, 4, 1});
  const WeldReport report = weld(mesh, 1e-8);
  EXPECT_EQ(report.merged_vertices, 1);
  EXPECT_EQ(report.removed_triangles, 1);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_TRUE(inspect(mesh).closed_manifold());
}

TEST(Weld, LeavesNonFiniteVerticesAlone) {
  const WithoutTraps off;  // a NaN is compared, 1e300 is squared
  TriangleMesh mesh = tetrahedron();
  mesh.vertices[0].x() = std::numeric_limits<double>::quiet_NaN();
  mesh.vertices[1].x() = 1e300;
  EXPECT_EQ(weld(mesh, 1e-8).merged_vertices, 0);
  EXPECT_EQ(mesh.triangles.size(), 4u);
}

TEST(OrientOutward, TurnsWhatFacesInward) {
  std::mt19937 random(9);
  TriangleMesh mesh = make_sphere(1.0, 16);
  const TriangleMesh far = make_sphere(0.5, 8);
  const int offset = static_cast<int>(mesh.vertices.size());
  for (const Vector3& p : far.vertices) mesh.vertices.push_back(p + Vector3(100, 0, 0));
  for (const Triangle& t : far.triangles) {
    mesh.triangles.push_back({t[0] + offset, t[2] + offset, t[1] + offset});
  }
  int turned = static_cast<int>(far.triangles.size());
  for (std::size_t t = 0; t < 480; ++t) {
    if (random() % 2 == 0) continue;
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
    ++turned;
  }
  const double volume = enclosed_volume(make_sphere(1.0, 16)) + enclosed_volume(far);
  EXPECT_EQ(orient_outward(mesh), turned);
  EXPECT_TRUE(inspect(mesh).closed_manifold());
  EXPECT_EQ(inspect(mesh).components, 2);
  EXPECT_NEAR(enclosed_volume(mesh), volume, 1e-12);
  EXPECT_EQ(orient_outward(mesh), 0);
}

TEST(CloseHoles, ClosesEachLoopOnce) {
  TriangleMesh mesh = make_sphere(1.0, 16);
  mesh.triangles.erase(mesh.triangles.end() - 16, mesh.triangles.end());  // the south cap
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  weld(mesh, 0.0);
  EXPECT_EQ(inspect(mesh).boundary_edges, 19);
  EXPECT_EQ(close_holes(mesh), 2);
  EXPECT_TRUE(inspect(mesh).closed_manifold());
  EXPECT_EQ(close_holes(mesh), 0);
}

TEST(CloseHoles, LeavesLoopsThatMeetInAVertex) {
  TriangleMesh mesh = make_sphere(1.0, 8);
  mesh.triangles.erase(mesh.triangles.begin() + 4);  // two of the fan at the pole, apart from each other
  mesh.triangles.erase(mesh.triangles.begin());
  EXPECT_EQ(close_holes(mesh), 0);
  EXPECT_EQ(inspect(mesh).boundary_edges, 6);
}

TEST(Volume, OfAnyPlaceAndScale) {
  TriangleMesh mesh = tetrahedron();
  EXPECT_NEAR(enclosed_volume(mesh), 1.0 / 6.0, 1e-15);
  for (Vector3& p : mesh.vertices) p += Vector3(1e5, -1e5, 1e5);
  EXPECT_NEAR(enclosed_volume(mesh), 1.0 / 6.0, 1e-9);
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_LT(enclosed_volume(mesh), 0.0);
  EXPECT_EQ(enclosed_volume({}), 0.0);
}

TEST(MeanEdgeLength, OfATriangle) {
  EXPECT_DOUBLE_EQ(mean_edge_length({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}, {{0, 1}, {0, 2}, {1, 2}}), 4.0);
  EXPECT_EQ(mean_edge_length({}, {}), 0.0);
}

TEST(TriangleMesh, AMillionTrianglesTakeSeconds) {
  std::mt19937 random(1);
  TriangleMesh soup = soup_of(make_sphere(0.05, 708), 0.0, random);
  ASSERT_GT(soup.triangles.size(), 1000000u);
  weld(soup, 1e-8);
  EXPECT_EQ(orient_outward(soup), 0);
  EXPECT_TRUE(inspect(soup).closed_manifold());
}

}  // namespace
}  // namespace tissue_sim::triangle_mesh_test
