#include "tissue_sim/tissue/neo_hookean.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "geometry/twins.h"

namespace tissue_sim::neo_hookean_test {
namespace {

using Vectors = NeoHookeanElement::Vectors;

constexpr double edge_length = 0.004;  // m

class NeoHookean : public testing::Test {
 protected:
  Vector3 random_vector(double size) { return random_point(random, size); }
  Matrix3 random_matrix(double size) {
    Matrix3 m;
    m << random_vector(size), random_vector(size), random_vector(size);
    return m;
  }
  Matrix3 random_rotation() { return random_pose(random, 0.0).orientation.toRotationMatrix(); }
  /// A corner of a cube, each vertex moved by at most a fifth of the edge.
  Vectors random_rest() {
    return {random_vector(0.2 * edge_length), edge_length * Vector3::UnitX() + random_vector(0.2 * edge_length),
            edge_length * Vector3::UnitY() + random_vector(0.2 * edge_length),
            edge_length * Vector3::UnitZ() + random_vector(0.2 * edge_length)};
  }
  /// Anything, inverted about half the time.
  Vectors random_state() {
    return {random_vector(edge_length), random_vector(edge_length), random_vector(edge_length),
            random_vector(edge_length)};
  }

  const LameModuli liver = lame_moduli(5400.0, 0.45);
  Random random{7};
};

Vectors moved(const Vectors& x, const Matrix3& f, const Vector3& shift) {
  Vectors result;
  for (std::size_t i = 0; i < 4; ++i) result[i] = f * x[i] + shift;
  return result;
}

double largest(const Vectors& v) {
  double result = 0.0;
  for (const Vector3& w : v) result = std::max(result, w.norm());
  return result;
}

/// First Piola-Kirchhoff stress (Pa), from the forces at the corners alone.
Matrix3 stress(const NeoHookeanElement& element, const Vectors& rest, const Vectors& x) {
  Vectors gradient;
  element.evaluate(x, gradient);
  Matrix3 sum = Matrix3::Zero();
  for (std::size_t i = 0; i < 4; ++i) sum += gradient[i] * rest[i].transpose();
  return sum / element.volume;
}

TEST_F(NeoHookean, ModuliOfYoungAndPoisson) {
  const LameModuli m = lame_moduli(5400.0, 0.45);
  EXPECT_NEAR(m.mu * (3.0 * m.lambda + 2.0 * m.mu) / (m.lambda + m.mu), 5400.0, 1e-9);
  EXPECT_NEAR(m.lambda / (2.0 * (m.lambda + m.mu)), 0.45, 1e-12);
}

TEST_F(NeoHookean, ShapeGradientsGiveTheDeformationGradient) {
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
  const Vectors x = random_state();
  Matrix3 f = Matrix3::Zero();
  for (std::size_t i = 0; i < 4; ++i) f += x[i] * element.shape_gradient(i).transpose();
  EXPECT_LT((f - element.deformation_gradient(x)).norm(), 1e-12 * f.norm());
}

TEST_F(NeoHookean, VolumeAndDeformationOfAnAffineMap) {
  const Vectors rest = random_rest();
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
  const Matrix3 f = random_matrix(1.0);
  EXPECT_LT((element.deformation_gradient(moved(rest, f, random_vector(1.0))) - f).norm(), 1e-11);
  EXPECT_NEAR(element.volume, (rest[1] - rest[0]).cross(rest[2] - rest[0]).dot(rest[3] - rest[0]) / 6.0,
              1e-14 * element.volume);
}

TEST_F(NeoHookean, EnergyIsTheFormula) {
  const Vectors rest = random_rest();
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
  for (int trial = 0; trial < 100; ++trial) {
    const Matrix3 f = random_matrix(1.5);
    const double j = f.determinant();
    const double expected =
        element.volume * (0.5 * liver.mu * ((f.transpose() * f).trace() - 3.0) - liver.mu * (j - 1.0) +
                          0.5 * (liver.lambda + liver.mu) * (j - 1.0) * (j - 1.0));
    Vectors gradient;
    EXPECT_NEAR(element.evaluate(moved(rest, f, Vector3::Zero()), gradient), expected,
                1e-11 * element.volume * liver.lambda);
  }
}

TEST_F(NeoHookean, GradientIsTheDerivativeOfTheEnergy) {
  for (int trial = 0; trial < 100'000; ++trial) {
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
    Vectors x = random_state();
    Vectors gradient;
    Vectors ignored;
    element.evaluate(x, gradient);
    const double scale = largest(gradient);
    for (std::size_t i = 0; i < 4; ++i) {
      for (int a = 0; a < 3; ++a) {
        const double h = 1e-5 * edge_length;
        const double middle = x[i][a];
        x[i][a] = middle + h;
        const double above = element.evaluate(x, ignored);
        x[i][a] = middle - h;
        const double below = element.evaluate(x, ignored);
        x[i][a] = middle;
        // The energy is quadratic in each corner, so the central difference has rounding errors only.
        ASSERT_NEAR(gradient[i][a], (above - below) / (2.0 * h), 1e-8 * scale);
      }
    }
  }
}

TEST_F(NeoHookean, BlocksAreTheDerivativeOfTheGradient) {
  for (int trial = 0; trial < 50; ++trial) {
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
    Vectors x = random_state();
    for (std::size_t j = 0; j < 4; ++j) {
      std::array<Matrix3, 4> differences;
      for (int a = 0; a < 3; ++a) {
        const double h = 1e-5 * edge_length;
        const double middle = x[j][a];
        Vectors above;
        Vectors below;
        x[j][a] = middle + h;
        element.evaluate(x, above);
        x[j][a] = middle - h;
        element.evaluate(x, below);
        x[j][a] = middle;
        for (std::size_t i = 0; i < 4; ++i) differences[i].col(a) = (above[i] - below[i]) / (2.0 * h);
      }
      const double scale = element.block(x, j).norm();
      for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((element.block(x, i, j) - differences[i]).norm(), 1e-7 * scale);
      EXPECT_LT((element.block(x, j) - differences[j]).norm(), 1e-7 * scale);
    }
  }
}

TEST_F(NeoHookean, RestCostsNothing) {
  for (int trial = 0; trial < 20; ++trial) {
    const Vectors rest = random_rest();
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
    Vectors gradient;
    EXPECT_NEAR(element.evaluate(rest, gradient), 0.0, 1e-12 * element.volume * liver.lambda);
    EXPECT_LT(largest(gradient), 1e-12 * liver.lambda * edge_length * edge_length);
  }
}

TEST_F(NeoHookean, RigidMotionCostsNothingAndMakesNoForce) {
  for (int trial = 0; trial < 100'000; ++trial) {
    const Vectors rest = random_rest();
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
    Vectors gradient;
    ASSERT_NEAR(element.evaluate(moved(rest, random_rotation(), random_vector(0.01)), gradient), 0.0,
                1e-12 * element.volume * liver.lambda);
    ASSERT_LT(largest(gradient), 1e-12 * liver.lambda * edge_length * edge_length);
  }
}

TEST_F(NeoHookean, TurningTheStateTurnsTheForces) {
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
  const Vectors x = random_state();
  const Matrix3 turn = random_rotation();
  Vectors gradient;
  Vectors turned;
  const double energy = element.evaluate(x, gradient);
  EXPECT_EQ(element.energy(x), energy);
  EXPECT_NEAR(element.evaluate(moved(x, turn, random_vector(0.01)), turned), energy, 1e-10 * energy);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((turned[i] - turn * gradient[i]).norm(), 1e-10 * largest(gradient));
}

/// Uniaxial stress along x: the sides are free, so they narrow until the lateral stress is gone.
TEST_F(NeoHookean, YoungsModulusAndPoissonsRatioAtSmallStrain) {
  const double strain = 1e-5;
  for (const double poisson : {0.0, 0.3, 0.45, 0.49}) {
    const double young = 5400.0;
    const Vectors rest = random_rest();
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, lame_moduli(young, poisson));
    const auto at_narrowing = [&](double narrowing) {
      const Matrix3 f = Vector3(1.0 + strain, 1.0 - narrowing, 1.0 - narrowing).asDiagonal();
      return stress(element, rest, moved(rest, f, Vector3::Zero()));
    };
    double a = -strain;
    double b = strain;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (a + b);
      (at_narrowing(middle)(1, 1) > 0.0 ? a : b) = middle;
    }
    const Matrix3 p = at_narrowing(a);
    EXPECT_NEAR(p(0, 0) / strain, young, 1e-3 * young) << poisson;
    EXPECT_NEAR(a / strain, poisson, 1e-3 * std::max(poisson, 0.1));
    EXPECT_NEAR(p(2, 2), 0.0, 1e-6 * p(0, 0));
  }
}

