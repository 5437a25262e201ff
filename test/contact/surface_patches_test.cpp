#include "tissue_sim/contact/surface_patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "floating_point_traps.h"
#include "geometry/twins.h"

namespace tissue_sim::surface_patches_test {
namespace {

struct PatchedOrgan {
  TriangleMesh mesh;
  MeshTopology topology;
  std::vector<int> roots = {0};
  SurfacePatches patches;

  explicit PatchedOrgan(const TriangleMesh& surface_mesh)
      : mesh(surface_mesh),
        topology(build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles)),
        patches(build_patches(mesh.vertices, mesh.triangles, topology)) {}
  OrganSurface surface() { return {mesh.vertices, mesh.triangles, topology, roots, patches}; }
  int count() const { return static_cast<int>(patches.leaf_of.size()); }
};

Box box_of_patch(const PatchedOrgan& organ, int patch) {
  Box box;
  for (const int* t = organ.patches.triangles.begin(patch); t != organ.patches.triangles.end(patch); ++t) {
    for (const int v : organ.mesh.triangles[*t]) box.add(organ.mesh.vertices[v]);
  }
  return box;
}

std::set<int> near(PatchedOrgan& organ, const Box& box) {
  std::set<int> found;
  for_each_patch_near(organ.surface(), box, [&](int patch) { EXPECT_TRUE(found.insert(patch).second); });
  return found;
}

std::set<int> near_by_brute_force(const PatchedOrgan& organ, const Box& box) {
  std::set<int> found;
  for (int patch = 0; patch < organ.count(); ++patch) {
    if (box_of_patch(organ, patch).overlaps(box)) found.insert(patch);
  }
  return found;
}

ClosestOnMesh closest_by_brute_force(const PatchedOrgan& organ, const Vector3& p, double reach) {
  ClosestSearch search(organ.mesh.vertices, organ.mesh.triangles, p, reach);
  for (int t = 0; t < static_cast<int>(organ.mesh.triangles.size()); ++t) search.look_at(t);
  return search.best;
}

int count_fitted(const PatchedOrgan& organ) {
  int fitted = 0;
  for (const int leaf : organ.patches.leaf_of) {
    fitted += organ.patches.nodes[leaf].fitted_at == organ.patches.travel ? 1 : 0;
  }
  return fitted;
}

TEST(SurfacePatches, EveryTriangleAndEdgeIsInOnePatchAndEveryVertexWithItsTriangles) {
  const PatchedOrgan organ(make_octasphere(0.03, 3));
  std::multiset<int> triangles(organ.patches.triangles.items.begin(), organ.patches.triangles.items.end());
  std::multiset<int> edges(organ.patches.edges.items.begin(), organ.patches.edges.items.end());
  ASSERT_EQ(triangles.size(), organ.mesh.triangles.size());
  ASSERT_EQ(edges.size(), organ.topology.edges.size());
  for (int t = 0; t < static_cast<int>(organ.mesh.triangles.size()); ++t) EXPECT_EQ(triangles.count(t), 1u);
  for (int e = 0; e < static_cast<int>(organ.topology.edges.size()); ++e) EXPECT_EQ(edges.count(e), 1u);
  for (int patch = 0; patch < organ.count(); ++patch) {
    std::set<int> corners;
    for (const int* t = organ.patches.triangles.begin(patch); t != organ.patches.triangles.end(patch); ++t) {
      corners.insert(organ.mesh.triangles[*t].begin(), organ.mesh.triangles[*t].end());
    }
    EXPECT_TRUE(std::equal(corners.begin(), corners.end(), organ.patches.vertices.begin(patch),
                           organ.patches.vertices.end(patch)));
    for (const int* e = organ.patches.edges.begin(patch); e != organ.patches.edges.end(patch); ++e) {
      for (const int v : organ.topology.edges[*e]) EXPECT_EQ(corners.count(v), 1u);
    }
  }
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
    const int patch = organ.patches.patch_of[v];
    EXPECT_TRUE(std::binary_search(organ.patches.vertices.begin(patch), organ.patches.vertices.end(patch), v));
  }
}

