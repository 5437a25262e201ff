#include "tissue_sim/geometry/wide_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <set>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "tissue_sim/geometry/edge_triangle.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::wide_tree_test {
namespace {

using Pair = std::pair<int, int>;

std::vector<InstructionSet> all_sets() {
  std::vector<InstructionSet> all = {InstructionSet::baseline};
  for (const InstructionSet wider : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (available(wider)) all.push_back(wider);
  }
  return all;
}

/// Edges between random points near the mesh, in no order.
struct Edges {
  std::vector<Vector3> points;
  std::vector<Edge> edges;
  std::vector<FloatPoint> rounded;
  std::vector<int> all;

  void add(const Vector3& p, const Vector3& q) {
    const int first = static_cast<int>(points.size());
    for (const Vector3& v : {p, q}) {
      points.push_back(v);
      rounded.push_back(to_float(v));
    }
    all.push_back(static_cast<int>(edges.size()));
    edges.push_back({first, first + 1});
  }
};

std::set<Pair> crossings(const TriangleMesh& mesh, const Edges& edges) {
  std::set<Pair> found;
  for (std::size_t e = 0; e < edges.edges.size(); ++e) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [i, j, k] = mesh.triangles[t];
      const EdgeTriangleHit hit =
          hit_edge_triangle(edges.points[2 * e], edges.points[2 * e + 1],
                            {&mesh.vertices[i], &mesh.vertices[j], &mesh.vertices[k]}, mesh.triangles[t]);
      if (hit.direction != 0) found.insert({static_cast<int>(e), static_cast<int>(t)});
    }
  }
  return found;
}

std::vector<Pair> found_pairs(const WideTree& tree, const Edges& edges, InstructionSet set,
                              std::vector<Pair>* sure = nullptr) {
  WideTreeRoom room;
  std::vector<EdgeTrianglePair> pairs;
  find_crossing_pairs(
      tree, {edges.rounded.data(), edges.rounded.size(), edges.edges.data(), edges.all.data(), edges.all.size()}, room,
      pairs, set);
  std::vector<Pair> found;
  for (const EdgeTrianglePair& pair : pairs) {
    found.emplace_back(pair.edge, pair.triangle);
    if (sure && pair.within_rims) sure->push_back(found.back());
  }
  return found;
}

/// Of lines that surely run within the rims, whatever the registers, the plane alone tells where the edges go through.
std::size_t expect_same_by_plane(const TriangleMesh& mesh, const WideTree& tree, const Edges& edges) {
  std::vector<Pair> sure;
  found_pairs(tree, edges, InstructionSet::baseline, &sure);
  for (const auto& [e, t] : sure) {
    const auto& [i, j, k] = mesh.triangles[t];
    const Vector3& a = mesh.vertices[i];
    const Vector3& p = edges.points[2 * e];
    const Vector3& q = edges.points[2 * e + 1];
    const EdgeTriangleHit exact =
        hit_edge_triangle(p, q, {&a, &mesh.vertices[j], &mesh.vertices[k]}, mesh.triangles[t]);
    const EdgeTriangleHit by_plane = hit_plane(p, q, a, area_normal(a, mesh.vertices[j], mesh.vertices[k]));
    EXPECT_EQ(by_plane.direction, exact.direction);
    if (exact.direction == 0) continue;
    EXPECT_EQ(by_plane.t, exact.t);
  }
  for (const InstructionSet set : all_sets()) {
    std::vector<Pair> other;
    found_pairs(tree, edges, set, &other);
    EXPECT_EQ(other, sure);
  }
  return sure.size();
}

/// Returns of how many the lines surely run within the rims.
std::size_t expect_all_crossings(const TriangleMesh& mesh, const Edges& edges, std::size_t& crossed,
                                 std::size_t& looked_at) {
  const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
  const std::set<Pair> expected = crossings(mesh, edges);
  const std::vector<Pair> narrow = found_pairs(tree, edges, InstructionSet::baseline);
  const std::set<Pair> once(narrow.begin(), narrow.end());
  EXPECT_EQ(once.size(), narrow.size()) << "a pair twice";
  EXPECT_TRUE(std::includes(once.begin(), once.end(), expected.begin(), expected.end()));
  for (const InstructionSet set : all_sets()) EXPECT_EQ(found_pairs(tree, edges, set), narrow);
  crossed += expected.size();
  looked_at += narrow.size();
  return expect_same_by_plane(mesh, tree, edges);
}

