#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "scene/obj_text.h"
#include "simulation/test_scenes.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::extreme_meshes_test {
namespace {

constexpr double radius = 0.03;  // m

/// What a press came to.
struct Press {
  std::string refusal;  ///< of the load or of the scene; empty: it was simulated
  std::uint64_t recoveries = 0;
  std::uint64_t contacts = 0;
  double farthest = 0.0;  ///< m, of any vertex from its rest place, at any time
  double left = 0.0;      ///< m, the same at the end
};

/// A ball presses 3 mm into the top of the organ in 100 steps of a millisecond, leaves, and the organ has 400 more.
Press press(Organ organ, Integrator integrator) {
  Press result;
  organ.integrator = integrator;
  double top = -1.0;
  for (const Vector3& p : organ.mesh.vertices) top = std::max(top, p.z());
  const std::vector<Vector3> rest = organ.mesh.vertices;
  try {
    Timeline timeline(scene_of(std::move(organ), {ball(0.008)}));
    const auto way = [&] {
      double farthest = 0.0;
      const OrganView view = timeline.organ(0);
      for (std::size_t v = 0; v < rest.size(); ++v) {
        EXPECT_TRUE(view.positions[v].allFinite());
        farthest = std::max(farthest, (view.positions[v] - rest[v]).norm());
      }
      return farthest;
    };
    for (int i = 0; i <= 600; ++i) {
      const double depth = i <= 100 ? 0.004 * i / 100 - 0.001 : i <= 200 ? 0.004 * (200 - i) / 100 - 0.001 : -0.05;
      timeline.add_pose(0, {1'000'000'000 + i * 1'000'000LL, {{0.0, 0.0, top + 0.008 - depth}, {1, 0, 0, 0}}});
      while (timeline.step()) {
        result.contacts += timeline.report().contacts.size();
        if (i % 10 == 0) result.farthest = std::max(result.farthest, way());
      }
    }
    result.left = way();
    result.recoveries = timeline.counters().recoveries;
  } catch (const SceneError& error) {
    result.refusal = error.what();
  }
  return result;
}

/// Stable: felt, never thrown back by the health check, never farther than a press can push it.
void expect_stable(const Press& press) {
  EXPECT_EQ(press.refusal, "");
  EXPECT_GT(press.contacts, 0U);
  EXPECT_EQ(press.recoveries, 0U);
  EXPECT_LT(press.farthest, radius);
  EXPECT_LT(press.left, 0.004);
}

/// The mesh through a file, as a wall, held below.
Organ wall_of(const TriangleMesh& mesh, std::vector<std::string>& warnings) {
  const TemporaryFolder folder;
  Organ organ = wall_sphere(4);
  organ.attached.clear();
  organ.mesh = load_organ_mesh(folder.write("organ.obj", obj_of(mesh, 17)), 1.0, warnings);
  double bottom = 1.0;
  for (const Vector3& p : organ.mesh.vertices) bottom = std::min(bottom, p.z());
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    if (organ.mesh.vertices[v].z() < bottom + 0.3 * radius) organ.attached.push_back(static_cast<int>(v));
  }
  return organ;
}

/// As a wall, explicitly and by descent: stable or, explicitly, refused for the time step.
void expect_stable_wall(const TriangleMesh& mesh) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    SCOPED_TRACE(to_string(integrator));
    std::vector<std::string> warnings;
    const Press result = press(wall_of(mesh, warnings), integrator);
    if (!result.refusal.empty()) {
      EXPECT_EQ(integrator, Integrator::explicit_substeps);
      EXPECT_NE(result.refusal.find("time_step: "), std::string::npos) << result.refusal;
      continue;
    }
    expect_stable(result);
  }
}

