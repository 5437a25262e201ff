#include <gtest/gtest.h>

#include <cmath>

#include "tissue_sim/study/paper_accuracy.h"

namespace tissue_sim::paper_test {
namespace {

constexpr double R = paper_radius;

/// Of the organ's area at rest, how much is within R of `centre`, each triangle cut into `cuts`^2 small ones.
double area_inside(const TriangleMesh& mesh, const Vector3& centre, int cuts) {
  double inside = 0.0;
  double total = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3& p = mesh.vertices[a];
    const Vector3 u = (mesh.vertices[b] - p) / cuts;
    const Vector3 v = (mesh.vertices[c] - p) / cuts;
    const double area = u.cross(v).norm();
    for (int i = 0; i < cuts; ++i) {
      for (int j = 0; i + j < cuts; ++j) {
        const bool has_upper = i + j + 1 < cuts;
        const auto add = [&](double fi, double fj) {
          total += area;
          inside += (p + fi * u + fj * v - centre).norm() < R ? area : 0.0;
        };
        add(i + 1.0 / 3.0, j + 1.0 / 3.0);
        if (has_upper) add(i + 2.0 / 3.0, j + 2.0 / 3.0);
      }
    }
  }
  return inside / total;
}

TEST(PaperProtocol, TheTableHoldsThePublishedFigures) {
  // Table 1, s: contact only, without restoration, with restoration.
  const double published[9][3] = {{0.02219318, 0.02886455, 0.03093863},  {0.02643189, 0.04148911, 0.04729691},
                                  {0.042459626, 0.10129949, 0.11541373}, {0.025458446, 0.03340169, 0.03589672},
                                  {0.030800238, 0.05244825, 0.05515859}, {0.047078356, 0.12458907, 0.13218986},
                                  {0.037333984, 0.05318061, 0.0537442},  {0.04425557, 0.07724302, 0.08916327},
                                  {0.064828948, 0.1787737, 0.18106284}};
  for (std::size_t test = 0; test < 9; ++test) {
    EXPECT_EQ(paper_tests[test].rigid, paper_slices[test / 3]);
    EXPECT_EQ(paper_tests[test].deformable, paper_slices[test % 3]);
    for (std::size_t approach = 0; approach < 3; ++approach) {
      EXPECT_EQ(paper_tests[test].seconds[approach], published[test][approach]) << test << " " << approach;
    }
  }
}

TEST(PaperProtocol, ThePathGoesInThenUpAndDown) {
  const std::vector<Vector3> path = paper_path();
  ASSERT_EQ(path.size(), 601u);
  const auto expect_at = [&](std::size_t step, double x, double z) {
    EXPECT_NEAR((path[step] - R * Vector3(x, 0.0, z)).norm(), 0.0, 1e-12) << step;
  };
  expect_at(0, 2.2, 0.0);
  expect_at(200, 0.4, 0.0);
  expect_at(300, 0.4, 1.131);
  expect_at(500, 0.4, -1.131);
  expect_at(600, 0.4, 0.0);
  for (std::size_t i = 1; i < path.size(); ++i) {
    EXPECT_NEAR((path[i] - path[i - 1]).norm(), i <= 200 ? 1.8 * R / 200.0 : 1.131 * R / 100.0, 1e-12) << i;
  }
}

TEST(PaperProtocol, FortyPercentOfTheAreaIsInsideAndTwentyAtBothEnds) {
  const std::vector<Vector3> path = paper_path();
  const TriangleMesh organ = paper_scene(paper_tests[8], Approach::contact_only).organs[0].mesh;
  EXPECT_NEAR(area_inside(organ, path[0], 1), 0.0, 1e-12);
  EXPECT_NEAR(area_inside(organ, path[200], 6), 0.40, 0.008);
  EXPECT_NEAR(area_inside(organ, path[300], 6), 0.20, 0.004);
  EXPECT_NEAR(area_inside(organ, path[500], 6), 0.20, 0.004);
}

TEST(PaperProtocol, TheSmallestPairRunsThroughAndRepeats) {
  for (const Approach approach : {Approach::contact_only, Approach::without_restoration, Approach::with_restoration}) {
    const PaperResult once = run_paper_test(paper_tests[0], approach);
    EXPECT_EQ(once.recoveries, 0) << to_string(approach);
    EXPECT_GT(once.steps_with_contact, 300) << to_string(approach);
    EXPECT_GT(once.mean.total, 0.0);
    EXPECT_EQ(run_paper_test(paper_tests[0], approach).hash, once.hash) << to_string(approach);
  }
}

TEST(PaperAccuracy, TheFloodIsExactInEveryMotionAndThePapersSetIsNot) {
  int wrong = 0;
  ASSERT_EQ(set_motions().size(), 6u);
  for (const SetMotion& motion : set_motions()) {
    const SetError flood = measure_set(paper_tests[0], CollidingSet::flood, motion);
    EXPECT_GT(flood.colliding, 0) << motion.name;
    EXPECT_EQ(flood.falsely, 0) << motion.name;
    EXPECT_EQ(flood.missed, 0) << motion.name;
    const SetError paper = measure_set(paper_tests[0], CollidingSet::paper, motion);
    EXPECT_EQ(paper.colliding, flood.colliding) << motion.name;
    wrong += paper.falsely + paper.missed;
  }
  EXPECT_GT(wrong, 0);
}

TEST(PaperAccuracy, BorderDepthsAreBetterThanInnerOnes) {
  const DepthAccuracy accuracy = measure_depths(paper_tests[0]);
  EXPECT_GT(accuracy.border.vertices, 100);
  EXPECT_GT(accuracy.inner.vertices, 100);
  EXPECT_LT(accuracy.border.depth_mean, accuracy.inner.depth_mean);
  EXPECT_LT(accuracy.inner.depth_mean, 0.5);
}

}  // namespace
}  // namespace tissue_sim::paper_test
