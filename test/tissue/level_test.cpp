#include "tissue_sim/tissue/level.h"

#include <gtest/gtest.h>

#include "tissue/test_solids.h"

namespace tissue_sim::level_test {
namespace {

const Vector3 size(0.11, 0.11, 0.04);  // m

/// 110 x 110 x 40 mm, cut into cells of 40 mm / `across`.
Organ block_with_levels(int across, double tolerance) {
  const int along = across * 11 / 4;
  Organ organ = solid_organ(make_block(size, {along, along, across}), size, Model::fem);
  organ.levels_tolerance = tolerance;
  return organ;
}

/// With two coarser levels, built once.
struct Built {
  Organ organ = block_with_levels(12, 0.08);
  RestShape rest = build_rest_shape(organ);
  std::vector<Level> levels = build_levels(organ, rest);
};
const Built& built() {
  static const Built once;
  return once;
}

TEST(Level, RegionsShrinkWithTheToleranceAndNeverVanish) {
  double before = 1e300;
  for (const double tolerance : {0.01, 0.02, 0.05, 0.07}) {
    const RegionSize region = region_size(tolerance);
    EXPECT_LT(region.cells, before);
    EXPECT_DOUBLE_EQ(region.edges, 2.0 * region.cells);
    before = region.cells;
  }
  EXPECT_GE(region_size(0.3).cells, 2.0);
}

TEST(Level, EachIsTwiceAsCoarseAndAsHeavyAsTheOrgan) {
  const RestShape& rest = built().rest;
  const std::vector<Level>& levels = built().levels;
  ASSERT_EQ(levels.size(), 2u);
  double edge = fine_edge(rest);
  for (const Level& level : levels) {
    EXPECT_NEAR(level.edge, 2.0 * edge, 1e-12);
    EXPECT_NEAR(level.shape.total_mass, rest.total_mass, 0.02 * rest.total_mass);
    edge = level.edge;
  }
}

TEST(Level, ASmallOrganHasNone) {
  EXPECT_TRUE(build_levels(block_with_levels(4, 0.05), build_rest_shape(block_with_levels(4, 0.05))).empty());
}

/// What a level carries moves with it, and what it hands on is all of the force.
TEST(Level, CarriesALinearFieldAndHandsOnWholeForces) {
  const RestShape& rest = built().rest;
  const std::vector<Level>& levels = built().levels;
  const auto field = [](const Vector3& p) { return Vector3(1.0 + p.x() - 2.0 * p.y(), p.z(), 3.0 * p.x()); };
  const RestShape* finer = &rest;
  for (const Level& level : levels) {
    for (std::size_t v = 0; v < finer->positions.size(); ++v) {
      Vector3 carried = Vector3::Zero();
      double handed = 0.0;
      for (std::size_t i = 0; i < 4; ++i) {
        carried += level.finer.weights[v][i] * field(level.shape.positions[level.finer.corners[v][i]]);
        handed += level.bearing.weights[v][i];
      }
      EXPECT_LT((carried - field(finer->positions[v])).norm(), 1e-12);
      EXPECT_NEAR(handed, 1.0, 1e-12);
    }
    finer = &level.shape;
  }
}

/// Every level is held where the organ is, not only the first.
TEST(Level, EachIsPinnedInThePlaneWhereTheOrganIsAttached) {
  for (const Level& level : built().levels) {
    ASSERT_FALSE(level.pins.corners.empty());
    for (std::size_t p = 0; p < level.pins.corners.size(); ++p) {
      Vector3 place = Vector3::Zero();
      for (std::size_t i = 0; i < 4; ++i) {
        place += level.pins.weights[p][i] * level.shape.positions[level.pins.corners[p][i]];
      }
      EXPECT_NEAR(place.z(), -size.z(), 1e-12);
    }
  }
}

/// The cells at the bottom of the block are four times as wide as those at its top.
TEST(Level, TheEdgeIsThatOfTheFinePartOfAGradedMesh) {
  TetrahedralMesh block = make_block(size, {10, 10, 8});
  const auto edge_of = [](const TetrahedralMesh& mesh) {
    return fine_edge(build_rest_shape(solid_organ(mesh, size, Model::fem)));
  };
  const double even = edge_of(block);
  for (Vector3& v : block.vertices) {
    const double part = -v.z() / size.z();
    v.z() *= 1.0 + 3.0 * part;
    v.x() *= 1.0 + 3.0 * part;
    v.y() *= 1.0 + 3.0 * part;
  }
  const double graded = edge_of(block);
  EXPECT_GT(graded, even);
  EXPECT_LT(graded, 2.0 * even) << "the median of all edges is 2.5 times as long";
}

}  // namespace
}  // namespace tissue_sim::level_test
