#pragma once

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "geometry/twins.h"
#include "tissue_sim/tissue/element.h"

/// What every kind of element owes, whatever its constraint.
namespace tissue_sim {

template <class Kind>
double energy_of(const Kind& element, const std::vector<Vector3>& positions) {
  ElementVectors<Kind> gradient;
  const double c = element.evaluate(gather(element, positions), gradient);
  return 0.5 * element.stiffness * c * c;
}

template <class Kind>
std::vector<Vector3> forces_of(const Kind& element, const std::vector<Vector3>& positions,
                               const std::vector<Vector3>& velocities) {
  std::vector<Vector3> forces(positions.size(), Vector3::Zero());
  add_forces(element, {std::vector<double>(positions.size(), 0.0), 0.0}, positions, velocities, forces);
  return forces;
}

inline double largest(const std::vector<Vector3>& vectors) {
  double norm = 0.0;
  for (const Vector3& v : vectors) norm = std::max(norm, v.norm());
  return norm;
}

template <class Kind>
Kind random_element(Random& random, double rest) {
  Kind element;
  for (std::size_t i = 0; i < Kind::size; ++i) element.vertices[i] = static_cast<int>(i);
  element.rest = rest;
  element.scale = random_in(random, 0.5, 1.5);
  element.stiffness = random_in(random, 0.5, 2.0);
  return element;
}

template <class Kind>
std::vector<Vector3> random_corners(Random& random) {
  std::vector<Vector3> corners;
  for (std::size_t i = 0; i < Kind::size; ++i) corners.push_back(random_point(random));
  return corners;
}

/// Random elements of each kind that every check looks at.
constexpr int random_elements = 100'000;

/// Slope of energy(way) at 0, by differences of fourth order; `length` is that over which the energy bends.
template <class Energy>
double slope_of(Energy&& energy, double length) {
  const double h = 1e-3 * length;
  return (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
}

/// Over which the energy bends: the smaller a length or an area, the faster its gradient turns. A volume is linear in
/// each corner.
template <class Kind>
double bending_length(const Kind& element, const std::vector<Vector3>& x) {
  if (Kind::size == 4) return 1.0;
  ElementVectors<Kind> gradient;
  return element.rest + element.scale * element.evaluate(gather(element, x), gradient);
}

/// The force is minus the slope of the energy, relative to the largest force on a corner. The energy's own rounding is
/// a few 1e-16 of it: where the element is so nearly at rest, or so nearly collapsed, that this is much of a slope, the
/// differences say nothing.
template <class Kind>
void expect_force_is_minus_slope(double rest) {
  Random random(1);
  int told = 0;
  double worst = 0.0;
  for (int round = 0; told < random_elements && round < 2 * random_elements; ++round) {
    const Kind element = random_element<Kind>(random, rest);
    std::vector<Vector3> x = random_corners<Kind>(random);
    const std::vector<Vector3> still(x.size(), Vector3::Zero());
    const std::vector<Vector3> forces = forces_of(element, x, still);
    const double length = bending_length(element, x);
    const double rounding = 1e-15 * (energy_of(element, x) + element.stiffness) / (1e-3 * length);
    if (!(rounding < 1e-7 * largest(forces))) continue;
    ++told;
    for (std::size_t i = 0; i < Kind::size; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const double at = x[i][axis];
        const auto energy = [&](double way) {
          x[i][axis] = at + way;
          return energy_of(element, x);
        };
        const double slope = slope_of(energy, length);
        x[i][axis] = at;
        worst = std::max(worst, std::abs(forces[i][axis] + slope) / largest(forces));
      }
    }
  }
  EXPECT_EQ(told, random_elements);
  EXPECT_LE(worst, 1e-6);
}

/// Inner forces move nothing as a whole and turn nothing as a whole, damping included.
template <class Kind>
void expect_forces_balance(double rest) {
  Random random(2);
  for (int round = 0; round < random_elements; ++round) {
    Kind element = random_element<Kind>(random, rest);
    element.damping = 0.3;
    const std::vector<Vector3> x = random_corners<Kind>(random);
    const std::vector<Vector3> forces = forces_of(element, x, random_corners<Kind>(random));
    Vector3 force = Vector3::Zero();
    Vector3 torque = Vector3::Zero();
    for (std::size_t i = 0; i < Kind::size; ++i) {
      force += forces[i];
      torque += x[i].cross(forces[i]);
    }
    ASSERT_LE(force.norm(), 1e-12 * largest(forces));
    ASSERT_LE(torque.norm(), 1e-12 * largest(forces));
  }
}

/// The element's energy is the same wherever it stands and however it is turned; a rigid velocity is not damped.
template <class Kind>
void expect_rigid_motion_is_free(double rest) {
  Random random(3);
  for (int round = 0; round < random_elements; ++round) {
    Kind element = random_element<Kind>(random, rest);
    std::vector<Vector3> x = random_corners<Kind>(random);
    const double energy = energy_of(element, x);
    const Pose pose = random_pose(random, 1.0);
    for (Vector3& p : x) p = pose.apply(p);
    ASSERT_NEAR(energy_of(element, x), energy, 1e-12 * (1.0 + energy));

    const Vector3 velocity = random_point(random);
    const Vector3 spin = random_point(random);
    std::vector<Vector3> v;
    for (const Vector3& p : x) v.push_back(velocity + spin.cross(p));
    element.stiffness = 0.0;
    element.damping = 1.0;
    ASSERT_LT(largest(forces_of(element, x, v)), 1e-12 * (1.0 + 1.0 / (element.scale * element.scale)));
  }
}

/// Damping never feeds a motion: its power on the velocities that cause it is not positive.
template <class Kind>
void expect_damping_takes_energy_out(double rest) {
  Random random(4);
  double taken = 0.0;
  for (int round = 0; round < 300; ++round) {
    Kind element = random_element<Kind>(random, rest);
    element.stiffness = 0.0;
    element.damping = 0.7;
    const std::vector<Vector3> v = random_corners<Kind>(random);
    const std::vector<Vector3> forces = forces_of(element, random_corners<Kind>(random), v);
    double power = 0.0;
    for (std::size_t i = 0; i < Kind::size; ++i) power += forces[i].dot(v[i]);
    EXPECT_LE(power, 1e-15);
    taken -= power;
  }
  EXPECT_GT(taken, 1.0);
}

/// Second derivative of the energy by one corner's position, by central differences.
template <class Kind>
Matrix3 second_difference(const Kind& element, std::vector<Vector3> x, std::size_t corner) {
  constexpr double h = 1e-4;
  const Vector3 at = x[corner];
  const auto energy_off = [&](const Vector3& way) {
    x[corner] = at + h * way;
    return energy_of(element, x);
  };
  Matrix3 result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector3 both = Vector3::Unit(i) + Vector3::Unit(j);
      const Vector3 either = Vector3::Unit(i) - Vector3::Unit(j);
      result(i, j) = (energy_off(both) - energy_off(either) - energy_off(-either) + energy_off(-both)) / (4.0 * h * h);
    }
  }
  return result;
}

