#include "tissue_sim/tissue/volume.h"

#include "tissue/element_checks.h"

namespace tissue_sim::volume_test {
namespace {

VolumeElement element(double rest, double scale) {
  VolumeElement e;
  e.vertices = {0, 1, 2, 3};
  e.rest = rest;
  e.scale = scale;
  e.stiffness = 2.0;
  return e;
}

// Eq. 8: E_V = k_V / 2 (1/6 (p_j - p_i) . ((p_k - p_i) x (p_l - p_i)) - V_0)^2 / V_0^2.
TEST(Volume, Equation8ByHand) {
  const std::vector<Vector3> x = {{1, 1, 1}, {3, 1, 1}, {1, 4, 1}, {1, 1, 5}};  // 2 * 3 * 4 / 6 = 4
  ElementVectors<VolumeElement> gradient;
  EXPECT_DOUBLE_EQ(element(2.0, 2.0).evaluate({x[0], x[1], x[2], x[3]}, gradient), 1.0);
  EXPECT_DOUBLE_EQ(energy_of(element(2.0, 2.0), x), 1.0);
  EXPECT_DOUBLE_EQ(energy_of(element(4.0, 4.0), x), 0.0);
  // A corner is a height over a third of the opposite face.
  EXPECT_LT((gradient[1] - Vector3(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((gradient[2] - Vector3(0, 2.0 / 3.0, 0)).norm(), 1e-15);
  EXPECT_LT((gradient[3] - Vector3(0, 0, 0.5)).norm(), 1e-15);
}

TEST(Volume, TurnedInsideOutItIsNegative) {
  const std::vector<Vector3> x = {{1, 1, 1}, {1, 4, 1}, {3, 1, 1}, {1, 1, 5}};
  EXPECT_DOUBLE_EQ(energy_of(element(2.0, 2.0), x), 9.0);
}

TEST(Volume, OwesWhatEveryElementOwes) {
  expect_all_that_elements_owe<VolumeElement>(0.2);
  expect_all_that_elements_owe<VolumeElement>(0.0);
}

TEST(Volume, BlocksAreTheSecondDerivative) {
  expect_blocks_bound_the_second_derivative<VolumeElement>(0.2, true);
}

TEST(Volume, AFlatFlapIsFiniteAndResistsBending) {
  const VolumeElement flap = element(0.0, 0.1);
  std::vector<Vector3> x = {{0, -1, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}};
  const std::vector<Vector3> still(4, Vector3::Zero());
  EXPECT_EQ(energy_of(flap, x), 0.0);
  EXPECT_EQ(largest(forces_of(flap, x, still)), 0.0);
  for (const double up : {0.1, -0.1}) {  // one side folded up or down: pushed back
    x[2].z() = up;
    EXPECT_GT(energy_of(flap, x), 0.0);
    EXPECT_LT(forces_of(flap, x, still)[2].z() * up, 0.0);
  }
}

}  // namespace
}  // namespace tissue_sim::volume_test
