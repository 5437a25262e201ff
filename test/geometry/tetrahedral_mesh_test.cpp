#include "tissue_sim/geometry/tetrahedral_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "floating_point_traps.h"
#include "twins.h"

namespace tissue_sim::tetrahedral_mesh_test {
namespace {

const TetrahedralMesh one = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};

/// Two that share the face (1, 2, 3).
TetrahedralMesh two() {
  TetrahedralMesh mesh = one;
  mesh.vertices.emplace_back(1, 1, 1);
  mesh.tetrahedra.push_back({1, 2, 3, 4});
  return mesh;
}

/// Vertices and tetrahedra in any order, corners turned in any way that keeps the volume positive.
TetrahedralMesh shuffled(TetrahedralMesh mesh, Random& random) {
  std::vector<int> renamed(mesh.vertices.size());
  for (std::size_t i = 0; i < renamed.size(); ++i) renamed[i] = static_cast<int>(i);
  std::shuffle(renamed.begin(), renamed.end(), random);
  TetrahedralMesh result = mesh;
  for (std::size_t i = 0; i < renamed.size(); ++i) result.vertices[renamed[i]] = mesh.vertices[i];
  for (Tetrahedron& t : result.tetrahedra) {
    for (int& v : t) v = renamed[v];
    std::shuffle(t.begin(), t.end(), random);
    if (tetrahedron_volume(result, t) < 0.0) std::swap(t[0], t[1]);
  }
  std::shuffle(result.tetrahedra.begin(), result.tetrahedra.end(), random);
  return result;
}

/// A block with the cells of one corner column taken out, so that its surface is not convex.
TetrahedralMesh notched_block() {
  TetrahedralMesh mesh = make_block({0.03, 0.04, 0.05}, {4, 3, 5});
  const auto out = std::remove_if(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), [&](const Tetrahedron& t) {
    Vector3 middle = Vector3::Zero();
    for (const int v : t) middle += 0.25 * mesh.vertices[v];
    return middle.x() > 0.0 && middle.y() > 0.04 / 6.0 && middle.z() > -0.02;
  });
  mesh.tetrahedra.erase(out, mesh.tetrahedra.end());
  drop_unreferenced(mesh);
  return mesh;
}

TEST(Tetrahedron, VolumeAndOutwardFaces) {
  EXPECT_DOUBLE_EQ(tetrahedron_volume(one, one.tetrahedra[0]), 1.0 / 6.0);
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const auto& [a, b, c] = outward_faces[corner];
    const Vector3 normal = area_normal(one.vertices[a], one.vertices[b], one.vertices[c]);
    EXPECT_LT(normal.dot(one.vertices[corner] - one.vertices[a]), 0.0) << "the corner lies behind its face";
  }
}

TEST(Tetrahedron, IsFlatBelowATrillionthOfItsEdgeCubed) {
  const auto flat = [](double height) { return is_flat({0, 0, 0}, {1e-3, 0, 0}, {0, 1e-3, 0}, {0, 0, height}); };
  EXPECT_FALSE(flat(1e-3));
  EXPECT_FALSE(flat(20e-15));  // volume 3.3e-21, longest edge 1.41e-3: at 2.8e-21 it is flat
  EXPECT_TRUE(flat(10e-15));
  EXPECT_TRUE(flat(0.0));
  const WithoutTraps off;  // a NaN is compared
  EXPECT_TRUE(flat(std::numeric_limits<double>::quiet_NaN()));
}

TEST(InspectTetrahedra, FindsNothingWrongWithABlock) {
  EXPECT_TRUE(inspect(make_block({1, 2, 3}, {2, 3, 4})).sound());
  EXPECT_TRUE(inspect(notched_block()).sound());
  EXPECT_TRUE(inspect(two()).sound());
  EXPECT_FALSE(inspect(TetrahedralMesh{}).sound());
}