/// Vertices that move for a while without anybody looking, by steps of any length, now and then all at once.
TEST(SurfacePatches, FindWhatBruteForceFindsWhereverTheVerticesHaveGone) {
  Random random(1);
  for (int organ_number = 0; organ_number < 10; ++organ_number) {
    PatchedOrgan organ(make_octasphere(0.03, 3));
    std::size_t found = 0;
    int gathered = 0;
    for (int round = 0; round < 200; ++round) {
      if (round % 50 == 49) {
        for (Vector3& v : organ.mesh.vertices) v += Vector3(0.02, 0.0, -0.01);
        forget(organ.patches);
      }
      const double way = random_in(random, 0.0, 0.002);
      for (Vector3& v : organ.mesh.vertices) v += random_in(random, 0.0, way) * random_direction(random);
      organ.patches.travel += way;
      if (round % 3 == 1) continue;
      const Vector3 place = organ.mesh.vertices[static_cast<std::size_t>(round) % organ.mesh.vertices.size()];
      const Box box = Box{place, place}.grown(random_in(random, 0.0, 0.01));
      const std::set<int> near_patches = near(organ, box);
      EXPECT_EQ(near_patches, near_by_brute_force(organ, box));
      found += near_patches.size();
      for (const Vector3& v : organ.mesh.vertices) EXPECT_TRUE(bounds_of(organ.patches).contains(v));

      const Vector3 p = place + random_point(random, 0.02);
      const double reach = round % 2 == 0 ? 0.01 : 1.0;
      const ClosestOnMesh plain = closest_by_brute_force(organ, p, reach);
      for (const int guess : {-1, round}) {
        const ClosestOnMesh closest = closest_on_organ(organ.surface(), p, reach, guess);
        ASSERT_EQ(closest.triangle, plain.triangle);
        if (plain.triangle < 0) continue;
        EXPECT_EQ(closest.squared_distance, plain.squared_distance);
        EXPECT_EQ(closest.on.point, plain.on.point);
      }

      const TurnedBox around(Box{-Vector3::Ones(), Vector3::Ones()}.grown(0.02 - 1.0),
                             {place, random_pose(random, 1.0).orientation});
      gather_near(organ.surface(), around);
      const ClosestOnMesh closest = closest_on_organ(organ.surface(), p, reach, plain.triangle);
      ASSERT_EQ(closest.triangle, plain.triangle);
      if (plain.triangle >= 0) {
        EXPECT_EQ(closest.on.point, plain.on.point);
        gathered += around.contains(p, std::sqrt(plain.squared_distance)) ? 1 : 0;
      }
    }
    EXPECT_GT(found, 200u);
    EXPECT_GT(gathered, 20) << "searches among what was gathered";
  }
}

TEST(SurfacePatches, WhatIsFarIsNotFitted) {
  PatchedOrgan organ(make_octasphere(0.1, 5));
  const Box everywhere = {Vector3::Constant(-1.0), Vector3::Constant(1.0)};
  EXPECT_EQ(static_cast<int>(near(organ, everywhere).size()), organ.count());
  const Box at_the_pole = Box{Vector3(0.0, 0.0, 0.1), Vector3(0.0, 0.0, 0.1)}.grown(0.005);
  for (int round = 0; round < 20; ++round) {
    organ.patches.travel += 0.0002;
    near(organ, at_the_pole);
    EXPECT_LT(count_fitted(organ), 40) << organ.count() << " in all";
    EXPECT_GT(count_fitted(organ), 0);
  }
}

/// An organ whose vertices are where somebody says, once asked.
struct Carried {
  PatchedOrgan organ;
  std::vector<Vector3> true_places;
  int asked = 0;

  explicit Carried(const TriangleMesh& mesh) : organ(mesh), true_places(mesh.vertices) {}
  static void place(void* carrier, const int* first, const int* last) {
    Carried& carried = *static_cast<Carried*>(carrier);
    for (const int* v = first; v != last; ++v) carried.organ.mesh.vertices[*v] = carried.true_places[*v];
    ++carried.asked;
  }
  OrganSurface surface() {
    OrganSurface surface = organ.surface();
    surface.placement = {place, this};
    return surface;
  }
};

