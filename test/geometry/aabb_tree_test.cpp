#include "tissue_sim/geometry/aabb_tree.h"

#include <gtest/gtest.h>

#include <set>

#include "geometry/twins.h"

namespace tissue_sim::aabb_tree_test {
namespace {

using Pair = std::pair<int, int>;

/// What a query finds and what brute force finds: all of it, each once, and nothing that does not exist.
void expect_near_equals_brute_force(const AabbTree& tree, const std::vector<Box>& boxes, const Box& query) {
  std::multiset<int> visited;
  tree.for_each_near(query, [&](int item) { visited.insert(item); });
  for (int item = 0; item < static_cast<int>(boxes.size()); ++item) {
    EXPECT_LE(visited.count(item), 1u);
    EXPECT_GE(visited.count(item), boxes[item].overlaps(query) ? 1u : 0u);
  }
  EXPECT_TRUE(visited.empty() || *visited.rbegin() < static_cast<int>(boxes.size()));
}

std::set<Pair> overlapping_pairs(const AabbTree& a, const std::vector<Box>& of_a, const AabbTree& b,
                                 const std::vector<Box>& of_b) {
  std::set<Pair> visited;
  std::set<Pair> overlapping;
  a.for_each_near_pair(b, [&](int i, int j) {
    EXPECT_TRUE(visited.insert({i, j}).second) << "visited twice";
    if (of_a[i].overlaps(of_b[j])) overlapping.insert({i, j});
  });
  return overlapping;
}

std::set<Pair> brute_force_pairs(const std::vector<Box>& a, const std::vector<Box>& b) {
  std::set<Pair> pairs;
  for (int i = 0; i < static_cast<int>(a.size()); ++i) {
    for (int j = 0; j < static_cast<int>(b.size()); ++j) {
      if (a[i].overlaps(b[j])) pairs.insert({i, j});
    }
  }
  return pairs;
}

double nearest_box(const AabbTree& tree, const std::vector<Box>& boxes, const Vector3& p) {
  double bound = 1e300;
  tree.for_each_by_distance(
      p, bound, [&](int item, double& nearest) { nearest = std::min(nearest, boxes[item].squared_distance(p)); });
  return bound;
}

double brute_force_nearest(const std::vector<Box>& boxes, const Vector3& p) {
  double nearest = 1e300;
  for (const Box& box : boxes) nearest = std::min(nearest, box.squared_distance(p));
  return nearest;
}

TEST(Box, StartsEmptyAndGrowsByPoints) {
  Box box;
  EXPECT_FALSE(box.overlaps(box));
  EXPECT_FALSE(box.contains(Vector3::Zero()));
  box.add(Vector3(1, 2, 3));
  EXPECT_TRUE(box.overlaps(box));
  box.add(Vector3(2, 0, 3));
  EXPECT_EQ(box.lower, Vector3(1, 0, 3));
  EXPECT_EQ(box.upper, Vector3(2, 2, 3));
  EXPECT_TRUE(box.contains(Vector3(1.5, 1, 3)));
  EXPECT_EQ(box.grown(0.5).size(), Vector3(2, 3, 1));
}

TEST(Box, SharedFacesOverlapAndDistancesAreToTheSurface) {
  const Box box = {Vector3::Zero(), Vector3::Ones()};
  EXPECT_TRUE(box.overlaps({Vector3(1, 0, 0), Vector3(2, 1, 1)}));
  EXPECT_TRUE(box.overlaps({Vector3(1, 1, 1), Vector3(2, 2, 2)}));
  EXPECT_FALSE(box.overlaps({Vector3(1.0000001, 0, 0), Vector3(2, 1, 1)}));
  EXPECT_EQ(box.squared_distance(Vector3(0.5, 0.5, 0.5)), 0.0);
  EXPECT_EQ(box.squared_distance(Vector3(4, 5, 1)), 25.0);
}

TEST(Box, ANumberThatIsNoneOverlapsNothing) {
  Box box = {Vector3::Zero(), Vector3::Ones()};
  const Box whole = box;
  box.upper.y() = std::nan("");
  EXPECT_FALSE(box.overlaps(whole));
  EXPECT_FALSE(whole.overlaps(box));
  EXPECT_FALSE(whole.contains(Vector3(0.5, std::nan(""), 0.5)));
}

TEST(AabbTree, FindsWhatBruteForceFinds) {
  Random random(1);
  for (int round = 0; round < 200; ++round) {
    const TriangleMesh soup = random_soup(random, round % 70, random_in(random, 0.0, 0.3));
    const TriangleMesh other_soup = random_soup(random, (7 * round) % 40, random_in(random, 0.0, 0.5));
    const std::vector<Box> boxes = boxes_of(soup);
    const std::vector<Box> other_boxes = boxes_of(other_soup);
    const AabbTree tree = tree_of(soup);
    const AabbTree other = tree_of(other_soup);
    for (const Box& query : other_boxes) expect_near_equals_brute_force(tree, boxes, query);
    EXPECT_EQ(overlapping_pairs(tree, boxes, other, other_boxes), brute_force_pairs(boxes, other_boxes));
    for (int i = 0; i < 10; ++i) {
      const Vector3 p = random_point(random, 2.0);
      EXPECT_EQ(nearest_box(tree, boxes, p), brute_force_nearest(boxes, p));
    }
  }
}

TEST(AabbTree, RefittedFindsWhatRebuiltFinds) {
  Random random(2);
  for (int round = 0; round < 200; ++round) {
    TriangleMesh soup = random_soup(random, 1 + round % 60, 0.2);
    const std::vector<Box> other_boxes = boxes_of(random_soup(random, 20, 0.4));
    AabbTree refitted = tree_of(soup);
    AabbTree other;
    other.build(other_boxes);
    for (Vector3& v : soup.vertices) v += random_point(random, 0.7);
    const std::vector<Box> boxes = boxes_of(soup);
    refitted.refit(boxes);
    const AabbTree rebuilt = tree_of(soup);

    EXPECT_EQ(refitted.bounds().lower, rebuilt.bounds().lower);
    EXPECT_EQ(refitted.bounds().upper, rebuilt.bounds().upper);
    EXPECT_EQ(overlapping_pairs(refitted, boxes, other, other_boxes),
              overlapping_pairs(rebuilt, boxes, other, other_boxes));
    for (const Box& query : other_boxes) expect_near_equals_brute_force(refitted, boxes, query);
    for (int i = 0; i < 10; ++i) {
      const Vector3 p = random_point(random, 2.0);
      EXPECT_EQ(nearest_box(refitted, boxes, p), nearest_box(rebuilt, boxes, p));
    }
  }
}

TEST(AabbTree, OfNothingFindsNothing) {
  AabbTree tree;
  tree.build({});
  Random random(3);
  const AabbTree full = tree_of(random_soup(random, 10, 0.1));
  EXPECT_TRUE(tree.empty());
  int visits = 0;
  tree.for_each_near({-Vector3::Ones(), Vector3::Ones()}, [&](int) { ++visits; });
  tree.for_each_near_pair(full, [&](int, int) { ++visits; });
  full.for_each_near_pair(tree, [&](int, int) { ++visits; });
  double bound = 1.0;
  tree.for_each_by_distance(Vector3::Zero(), bound, [&](int, double&) { ++visits; });
  EXPECT_EQ(visits, 0);
}

TEST(AabbTree, ManyBoxesInOnePlaceStayShallow) {
  const std::vector<Box> boxes(20000, Box{Vector3::Zero(), Vector3::Ones()});
  AabbTree tree;
  tree.build(boxes);
  std::set<int> visited;
  tree.for_each_near(boxes.front(), [&](int item) { visited.insert(item); });
  EXPECT_EQ(visited.size(), boxes.size());
}

TEST(AabbTree, ABoxThatIsNoNumberHidesNoOther) {
  Random random(4);
  const TriangleMesh soup = random_soup(random, 50, 0.2);
  std::vector<Box> boxes = boxes_of(soup);
  AabbTree tree;
  tree.build(boxes);
  boxes[17] = Box();  // what adding points that are no numbers can leave
  tree.refit(boxes);
  for (const Box& query : boxes_of(random_soup(random, 50, 0.3))) expect_near_equals_brute_force(tree, boxes, query);
}

}  // namespace
}  // namespace tissue_sim::aabb_tree_test
