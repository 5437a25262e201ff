#include <gtest/gtest.h>

#include <cstdlib>

#include "geometry/twins.h"
#include "tissue_sim/geometry/edge_triangle.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/geometry/wide_tree.h"

namespace tissue_sim::random_pairs_test {
namespace {

using Pair = std::pair<int, int>;
using Pairs = std::vector<Pair>;

Pairs sorted(Pairs pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// A closed surface, a box, a ring or triangles in no order, of about the size of 1, somewhere near the origin. Some
/// lie on a grid, so that corners, rims and planes of two meshes fall together; some are flat; some repeat a triangle.
TriangleMesh random_mesh(Random& random) {
  TriangleMesh mesh;
  switch (random() % 5) {
    case 0:
      mesh = make_octasphere(1.0, static_cast<int>(random() % 2));
      break;
    case 1:
      mesh = make_box({1.0, 1.5, 0.5});
      break;
    case 2:
      mesh = make_torus(0.8, 0.3, 4);
      break;
    default:
      mesh = random_soup(random, 1 + static_cast<int>(random() % 24), random_in(random, 0.05, 1.0));
      break;
  }
  const Pose pose = random_pose(random, 1.0);
  const bool turned = random() % 3 != 0;
  for (Vector3& p : mesh.vertices) p = turned ? pose.apply(p) : p + pose.position;
  if (random() % 4 == 0) {
    for (Vector3& p : mesh.vertices) p = (4.0 * p).array().round() / 4.0;
  }
  if (random() % 16 == 0) {
    for (Vector3& p : mesh.vertices) p.z() = 0.25;
  }
  if (random() % 16 == 0) mesh.triangles.push_back(mesh.triangles[0]);
  return mesh;
}

Pairs near_by_tree(const AabbTree& a, const std::vector<Box>& of_a, const AabbTree& b, const std::vector<Box>& of_b) {
  Pairs pairs;
  a.for_each_near_pair(b, [&](int i, int j) {
    if (of_a[static_cast<std::size_t>(i)].overlaps(of_b[static_cast<std::size_t>(j)])) pairs.emplace_back(i, j);
  });
  return sorted(pairs);
}

Pairs near_by_force(const std::vector<Box>& a, const std::vector<Box>& b) {
  Pairs pairs;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (a[i].overlaps(b[j])) pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

bool hits(const TriangleMesh& organ, const Edge& edge, const TriangleMesh& instrument, std::size_t triangle) {
  const auto& [i, j, k] = instrument.triangles[triangle];
  const auto at = [](const TriangleMesh& mesh, int v) { return &mesh.vertices[static_cast<std::size_t>(v)]; };
  return hit_edge_triangle(*at(organ, edge[0]), *at(organ, edge[1]),
                           {at(instrument, i), at(instrument, j), at(instrument, k)}, instrument.triangles[triangle])
             .direction != 0;
}

/// Edges of the organ through triangles of the instrument, as stage 1 finds them.
Pairs hits_by_tree(const TriangleMesh& organ, const std::vector<Edge>& edges, const TriangleMesh& instrument,
                   InstructionSet set) {
  const WideTree tree = build_wide_tree(instrument.vertices, instrument.triangles);
  std::vector<FloatPoint> rounded;
  for (const Vector3& p : organ.vertices) rounded.push_back(to_float(p));
  std::vector<int> all(edges.size());
  for (std::size_t e = 0; e < all.size(); ++e) all[e] = static_cast<int>(e);
  WideTreeRoom room;
  std::vector<EdgeTrianglePair> near;
  const NearEdges given = {rounded.data(), rounded.size(), edges.data(), all.data(), all.size()};
  find_crossing_pairs(tree, given, room, near, set);
  Pairs pairs;
  for (const EdgeTrianglePair& pair : near) {
    const auto triangle = static_cast<std::size_t>(pair.triangle);
    if (hits(organ, edges[static_cast<std::size_t>(pair.edge)], instrument, triangle)) {
      pairs.emplace_back(pair.edge, pair.triangle);
    }
  }
  return sorted(pairs);
}

Pairs hits_by_force(const TriangleMesh& organ, const std::vector<Edge>& edges, const TriangleMesh& instrument) {
  Pairs pairs;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    for (std::size_t t = 0; t < instrument.triangles.size(); ++t) {
      if (hits(organ, edges[e], instrument, t)) pairs.emplace_back(e, t);
    }
  }
  return pairs;
}

/// A tenth of 100,000 pairs in the ordinary run; all with TISSUE_SIM_LONG=1. Both trees give what every pair of boxes
/// and every edge and triangle give; and a tree that was refitted to moved vertices what one built anew gives.
TEST(RandomMeshPairs, TreesFindWhatBruteForceFindsAndRefittedWhatRebuiltFinds) {
  Random random(8);
  const int rounds = std::getenv("TISSUE_SIM_LONG") != nullptr ? 100'000 : 10'000;
  std::size_t near = 0, hit = 0;
  for (int round = 0; round < rounds && !HasFailure(); ++round) {
    SCOPED_TRACE(round);
    TriangleMesh organ = random_mesh(random);
    const TriangleMesh instrument = random_mesh(random);
    const std::vector<Box> of_instrument = boxes_of(instrument);
    const AabbTree other = tree_of(instrument);
    AabbTree refitted = tree_of(organ);
    for (const bool moved : {false, true}) {
      if (moved) {
        for (Vector3& p : organ.vertices) p += random_point(random, 0.5);
      }
      const std::vector<Box> of_organ = boxes_of(organ);
      refitted.refit(of_organ);
      const Pairs expected = near_by_force(of_organ, of_instrument);
      EXPECT_EQ(near_by_tree(refitted, of_organ, other, of_instrument), expected);
      EXPECT_EQ(near_by_tree(tree_of(organ), of_organ, other, of_instrument), expected);
      near += expected.size();
    }
    const std::vector<Edge> edges = build_topology(static_cast<int>(organ.vertices.size()), organ.triangles).edges;
    const Pairs expected = hits_by_force(organ, edges, instrument);
    EXPECT_EQ(hits_by_tree(organ, edges, instrument, InstructionSet::baseline), expected);
    EXPECT_EQ(hits_by_tree(organ, edges, instrument, instruction_set()), expected);
    hit += expected.size();
  }
  EXPECT_GT(near, static_cast<std::size_t>(rounds));
  EXPECT_GT(hit, static_cast<std::size_t>(rounds));
}

}  // namespace
}  // namespace tissue_sim::random_pairs_test