/// Splits an edge of the mesh's first triangle at `part` of its length: two slivers or needles beside each other.
TriangleMesh with_slivers(int slices, double part) {
  TriangleMesh mesh = make_sphere(radius, slices);
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  const int all = static_cast<int>(topology.edges.size());
  std::vector<char> split(mesh.triangles.size(), 0);
  for (int e = 0; e < all; e += 7) {
    const auto [one, other] = topology.edge_triangles[e];
    if (split[one] || split[other]) continue;
    split[one] = split[other] = 1;
    const int a = topology.edges[e][0], b = topology.edges[e][1];
    const int middle = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(mesh.vertices[a] + part * (mesh.vertices[b] - mesh.vertices[a]));
    for (const int t : {one, other}) {
      Triangle first = mesh.triangles[t], second = first;
      for (int& corner : first) corner = corner == a ? middle : corner;
      for (int& corner : second) corner = corner == b ? middle : corner;
      mesh.triangles[t] = first;
      mesh.triangles.push_back(second);
    }
  }
  return mesh;
}

TEST(ExtremeMeshes, SliversAndNeedles) {
  for (const double part : {0.5, 1e-2, 1e-3, 1e-5}) {
    SCOPED_TRACE(part);
    expect_stable_wall(with_slivers(8, part));
  }
}

TEST(ExtremeMeshes, VerticesOnTopOfEachOtherAreOneAndNeedlesCollapse) {
  std::vector<std::string> warnings;
  const Organ organ = wall_of(with_slivers(8, 1e-8), warnings);
  EXPECT_EQ(organ.mesh.vertices.size(), make_sphere(radius, 8).vertices.size());
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("dropped"), std::string::npos) << warnings[0];
}

/// Faces of a box, n x n squares a face, all exactly flat: V0 of their flaps is 0.
TriangleMesh box_of_squares(int n) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const int first = static_cast<int>(mesh.vertices.size());
          for (const auto& [u, v] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
            Vector3 p;
            p[axis] = side * 0.7 * radius;
            p[(axis + 1) % 3] = (2.0 * (i + u) / n - 1.0) * 0.7 * radius;
            p[(axis + 2) % 3] = (2.0 * (j + v) / n - 1.0) * 0.7 * radius;
            mesh.vertices.push_back(p);
          }
          mesh.triangles.push_back({first, first + 1, first + 2});
          mesh.triangles.push_back({first, first + 2, first + 3});
        }
      }
    }
  }
  return mesh;  // turned outward and welded when it is loaded
}

TEST(ExtremeMeshes, FlatPatches) {
  expect_stable_wall(box_of_squares(6));
}

TEST(ExtremeMeshes, TwelveTriangles) {
  const TriangleMesh box = box_of_squares(1);
  EXPECT_EQ(box.triangles.size(), 12U);
  expect_stable_wall(box);
}

TEST(ExtremeMeshes, DoubledAndUnreferencedVerticesAndTriangles) {
  TriangleMesh mesh = make_sphere(radius, 8);
  const std::size_t vertices = mesh.vertices.size(), triangles = mesh.triangles.size();
  for (std::size_t t = 0; t < triangles; ++t) {  // every corner a vertex of its own, some triangles twice
    for (int& corner : mesh.triangles[t]) {
      mesh.vertices.push_back(mesh.vertices[static_cast<std::size_t>(corner)]);
      corner = static_cast<int>(mesh.vertices.size()) - 1;
    }
    if (t % 5 == 0) mesh.triangles.push_back(mesh.triangles[t]);
  }
  for (int i = 0; i < 50; ++i)
    mesh.vertices.emplace_back(1e6, i, 0.0);  // nobody names them, and they count for nothing
  std::vector<std::string> warnings;
  const Organ organ = wall_of(mesh, warnings);
  EXPECT_EQ(organ.mesh.vertices.size(), vertices);
  EXPECT_EQ(organ.mesh.triangles.size(), triangles);
  expect_stable_wall(mesh);
}

TEST(ExtremeMeshes, TwoComponents) {
  TriangleMesh mesh = make_sphere(radius, 8);
  const TriangleMesh second = make_sphere(0.3 * radius, 6);
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vector3& p : second.vertices) mesh.vertices.push_back(p + Vector3(2.0 * radius, 0.0, -0.7 * radius));
  for (const Triangle& t : second.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  expect_stable_wall(mesh);
}

