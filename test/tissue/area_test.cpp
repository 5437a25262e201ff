#include "tissue_sim/tissue/area.h"

#include "tissue/element_checks.h"

namespace tissue_sim::area_test {
namespace {

AreaElement element(double rest, double scale) {
  AreaElement e;
  e.vertices = {0, 1, 2};
  e.rest = rest;
  e.scale = scale;
  e.stiffness = 2.0;
  return e;
}

// Eq. 7 with its norm: E_A = 1/2 k_A ((1/2 |(p_j - p_i) x (p_k - p_i)| - A_0) / A_0)^2.
TEST(Area, Equation7ByHand) {
  const std::vector<Vector3> x = {{0, 0, 2}, {3, 0, 2}, {0, 4, 2}};  // area 6
  ElementVectors<AreaElement> gradient;
  EXPECT_DOUBLE_EQ(element(4.0, 4.0).evaluate({x[0], x[1], x[2]}, gradient), 0.5);
  EXPECT_DOUBLE_EQ(energy_of(element(4.0, 4.0), x), 0.25);
  EXPECT_DOUBLE_EQ(energy_of(element(6.0, 6.0), x), 0.0);
  // Corner 1 is 3 from the side of length 4: the area grows by 4/2 a metre.
  EXPECT_LT((gradient[1] - Vector3(0.5, 0, 0)).norm(), 1e-15);
  EXPECT_LT((gradient[2] - Vector3(0, 0.375, 0)).norm(), 1e-15);
  EXPECT_LT((gradient[0] + gradient[1] + gradient[2]).norm(), 1e-15);
}

TEST(Area, TheOrderOfTheCornersDoesNotMatter) {
  const std::vector<Vector3> x = {{0, 0, 2}, {0, 4, 2}, {3, 0, 2}};
  EXPECT_DOUBLE_EQ(energy_of(element(4.0, 4.0), x), 0.25);
}

TEST(Area, OwesWhatEveryElementOwes) {
  expect_all_that_elements_owe<AreaElement>(0.4);
}

TEST(Area, BlocksBoundTheSecondDerivative) {
  expect_blocks_bound_the_second_derivative<AreaElement>(0.4, false);
}

TEST(Area, WithoutAnyAreaItsBlockIsZero) {
  const AreaElement e = element(0.5, 0.5);
  EXPECT_TRUE(e.block({Vector3::Zero(), Vector3::UnitX(), Vector3(2, 0, 0)}, 0).isZero());
}

TEST(Area, WithoutAnyAreaItIsFinite) {
  for (const Vector3& third : {Vector3(0, 0, 0), Vector3(2, 0, 0), Vector3(0.5, 0, 0)}) {
    ElementVectors<AreaElement> gradient;
    EXPECT_DOUBLE_EQ(element(0.5, 0.5).evaluate({Vector3::Zero(), Vector3::UnitX(), third}, gradient), -1.0);
    for (const Vector3& g : gradient) EXPECT_EQ(g, Vector3::Zero());
  }
}

}  // namespace
}  // namespace tissue_sim::area_test