TEST(WideTree, FindsEveryCrossingAndLittleElse) {
  Random random(1);
  std::size_t crossed = 0;
  std::size_t looked_at = 0;
  std::size_t sure = 0;
  const std::vector<TriangleMesh> meshes = {make_octasphere(0.02, 4), make_torus(0.015, 0.004, 12),
                                            make_box(Vector3::Constant(0.03)), random_soup(random, 500, 0.2)};
  for (const TriangleMesh& mesh : meshes) {
    for (int round = 0; round < 60; ++round) {
      // A bundle of short edges at the surface, or edges of any length all over it.
      const double spread = round % 2 == 0 ? 0.1 : 2.0;
      const double size = bounds_of(mesh.vertices).size().maxCoeff();
      const Vector3 middle = mesh.vertices[static_cast<std::size_t>(random()) % mesh.vertices.size()];
      Edges edges;
      for (int e = 0; e < 30; ++e) {
        const Vector3 p = middle + random_point(random, 0.3 * spread * size);
        edges.add(p, p + random_point(random, random_in(random, 0.0, 0.5 + spread) * size));
      }
      sure += expect_all_crossings(mesh, edges, crossed, looked_at);
    }
  }
  EXPECT_GT(crossed, 2000u);
  EXPECT_GT(sure, crossed - crossed / 10);
  EXPECT_LT(looked_at, crossed + crossed / 10);
}

/// An organ that ran away has edges that reach to infinity, and those overlap every box that has sides.
TEST(WideTree, EdgesToInfinityMeetTrianglesThatAreThere) {
  const WithoutTraps off;  // 1e300 is none as a float
  const TriangleMesh mesh = make_octasphere(0.02, 2);
  const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
  constexpr double far = 1e300;
  Edges edges;
  edges.add({-far, -far, -far}, {far, far, far});
  edges.add({-far, 0.0, 0.0}, {far, 0.0, 0.0});
  edges.add({0.0, 0.0, 0.0}, {0.0, far, 0.0});
  edges.add(Vector3::Constant(std::numeric_limits<double>::quiet_NaN()), {far, far, far});
  for (const InstructionSet set : all_sets()) {
    const std::vector<Pair> pairs = found_pairs(tree, edges, set);
    EXPECT_FALSE(pairs.empty());
    for (const Pair& pair : pairs) {
      EXPECT_TRUE(pair.second >= 0 && pair.second < static_cast<int>(mesh.triangles.size())) << pair.second;
    }
  }
}

/// Ends exactly on triangles, edges through rims and corners, edges in the plane, no length.
TEST(WideTree, FindsCrossingsThatRoundingDecides) {
  Random random(2);
  std::size_t crossed = 0;
  std::size_t looked_at = 0;
  for (const TriangleMesh& mesh : {make_octasphere(0.02, 3), make_grid_box(Vector3::Constant(0.02), 6)}) {
    for (int round = 0; round < 40; ++round) {
      Edges edges;
      const auto any = [&]() { return static_cast<std::size_t>(random()) % mesh.vertices.size(); };
      for (int e = 0; e < 30; ++e) {
        const Triangle& corners = mesh.triangles[static_cast<std::size_t>(random()) % mesh.triangles.size()];
        const Vector3& a = mesh.vertices[corners[0]];
        const Vector3& b = mesh.vertices[corners[1]];
        const Vector3 on = a + random_in(random, 0.0, 1.0) * (b - a);
        const Vector3 way = random_point(random, 0.004);
        switch (e % 5) {
          case 0:
            edges.add(on, on + way);
            break;
          case 1:
            edges.add(on - way, on + way);
            break;
          case 2:
            edges.add(a - way, a + way);
            break;
          case 3:
            edges.add(mesh.vertices[any()], mesh.vertices[any()]);
            break;
          default:
            edges.add(on, on);
        }
      }
      expect_all_crossings(mesh, edges, crossed, looked_at);
    }
  }
  EXPECT_GT(crossed, 1000u);
}