TEST(InspectTetrahedra, CountsEachFault) {
  TetrahedralMesh mesh = two();
  mesh.tetrahedra.push_back({0, 1, 2, 5});
  mesh.tetrahedra.push_back({-1, 1, 2, 3});
  EXPECT_EQ(inspect(mesh).bad_indices, 2);
  EXPECT_FALSE(inspect(mesh).sound());

  mesh = two();
  mesh.vertices[4].y() = std::numeric_limits<double>::infinity();
  {
    const WithoutTraps off;  // an infinity less itself tells that it is one
    EXPECT_EQ(inspect(mesh).non_finite_vertices, 1);
  }

  mesh = two();
  mesh.tetrahedra.push_back({0, 1, 2, 0});
  EXPECT_EQ(inspect(mesh).repeated_corners, 1);
  EXPECT_EQ(inspect(mesh).flat, 0);

  mesh = two();
  mesh.vertices[4] = {1.0 / 3, 1.0 / 3, 1.0 / 3};
  EXPECT_EQ(inspect(mesh).flat, 1);

  mesh = two();
  std::swap(mesh.tetrahedra[1][0], mesh.tetrahedra[1][1]);
  TetrahedralFaults faults = inspect(mesh);
  EXPECT_EQ(faults.inverted, 1);
  EXPECT_EQ(faults.overlapping_faces, 0) << "inverted, but on its own side of the face";

  mesh = two();
  mesh.tetrahedra.push_back(
      {1, 3, 4, 2});  // tetrahedron 1 once more: its free faces are doubled, the shared one crowded
  faults = inspect(mesh);
  EXPECT_EQ(faults.duplicates, 1);
  EXPECT_EQ(faults.overlapping_faces, 3);
  EXPECT_EQ(faults.crowded_faces, 1);

  mesh = one;
  mesh.vertices.emplace_back(0.1, 0.1, 2.0);  // above the face (0, 1, 2) as vertex 3 is
  mesh.tetrahedra.push_back({0, 1, 2, 4});
  EXPECT_EQ(inspect(mesh).overlapping_faces, 1);
  EXPECT_EQ(inspect(mesh).duplicates, 0);

  mesh = two();
  mesh.vertices.emplace_back(9, 9, 9);
  EXPECT_EQ(inspect(mesh).unreferenced_vertices, 1);
}

TEST(InspectTetrahedra, TellsTouchingFromJoined) {
  TetrahedralMesh apart = one;
  for (const Vector3& p : one.vertices) apart.vertices.push_back(p + Vector3(3, 0, 0));
  apart.tetrahedra.push_back({4, 5, 6, 7});
  TetrahedralFaults faults = inspect(apart);
  EXPECT_EQ(faults.components, 2);
  EXPECT_TRUE(faults.sound());

  TetrahedralMesh at_a_vertex = one;
  for (const Vector3& p : one.vertices) at_a_vertex.vertices.push_back(-p);
  at_a_vertex.tetrahedra.push_back({0, 5, 7, 6});
  at_a_vertex.vertices.erase(at_a_vertex.vertices.begin() + 4);
  at_a_vertex.tetrahedra[1] = {0, 4, 6, 5};
  faults = inspect(at_a_vertex);
  EXPECT_EQ(faults.components, 1);
  EXPECT_EQ(faults.non_manifold_surface_vertices, 1);
  EXPECT_EQ(faults.non_manifold_surface_edges, 0);
  EXPECT_FALSE(faults.sound());

  TetrahedralMesh at_an_edge = one;  // along z
  at_an_edge.vertices.emplace_back(-1, 0, 0);
  at_an_edge.vertices.emplace_back(0, -1, 0);
  at_an_edge.tetrahedra.push_back({0, 4, 5, 3});
  faults = inspect(at_an_edge);
  EXPECT_EQ(faults.non_manifold_surface_edges, 1);
  EXPECT_EQ(faults.inverted, 0);
}

TEST(OrientTetrahedra, MendsWhatIsInverted) {
  Random random(3);
  TetrahedralMesh mesh = make_block({1, 1, 1}, {3, 3, 3});
  int inverted = 0;
  for (Tetrahedron& t : mesh.tetrahedra) {
    if (random() % 3 != 0) continue;
    std::swap(t[0], t[3]);
    ++inverted;
  }
  ASSERT_GT(inverted, 0);
  EXPECT_EQ(inspect(mesh).inverted, inverted);
  EXPECT_EQ(orient(mesh), inverted);
  EXPECT_TRUE(inspect(mesh).sound());
  EXPECT_EQ(orient(mesh), 0);
}