/// A block of cubes, six tetrahedra each, and one tetrahedron of a `part` of its neighbours' volume: one inner vertex
/// moved nearly onto the opposite face.
std::string block_msh(double part) {
  constexpr int n = 3;
  std::vector<Vector3> points;
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i)
        points.emplace_back(Vector3(2.0 * i / n - 1.0, 2.0 * j / n - 1.0, 2.0 * k / n - 1.0) * radius);
    }
  }
  const auto at = [&](int i, int j, int k) { return i + (n + 1) * (j + (n + 1) * k); };
  std::vector<std::array<int, 4>> tetrahedra;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        for (const auto& way : {std::array<int, 3>{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}) {
          std::array<int, 3> cell = {i, j, k};
          std::array<int, 4> corners = {at(i, j, k), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++cell[static_cast<std::size_t>(way[step])];
            corners[step + 1] = at(cell[0], cell[1], cell[2]);
          }
          tetrahedra.push_back(corners);
        }
      }
    }
  }
  // Split the middle tetrahedron into four about a point that lies `part` of its height above one face.
  const std::array<int, 4> split = tetrahedra[tetrahedra.size() / 2];
  const Vector3 face = (points[split[0]] + points[split[1]] + points[split[2]]) / 3.0;
  points.push_back(face + part * (points[split[3]] - face));
  const int middle = static_cast<int>(points.size()) - 1;
  tetrahedra.erase(tetrahedra.begin() + static_cast<long>(tetrahedra.size() / 2));
  for (std::size_t corner = 0; corner < 4; ++corner) {
    std::array<int, 4> piece = split;
    piece[corner] = middle;
    tetrahedra.push_back(piece);
  }
  std::ostringstream text;
  text.precision(17);
  text << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" << points.size() << "\n";
  for (std::size_t p = 0; p < points.size(); ++p) text << p + 1 << " " << points[p].transpose() << "\n";
  text << "$EndNodes\n$Elements\n" << tetrahedra.size() << "\n";
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    text << t + 1 << " 4 0";
    for (const int corner : tetrahedra[t]) text << " " << corner + 1;
    text << "\n";
  }
  return text.str() + "$EndElements\n";
}

TEST(ExtremeMeshes, ATetrahedronOfAThousandthOfItsNeighboursVolume) {
  for (const double part : {0.25, 1e-3, 1e-6}) {
    for (const Model model : {Model::fem, Model::volume}) {
      for (const Integrator integrator : {Integrator::automatic, Integrator::vertex_block_descent}) {
        SCOPED_TRACE(std::to_string(part) + " " + to_string(model) + " " + to_string(integrator));
        const TemporaryFolder folder;
        std::vector<std::string> warnings;
        Organ organ = wall_sphere(4);
        organ.attached.clear();
        organ.model = model;
        organ.solid = read_tetrahedral_mesh(folder.write("block.msh", block_msh(part)), 1.0, warnings);
        organ.mesh = take_surface(organ.solid);
        for (std::size_t v = 0; v < organ.solid.vertices.size(); ++v) {
          if (organ.solid.vertices[v].z() < -0.99 * radius) organ.attached.push_back(static_cast<int>(v));
        }
        expect_stable(press(organ, integrator));
      }
    }
  }
}

/// Takes a minute and 2 GB: with TISSUE_SIM_LONG=1 only.
TEST(ExtremeMeshes, AMillionTriangles) {
  if (std::getenv("TISSUE_SIM_LONG") == nullptr) GTEST_SKIP() << "with TISSUE_SIM_LONG=1 only";
  std::vector<std::string> warnings;
  Organ organ = wall_of(make_sphere(radius, 708), warnings);
  EXPECT_GE(organ.mesh.triangles.size(), 1'000'000U);
  organ.model = Model::contact_only;
  const Press result = press(organ, Integrator::automatic);
  EXPECT_EQ(result.refusal, "");
  EXPECT_GT(result.contacts, 0U);
  EXPECT_LT(result.farthest, radius);
  organ.model = Model::surface;
  const Press as_wall = press(std::move(organ), Integrator::explicit_substeps);
  if (as_wall.refusal.empty()) return expect_stable(as_wall);
  EXPECT_NE(as_wall.refusal.find("time_step: "), std::string::npos) << as_wall.refusal;
}

}  // namespace
}  // namespace tissue_sim::extreme_meshes_test