TEST(WideTree, FindsCrossingsFarFromItsOrigin) {
  Random random(3);
  std::size_t crossed = 0;
  std::size_t looked_at = 0;
  const TriangleMesh mesh = moved(make_octasphere(0.02, 4), {Vector3(0.5, -1.0, 2.0), Eigen::Quaterniond::Identity()});
  for (int round = 0; round < 30; ++round) {
    Edges edges;
    for (int e = 0; e < 30; ++e) {
      const Vector3 p = mesh.vertices[static_cast<std::size_t>(random()) % mesh.vertices.size()];
      edges.add(p + random_point(random, 0.002), p + random_point(random, 0.002));
    }
    expect_all_crossings(mesh, edges, crossed, looked_at);
  }
  EXPECT_GT(crossed, 200u);
}

TEST(WideTree, ClosestPointIsThatOfBruteForceToTheBit) {
  Random random(4);
  for (int round = 0; round < 60; ++round) {
    const TriangleMesh mesh = round % 3 == 0   ? random_soup(random, 1 + 7 * round, 0.2)
                              : round % 3 == 1 ? make_octasphere(0.02, 3)
                                               : make_grid_box(Vector3::Constant(0.02), 5);
    const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
    BoxRows boxes;
    begin_rows(mesh.vertices.front(), boxes);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto corner = [&](std::size_t i) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][i])]; };
      add_to_rows(static_cast<int>(t), corner(0), corner(1), corner(2), boxes);
    }
    const double size = bounds_of(mesh.vertices).size().maxCoeff();
    for (int i = 0; i < 60; ++i) {
      const Vector3 on = mesh.vertices[static_cast<std::size_t>(random()) % mesh.vertices.size()];
      const Vector3 p = i % 4 == 0 ? on : i % 4 == 1 ? Vector3(100.0 * on) : on + random_point(random, 0.3 * size);
      const double reach = i % 3 == 0 ? 0.1 * size : std::numeric_limits<double>::infinity();
      ClosestSearch plain(mesh.vertices, mesh.triangles, p, reach);
      for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) plain.look_at(t);
      for (const InstructionSet set : all_sets()) {
        for (const int guess : {-1, i % static_cast<int>(mesh.triangles.size()), plain.best.triangle}) {
          const ClosestOnMesh closest = closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, reach, guess, set);
          ASSERT_EQ(closest.triangle, plain.best.triangle);
          EXPECT_EQ(closest.squared_distance, plain.best.squared_distance);
          EXPECT_EQ(closest.on.point, plain.best.on.point);
        }
        ClosestSearch among_rows(mesh.vertices, mesh.triangles, p, reach);
        look_through(boxes, among_rows, set);
        ASSERT_EQ(among_rows.best.triangle, plain.best.triangle);
        EXPECT_EQ(among_rows.best.on.point, plain.best.on.point);
      }
    }
  }
}

/// What rounding has left of a sliver's plane may miss its own corners: then it must not tell how far the sliver is.
TEST(WideTree, ThePlanesOfSliversHideNothing) {
  Random random(8);
  TriangleMesh mesh;
  for (int t = 0; t < 200; ++t) {
    const Vector3 a = Vector3::Constant(1.0) + random_point(random, 0.01);
    const Vector3 along = random_point(random, 0.002);
    const double thickness = std::pow(10.0, random_in(random, -19.0, -5.0));
    const Vector3 c = a + random_in(random, 0.0, 1.0) * along + random_point(random, thickness);
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {a, a + along, c});
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
  for (int i = 0; i < 2000; ++i) {
    const Triangle& corners = mesh.triangles[static_cast<std::size_t>(i) % mesh.triangles.size()];
    const double share = random_in(random, 0.0, 1.0);
    const Vector3 on = (1.0 - share) * mesh.vertices[corners[0]] + share * mesh.vertices[corners[1]];
    const Vector3 p = on + random_point(random, std::pow(10.0, random_in(random, -12.0, -3.0)));
    ClosestSearch plain(mesh.vertices, mesh.triangles, p, 1.0);
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) plain.look_at(t);
    for (const InstructionSet set : all_sets()) {
      const ClosestOnMesh closest = closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, 1.0, -1, set);
      ASSERT_EQ(closest.triangle, plain.best.triangle);
      EXPECT_EQ(closest.squared_distance, plain.best.squared_distance);
    }
  }
}

