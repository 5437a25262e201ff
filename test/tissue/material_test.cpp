#include "tissue_sim/tissue/material.h"

#include <gtest/gtest.h>

namespace tissue_sim::material_test {
namespace {

Material material(double young, double poisson) {
  Material m;
  m.young = young;
  m.poisson = poisson;
  return m;
}

TEST(WallStiffness, OneThirdNeedsNoAreaElements) {
  const WallStiffness wall = wall_stiffness(material(9000.0, 1.0 / 3.0), 0.002);
  EXPECT_NEAR(wall.distance, 3.0 * 9000.0 * 0.002, 1e-12);  // E h = sigma_D / 3
  EXPECT_NEAR(wall.area, 0.0, 1e-12);
  EXPECT_DOUBLE_EQ(wall.membrane, 18.0);
}

/// The plane's Young's modulus and Poisson's ratio, back from mu = sigma_D / 8 and lambda = sigma_D / 8 + sigma_A.
TEST(WallStiffness, GivesBackWhatItWasAskedFor) {
  for (const double nu : {1.0 / 3.0, 0.4, 0.45, 0.49}) {
    const WallStiffness wall = wall_stiffness(material(255e3, nu), 0.0025);
    const double mu = wall.distance / 8.0;
    const double lambda = wall.distance / 8.0 + wall.area;
    EXPECT_NEAR(4.0 * mu * (lambda + mu) / (lambda + 2.0 * mu), 255e3 * 0.0025, 1e-9);
    EXPECT_NEAR(lambda / (lambda + 2.0 * mu), nu, 1e-12);
  }
}

TEST(WallStiffness, BendsAsAPlate) {
  EXPECT_NEAR(wall_stiffness(material(12e3, 0.5), 0.01).bending, 12e3 * 1e-6 / (12.0 * 0.75), 1e-15);
}

TEST(WallStiffness, IsNeverNegative) {
  for (const double nu : {0.0, 0.1, 0.25, 0.33}) EXPECT_GE(wall_stiffness(material(1.0, nu), 1.0).area, 0.0);
}

}  // namespace
}  // namespace tissue_sim::material_test
