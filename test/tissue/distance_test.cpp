#include "tissue_sim/tissue/distance.h"

#include "tissue/element_checks.h"

namespace tissue_sim::distance_test {
namespace {

DistanceElement element(double rest, double scale) {
  DistanceElement e;
  e.vertices = {0, 1};
  e.rest = rest;
  e.scale = scale;
  e.stiffness = 8.0;
  return e;
}

// Eq. 6: E_D = 1/2 k_D ((|p_j - p_i| - D_0) / D_0)^2.
TEST(Distance, Equation6ByHand) {
  const std::vector<Vector3> x = {{1, 1, 1}, {4, 5, 1}};  // 5 apart
  ElementVectors<DistanceElement> gradient;
  EXPECT_DOUBLE_EQ(element(4.0, 4.0).evaluate({x[0], x[1]}, gradient), 0.25);
  EXPECT_LT((gradient[1] - Vector3(0.15, 0.2, 0.0)).norm(), 1e-15);
  EXPECT_LT((gradient[0] + gradient[1]).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(energy_of(element(4.0, 4.0), x), 0.25);
  EXPECT_DOUBLE_EQ(energy_of(element(5.0, 5.0), x), 0.0);

  // Stretched: the ends are drawn together with k C / D_0.
  const std::vector<Vector3> forces = forces_of(element(4.0, 4.0), x, {Vector3::Zero(), Vector3::Zero()});
  EXPECT_LT((forces[0] - 0.5 * Vector3(0.6, 0.8, 0.0)).norm(), 1e-15);
}

TEST(Distance, OwesWhatEveryElementOwes) {
  expect_all_that_elements_owe<DistanceElement>(0.8);
}

TEST(Distance, BlocksBoundTheSecondDerivative) {
  expect_blocks_bound_the_second_derivative<DistanceElement>(0.8, false);
}

TEST(Distance, ABlockByHand) {
  // 2 long at rest, stretched to 4 along y: k / 4 along it and half of that across. Shortened to 1: nothing across.
  const DistanceElement e = element(2.0, 2.0);
  EXPECT_TRUE(e.block({Vector3::Zero(), Vector3(0, 4, 0)}, 0).isApprox(Matrix3(Vector3(1, 2, 1).asDiagonal())));
  EXPECT_TRUE(e.block({Vector3::Zero(), Vector3(0, 1, 0)}, 1).isApprox(Matrix3(Vector3(0, 2, 0).asDiagonal())));
  EXPECT_TRUE(e.block({Vector3::Zero(), Vector3::Zero()}, 0).isZero());
}

TEST(Distance, EndsInOnePlaceAreFinite) {
  ElementVectors<DistanceElement> gradient;
  EXPECT_DOUBLE_EQ(element(2.0, 2.0).evaluate({Vector3::Ones(), Vector3::Ones()}, gradient), -1.0);
  EXPECT_EQ(gradient[0], Vector3::Zero());
  EXPECT_EQ(gradient[1], Vector3::Zero());
}

TEST(Distance, AShortRestLengthIsDividedByItsFloor) {
  ElementVectors<DistanceElement> gradient;
  EXPECT_DOUBLE_EQ(element(0.0, 2.0).evaluate({Vector3::Zero(), Vector3::UnitX()}, gradient), 0.5);
  EXPECT_EQ(gradient[1], Vector3(0.5, 0.0, 0.0));
}

}  // namespace
}  // namespace tissue_sim::distance_test