TEST(WideTree, AFreeBallIsFreeAndExactWhereThatIsAskedFor) {
  Random random(6);
  int given_away = 0;
  for (const TriangleMesh& mesh : {make_octasphere(0.02, 3), random_soup(random, 200, 0.2)}) {
    const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
    const double size = bounds_of(mesh.vertices).size().maxCoeff();
    for (int i = 0; i < 300; ++i) {
      const Vector3 p = random_point(random, size);
      const double little = random_in(random, 0.0, 0.5 * size);
      const double enough = 1.3 * little;
      const double distance = std::sqrt(closest_on_mesh(mesh.vertices, mesh.triangles, tree, p, 1e3).squared_distance);
      for (const int guess : {-1, i % static_cast<int>(mesh.triangles.size())}) {
        const ClosestOnMesh free =
            free_around(mesh.vertices, mesh.triangles, tree, p, little, enough, guess, InstructionSet::baseline);
        const double radius = std::sqrt(free.squared_distance);
        EXPECT_GE(free.triangle, 0);
        EXPECT_LE(radius, distance * (1.0 + 1e-12));
        EXPECT_GE(radius, 0.79 * distance);
        EXPECT_EQ(radius > little, distance > little);
        EXPECT_GE(radius, (distance > little ? std::min(distance, enough) : 0.79 * distance) * (1.0 - 1e-12));
        given_away += radius < 0.9 * distance ? 1 : 0;
        for (const InstructionSet set : all_sets()) {
          const ClosestOnMesh same = free_around(mesh.vertices, mesh.triangles, tree, p, little, enough, guess, set);
          EXPECT_EQ(same.triangle, free.triangle);
          EXPECT_EQ(same.squared_distance, free.squared_distance);
        }
      }
    }
  }
  EXPECT_GT(given_away, 100);
}

TEST(WideTree, OfAnySizeHoldsEveryTriangleOnce) {
  Random random(5);
  for (const int count : {0, 1, 7, 8, 9, 63, 64, 65, 300, 513}) {
    const TriangleMesh mesh = random_soup(random, count, 0.1);
    const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
    std::multiset<int> triangles;
    for (const WideTree::Node& node : tree.nodes) {
      for (const int child : node.child) {
        if (node.leaf >= 0 && child >= 0) triangles.insert(child);
      }
    }
    EXPECT_EQ(static_cast<int>(triangles.size()), count);
    for (int t = 0; t < count; ++t) EXPECT_EQ(triangles.count(t), 1u);
    EXPECT_LE(static_cast<int>(tree.leaves.size()), (count + 6) / 7 + 1);
  }
}

TEST(WideTree, ManyTrianglesInOnePlaceAndNumbersThatAreNone) {
  const WithoutTraps off;  // a NaN is compared, 1e30 is squared as a float
  TriangleMesh mesh;
  mesh.vertices = {Vector3::Zero(), Vector3::UnitX(), Vector3::UnitY()};
  mesh.triangles.assign(5000, {0, 1, 2});
  const WideTree tree = build_wide_tree(mesh.vertices, mesh.triangles);
  EXPECT_LE(tree.height, 6);
  const double none = std::nan("");
  const double big = std::numeric_limits<double>::infinity();
  for (const InstructionSet set : all_sets()) {
    EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, {0.2, 0.2, 1.0}, 2.0, -1, set).triangle, 0);
    EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, {0.2, none, 1.0}, big, -1, set).triangle, -1);
    EXPECT_EQ(closest_on_mesh(mesh.vertices, mesh.triangles, tree, {1e30, 0.0, 0.0}, big, -1, set).triangle, 0);
    Edges edges;
    edges.add({0.2, 0.2, -1.0}, {0.2, none, 1.0});
    edges.add({0.2, 0.2, -1.0}, {0.2, 0.2, 1.0});
    EXPECT_GE(found_pairs(tree, edges, set).size(), 5000u);
  }
}

}  // namespace
}  // namespace tissue_sim::wide_tree_test