TEST(SurfacePatches, CarriedVerticesArePlacedBeforeAnybodyLooksAtThemAndOnce) {
  Random random(2);
  Carried carried(make_octasphere(0.03, 4));
  PatchedOrgan placed(carried.organ.mesh);
  for (int round = 0; round < 100; ++round) {
    const Vector3 shift = 0.001 * random_direction(random);
    for (Vector3& v : carried.true_places) v += shift;
    placed.mesh.vertices = carried.true_places;
    carried.organ.patches.travel += 0.001;
    placed.patches.travel += 0.001;

    const Vector3 place = carried.true_places[static_cast<std::size_t>(round)];
    const Box box = Box{place, place}.grown(0.003);
    std::set<int> found;
    const auto look = [&]() {
      found.clear();
      for_each_patch_near(carried.surface(), box, [&](int patch) { found.insert(patch); });
    };
    look();
    EXPECT_EQ(found, near_by_brute_force(placed, box));
    for (const int patch : found) {
      for (const int* v = placed.patches.vertices.begin(patch); v != placed.patches.vertices.end(patch); ++v) {
        EXPECT_EQ(carried.organ.mesh.vertices[*v], carried.true_places[*v]);
      }
    }
    const int asked = carried.asked;
    look();
    EXPECT_EQ(carried.asked, asked) << "nothing has moved since";

    const Vector3 p = place + random_point(random, 0.01);
    const ClosestOnMesh closest = closest_on_organ(carried.surface(), p, 1.0, round);
    EXPECT_EQ(closest.triangle, closest_by_brute_force(placed, p, 1.0).triangle);
    place_vertex(carried.surface(), 100 + round);
    EXPECT_EQ(carried.organ.mesh.vertices[100 + round], carried.true_places[100 + round]);
    place_around(carried.surface(), 300 + round);
    for (const int corner : carried.organ.mesh.triangles[300 + round]) {
      const FlatLists& edges = carried.organ.topology.vertex_edges;
      for (const int* e = edges.begin(corner); e != edges.end(corner); ++e) {
        for (const int v : carried.organ.topology.edges[*e]) {
          EXPECT_EQ(carried.organ.mesh.vertices[v], carried.true_places[v]);
        }
      }
    }
  }
  EXPECT_LT(carried.asked, 100 * 30) << "of 128 patches each time";
}

TEST(SurfacePatches, SayWhereTheEndsOfTheirEdgesAre) {
  const PatchedOrgan organ(make_octasphere(0.03, 4));
  const SurfacePatches& patches = organ.patches;
  ASSERT_EQ(patches.ends.size(), organ.topology.edges.size());
  for (int patch = 0; patch < organ.count(); ++patch) {
    const int* vertices = patches.edge_vertices.begin(patch);
    std::set<int> used;
    for (const int* e = patches.edges.begin(patch); e != patches.edges.end(patch); ++e) {
      for (std::size_t i = 0; i < 2; ++i) {
        const int end = patches.ends[static_cast<std::size_t>(e - patches.edges.items.data())][i];
        EXPECT_EQ(vertices[end], organ.topology.edges[*e][i]);
        used.insert(end);
      }
    }
    EXPECT_EQ(used.size(), static_cast<std::size_t>(patches.edge_vertices.end(patch) - vertices)) << "no others";
  }
}

TEST(SurfacePatches, AVertexThatIsNoNumberHidesNoOther) {
  const WithoutTraps off;  // a NaN is compared
  Random random(3);
  PatchedOrgan organ(make_octasphere(0.03, 3));
  const PatchedOrgan whole(organ.mesh);
  organ.mesh.vertices[17].setConstant(std::nan(""));
  const int patch = organ.patches.patch_of[17];
  const std::set<int> expected = near_by_brute_force(whole, Box{Vector3::Constant(-1.0), Vector3::Constant(1.0)});
  EXPECT_EQ(near(organ, Box{Vector3::Constant(-1.0), Vector3::Constant(1.0)}), expected);
  organ.patches.travel = std::nan("");
  forget(organ.patches);
  EXPECT_EQ(near(organ, Box{Vector3::Constant(-1.0), Vector3::Constant(1.0)}).count(patch), 1u);
}

}  // namespace
}  // namespace tissue_sim::surface_patches_test
