#include "tissue_sim/geometry/turned_box.h"

#include <gtest/gtest.h>

#include "geometry/twins.h"

namespace tissue_sim::turned_box_test {
namespace {

std::array<Vector3, 8> corners_of(const Box& box) {
  std::array<Vector3, 8> corners;
  for (int i = 0; i < 8; ++i) {
    for (int axis = 0; axis < 3; ++axis) corners[i][axis] = (i >> axis & 1) != 0 ? box.upper[axis] : box.lower[axis];
  }
  return corners;
}

const Box rod = {{-0.01, -0.02, -0.3}, {0.01, 0.02, 0.3}};

TEST(SceneBounds, HoldTheBoxAndAreTight) {
  Random random(1);
  for (int round = 0; round < 200; ++round) {
    const Pose pose = random_pose(random, 1.0);
    Box exact;
    for (const Vector3& corner : corners_of(rod)) exact.add(pose.apply(corner));
    const Box bounds = scene_bounds(rod, pose);
    EXPECT_LT((bounds.lower - exact.lower).norm(), 1e-12);
    EXPECT_LT((bounds.upper - exact.upper).norm(), 1e-12);
  }
}

TEST(TurnedBox, OverlapsWhateverSharesAPointWithIt) {
  Random random(2);
  for (int round = 0; round < 2000; ++round) {
    const Pose pose = random_pose(random, 1.0);
    const TurnedBox turned(rod, pose);
    Vector3 inside;
    for (int axis = 0; axis < 3; ++axis) inside[axis] = random_in(random, rod.lower[axis], rod.upper[axis]);
    Box other;
    other.add(pose.apply(inside));
    other.add(pose.apply(inside) + random_point(random, 0.1));
    EXPECT_TRUE(turned.overlaps(other));
  }
}

TEST(TurnedBox, LeavesOutWhatOnlyTheBoxAroundItReaches) {
  const Pose askew = {Vector3(1.0, 2.0, 3.0), turn(0.7854, Vector3::UnitX())};
  const TurnedBox turned(rod, askew);
  const Box around = scene_bounds(rod, askew);
  for (const Vector3& corner : corners_of(around)) {
    const Box small = Box{corner, corner}.grown(0.005);
    EXPECT_TRUE(around.overlaps(small));
    EXPECT_FALSE(turned.overlaps(small));
  }
}

TEST(TurnedBox, ContainsABallThatStaysInside) {
  Random random(3);
  int contained = 0;
  for (int round = 0; round < 2000; ++round) {
    const Pose pose = random_pose(random, 1.0);
    const Vector3 local = random_point(random, 0.03);
    const double radius = random_in(random, 0.0, 0.01);
    bool expected = true;
    for (int axis = 0; axis < 3; ++axis) {
      expected = expected && local[axis] - radius > rod.lower[axis] && local[axis] + radius < rod.upper[axis];
    }
    EXPECT_EQ(TurnedBox(rod, pose).contains(pose.apply(local), radius), expected);
    contained += expected ? 1 : 0;
  }
  EXPECT_GT(contained, 50);
}

}  // namespace
}  // namespace tissue_sim::turned_box_test