TEST(TakeSurface, IsClosedOutwardAndEnclosesTheSolid) {
  Random random(7);
  for (int round = 0; round < 5; ++round) {
    TetrahedralMesh mesh = shuffled(notched_block(), random);
    const TriangleMesh surface = take_surface(mesh);
    EXPECT_TRUE(inspect(mesh).sound());
    EXPECT_TRUE(inspect(surface).closed_manifold());
    EXPECT_NEAR(enclosed_volume(surface), solid_volume(mesh), 1e-15);
    ASSERT_LT(surface.vertices.size(), mesh.vertices.size());
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) EXPECT_EQ(surface.vertices[v], mesh.vertices[v]);
  }
}

TEST(TakeSurface, FindsTheFacesThatAMapFinds) {
  Random random(11);
  TetrahedralMesh mesh = shuffled(notched_block(), random);
  const TriangleMesh surface = take_surface(mesh);
  std::map<std::set<int>, int> tetrahedra_at;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    for (std::size_t i = 0; i < 4; ++i) ++tetrahedra_at[{t[i], t[(i + 1) % 4], t[(i + 2) % 4]}];
  }
  std::set<std::set<int>> expected, found;
  for (const auto& [face, count] : tetrahedra_at) {
    if (count == 1) expected.insert(face);
  }
  for (const Triangle& t : surface.triangles) found.insert({t[0], t[1], t[2]});
  EXPECT_EQ(found, expected);
  EXPECT_EQ(found.size(), surface.triangles.size());
}

TEST(TakeSurface, KeepsTheOldOrderOfOuterAndOfInnerVertices) {
  Random random(13);
  const TetrahedralMesh old = shuffled(make_block({1, 1, 1}, {4, 4, 4}), random);
  TetrahedralMesh mesh = old;
  const TriangleMesh surface = take_surface(mesh);
  EXPECT_EQ(surface.vertices.size(), 125u - 27u);
  const auto old_index = [&](const Vector3& p) {
    return std::find(old.vertices.begin(), old.vertices.end(), p) - old.vertices.begin();
  };
  for (std::size_t v = 1; v < mesh.vertices.size(); ++v) {
    if (v == surface.vertices.size()) continue;
    EXPECT_LT(old_index(mesh.vertices[v - 1]), old_index(mesh.vertices[v]));
  }
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(mesh.vertices[mesh.tetrahedra[t][i]], old.vertices[old.tetrahedra[t][i]]);
    }
  }
}

TEST(DropUnreferenced, KeepsTheOthersInOrder) {
  TetrahedralMesh mesh = one;
  mesh.vertices.insert(mesh.vertices.begin() + 1, Vector3(5, 5, 5));
  mesh.vertices.emplace_back(6, 6, 6);
  mesh.tetrahedra = {{0, 2, 3, 4}};
  EXPECT_EQ(drop_unreferenced(mesh), 2);
  EXPECT_EQ(mesh.vertices, one.vertices);
  EXPECT_EQ(mesh.tetrahedra, one.tetrahedra);
  EXPECT_EQ(drop_unreferenced(mesh), 0);
}

/// Mean distance between the centroids of tetrahedra that follow each other.
double mean_stride(const TetrahedralMesh& mesh) {
  const auto centroid = [&](const Tetrahedron& t) -> Vector3 {
    return 0.25 * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]] + mesh.vertices[t[3]]);
  };
  double sum = 0.0;
  for (std::size_t t = 1; t < mesh.tetrahedra.size(); ++t) {
    sum += (centroid(mesh.tetrahedra[t]) - centroid(mesh.tetrahedra[t - 1])).norm();
  }
  return sum / static_cast<double>(mesh.tetrahedra.size() - 1);
}

TEST(SortForLocality, BringsNeighboursTogetherWhateverTheOrderBefore) {
  Random random(17);
  const TetrahedralMesh mixed = shuffled(make_block({1, 1, 1}, {8, 8, 8}), random);
  TetrahedralMesh sorted = mixed;
  sort_for_locality(sorted);
  EXPECT_EQ(sorted.vertices, mixed.vertices);
  EXPECT_LT(mean_stride(sorted), 0.2 * mean_stride(mixed));
  const auto as_set = [](const TetrahedralMesh& mesh) {
    return std::multiset<Tetrahedron>(mesh.tetrahedra.begin(), mesh.tetrahedra.end());
  };
  EXPECT_EQ(as_set(sorted), as_set(mixed));
  TetrahedralMesh again = sorted;
  sort_for_locality(again);
  EXPECT_EQ(again.tetrahedra, sorted.tetrahedra);
}