TEST_F(NeoHookean, ShearModulusAtSmallStrain) {
  const Vectors rest = random_rest();
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
  Matrix3 f = Matrix3::Identity();
  f(0, 1) = 1e-5;
  EXPECT_NEAR(stress(element, rest, moved(rest, f, Vector3::Zero()))(0, 1) / 1e-5, liver.mu, 1e-3 * liver.mu);
}

TEST_F(NeoHookean, ForcesAndTorquesSumToZero) {
  for (int trial = 0; trial < 100'000; ++trial) {
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
    const Vectors x = random_state();
    Vectors gradient;
    element.evaluate(x, gradient);
    Vector3 force = Vector3::Zero();
    Vector3 torque = Vector3::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      force += gradient[i];
      torque += x[i].cross(gradient[i]);
    }
    ASSERT_LT(force.norm(), 1e-12 * largest(gradient));
    ASSERT_LT(torque.norm(), 1e-12 * edge_length * largest(gradient));
  }
}

TEST_F(NeoHookean, FiniteAndPushingOutWhenCollapsed) {
  const Vectors rest = random_rest();
  const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, rest, liver);
  const Vector3 collapsed[] = {{1, 1, 0}, {1, 0, 0}, {0, 0, 0}, {1, 1, -1}, {-1, -1, -1}, {3, 3, -3}};
  for (const Vector3& stretches : collapsed) {
    const Vectors x = moved(rest, stretches.asDiagonal(), Vector3::Zero());
    Vectors gradient;
    const double energy = element.evaluate(x, gradient);
    EXPECT_TRUE(std::isfinite(energy)) << stretches.transpose();
    EXPECT_GT(energy, 0.0) << stretches.transpose();
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_TRUE(gradient[i].allFinite()) << stretches.transpose();
      EXPECT_TRUE(element.block(x, i).allFinite()) << stretches.transpose();
      for (std::size_t j = 0; j < 4; ++j) EXPECT_TRUE(element.block(x, i, j).allFinite()) << stretches.transpose();
    }
  }
  // Flattened to a plane, P = F - (1 + L / mu) C times mu has its only normal part in -C: it pushes apart.
  const Matrix3 flat = stress(element, rest, moved(rest, Vector3(1, 1, 0).asDiagonal(), Vector3::Zero()));
  EXPECT_NEAR(flat(2, 2), -(liver.lambda + 2.0 * liver.mu), 1e-9 * liver.lambda);
}

TEST_F(NeoHookean, BlockOfACornerIsPositiveDefiniteEverywhere) {
  int inverted = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const auto element = NeoHookeanElement::at_rest({0, 1, 2, 3}, random_rest(), liver);
    const Vectors x = random_state();
    inverted += element.deformation_gradient(x).determinant() < 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Matrix3 block = element.block(x, i);
      const Vector3 eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix3>(block).eigenvalues();
      const double floor = element.volume * liver.mu * element.shape_gradient(i).squaredNorm();
      EXPECT_GT(eigenvalues[0], (1.0 - 1e-9) * floor);
      EXPECT_LT((block - block.transpose()).norm(), 1e-12 * block.norm());
    }
  }
  EXPECT_GT(inverted, 300);
}

}  // namespace
}  // namespace tissue_sim::neo_hookean_test