inline double smallest_eigenvalue(const Matrix3& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Matrix3>(symmetric, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// A block never curves down, and is no less than the second derivative of the energy. Where the element is stretched,
/// and everywhere if `always_exact`, it is that.
template <class Kind>
void expect_blocks_bound_the_second_derivative(double rest, bool always_exact) {
  Random random(5);
  int exact = 0;
  int bounded = 0;
  for (int round = 0; round < 300; ++round) {
    const Kind element = random_element<Kind>(random, rest);
    const std::vector<Vector3> x = random_corners<Kind>(random);
    ElementVectors<Kind> gradient;
    const double c = element.evaluate(gather(element, x), gradient);
    if (std::abs(element.rest + c * element.scale) < 0.1) continue;  // too small for the differences
    for (std::size_t corner = 0; corner < Kind::size; ++corner) {
      const Matrix3 block = element.block(gather(element, x), corner);
      const Matrix3 slope = second_difference(element, x, corner);
      const double size = block.norm() + slope.norm();
      EXPECT_LT((block - block.transpose()).norm(), 1e-15 * size);
      EXPECT_GE(smallest_eigenvalue(block), -1e-14 * size);
      if (always_exact || c > 0.0) {
        ++exact;
        EXPECT_LT((block - slope).norm(), 1e-5 * size);
      } else {
        ++bounded;
        EXPECT_GE(smallest_eigenvalue(block - slope), -1e-5 * size);
      }
    }
  }
  EXPECT_GT(exact, 100);
  EXPECT_EQ(bounded > 100, !always_exact);
}

template <class Kind>
void expect_all_that_elements_owe(double rest) {
  expect_force_is_minus_slope<Kind>(rest);
  expect_forces_balance<Kind>(rest);
  expect_rigid_motion_is_free<Kind>(rest);
  expect_damping_takes_energy_out<Kind>(rest);
}

}  // namespace tissue_sim
