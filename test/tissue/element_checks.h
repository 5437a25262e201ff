#pragma once

#include <gtest/gtest.h>

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

/// The force is minus the slope of the energy, by central differences.
template <class Kind>
void expect_force_is_minus_slope(double rest) {
  Random random(1);
  constexpr double h = 1e-5;
  for (int round = 0; round < 300; ++round) {
    const Kind element = random_element<Kind>(random, rest);
    std::vector<Vector3> x = random_corners<Kind>(random);
    const std::vector<Vector3> still(x.size(), Vector3::Zero());
    const std::vector<Vector3> forces = forces_of(element, x, still);
    const double size = std::max(largest(forces), 1e-3);
    for (std::size_t i = 0; i < Kind::size; ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const double at = x[i][axis];
        x[i][axis] = at + h;
        const double above = energy_of(element, x);
        x[i][axis] = at - h;
        const double below = energy_of(element, x);
        x[i][axis] = at;
        EXPECT_NEAR(forces[i][axis], -(above - below) / (2.0 * h), 1e-6 * size);
      }
    }
  }
}

/// Inner forces move nothing as a whole and turn nothing as a whole, damping included.
template <class Kind>
void expect_forces_balance(double rest) {
  Random random(2);
  for (int round = 0; round < 300; ++round) {
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
    EXPECT_LT(force.norm(), 1e-12 * largest(forces));
    EXPECT_LT(torque.norm(), 1e-12 * largest(forces));
  }
}

/// The element's energy is the same wherever it stands and however it is turned; a rigid velocity is not damped.
template <class Kind>
void expect_rigid_motion_is_free(double rest) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    Kind element = random_element<Kind>(random, rest);
    std::vector<Vector3> x = random_corners<Kind>(random);
    const double energy = energy_of(element, x);
    const Pose pose = random_pose(random, 1.0);
    for (Vector3& p : x) p = pose.apply(p);
    EXPECT_NEAR(energy_of(element, x), energy, 1e-12 * (1.0 + energy));

    const Vector3 velocity = random_point(random);
    const Vector3 spin = random_point(random);
    std::vector<Vector3> v;
    for (const Vector3& p : x) v.push_back(velocity + spin.cross(p));
    element.stiffness = 0.0;
    element.damping = 1.0;
    EXPECT_LT(largest(forces_of(element, x, v)), 1e-12 * (1.0 + 1.0 / (element.scale * element.scale)));
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

template <class Kind>
void expect_all_that_elements_owe(double rest) {
  expect_force_is_minus_slope<Kind>(rest);
  expect_forces_balance<Kind>(rest);
  expect_rigid_motion_is_free<Kind>(rest);
  expect_damping_takes_energy_out<Kind>(rest);
}

}  // namespace tissue_sim