TEST(SortForLocality, FollowsTheMortonCurveOfTheVertices) {
  // Eight corners of a cube: the bits of their places along x, y, z, x first, are their numbers along the curve.
  TetrahedralMesh mesh = make_block({1, 1, 1}, {1, 1, 1});
  Random random(19);
  mesh = shuffled(mesh, random);
  const double volume = solid_volume(mesh);
  sort_vertices_for_locality(mesh);
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(mesh.vertices[i], Vector3((i >> 2) - 0.5, ((i >> 1) & 1) - 0.5, (i & 1) - 1.0)) << i;
  }
  EXPECT_TRUE(inspect(mesh).sound());
  EXPECT_DOUBLE_EQ(solid_volume(mesh), volume);
}

TEST(SortForLocality, ManagesOneTetrahedronAndNone) {
  TetrahedralMesh mesh = one;
  sort_for_locality(mesh);
  EXPECT_EQ(mesh.tetrahedra, one.tetrahedra);
  TetrahedralMesh none;
  sort_for_locality(none);
  sort_vertices_for_locality(none);
  EXPECT_TRUE(none.empty());
}

TEST(MakeBlock, FillsItsBoxWithEqualTetrahedra) {
  const Vector3 size(0.02, 0.03, 0.015);
  const TetrahedralMesh mesh = make_block(size, {4, 5, 3});
  EXPECT_EQ(mesh.vertices.size(), 5u * 6u * 4u);
  EXPECT_EQ(mesh.tetrahedra.size(), 6u * 4u * 5u * 3u);
  EXPECT_TRUE(inspect(mesh).sound());
  EXPECT_EQ(inspect(mesh).components, 1);
  EXPECT_NEAR(solid_volume(mesh), size.prod(), 1e-12 * size.prod());
  for (const Tetrahedron& t : mesh.tetrahedra) {
    EXPECT_NEAR(tetrahedron_volume(mesh, t), size.prod() / 360.0, 1e-12 * size.prod());
  }
  const Box box = bounds_of(mesh.vertices);
  EXPECT_EQ(box.lower, Vector3(-0.01, -0.015, -0.015));
  EXPECT_EQ(box.upper, Vector3(0.01, 0.015, 0.0));
  TetrahedralMesh copy = mesh;
  EXPECT_EQ(take_surface(copy).triangles.size(), 2u * 2u * (4u * 5u + 5u * 3u + 3u * 4u));
  EXPECT_TRUE(mesh.vertices[1 + 5 * (2 + 6 * 3)].isApprox(Vector3(-0.005, -0.003, 0.0), 1e-12));
}

TEST(MakeBlock, TakesUnevenPlanes) {
  const TetrahedralMesh mesh = make_block({{{-1, 0, 3}, {0, 0.5}, {-4, -1, -0.5, 2}}});
  EXPECT_EQ(mesh.vertices.size(), 24u);
  EXPECT_EQ(mesh.tetrahedra.size(), 36u);
  EXPECT_TRUE(inspect(mesh).sound());
  EXPECT_NEAR(solid_volume(mesh), 4.0 * 0.5 * 6.0, 1e-12);
  EXPECT_EQ(mesh.vertices.front(), Vector3(-1, 0, -4));
  EXPECT_EQ(mesh.vertices.back(), Vector3(3, 0.5, 2));
}

TEST(SolidVolume, CountsInvertedAsNegative) {
  TetrahedralMesh mesh = two();
  EXPECT_DOUBLE_EQ(solid_volume(mesh), 1.0 / 6.0 + 1.0 / 3.0);
  std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  EXPECT_DOUBLE_EQ(solid_volume(mesh), -1.0 / 6.0 + 1.0 / 3.0);
}

}  // namespace
}  // namespace tissue_sim::tetrahedral_mesh_test
