#pragma once

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Of the substep that is stable at rest: a stretched surface is stiffer, and contact confines it. 0.9 was seen to go
/// unstable in a solid that contact confines. With 0.7 a solid of distances and volumes, undamped, of nu 0.499 and in
/// steps of 99 substeps, went bad under a ball once in 800 runs; with 0.66 and 0.63 in none of 1,200 each.
constexpr double surface_safety = 0.4;
constexpr double volume_safety = 0.65;
constexpr double solid_safety = 0.7;

/// Raises the mass of the few vertices that would force tiny substeps, by at most `fraction` of the organ's mass in
/// all. Vertex i can vibrate no faster than omega_i^2 = (sum over its elements of k |grad_i C| sum_j |grad_j C|) / m_i
/// (Gershgorin); the lowest common bound on omega_i that the fraction pays for is found and met.
void apply_mass_floor(double fraction, RestShape& shape);

/// y += K x, the stiffness (N/m) of all elements at rest times displacements.
void add_stiffness_product(const RestShape& shape, const std::vector<Vector3>& x, std::vector<Vector3>& y);

/// The largest frequency (rad/s) at which the organ can vibrate, undamped, taken at rest by power iteration.
double fastest_frequency(const RestShape& shape);

/// The substep (s) at which the explicit integrator stays stable, `safety` times the bound. Stability of the symplectic
/// step needs (dt omega / 2)^2 + dt lambda / 2 < 1, where omega^2 and lambda are the largest eigenvalues of stiffness
/// and damping over mass, taken at rest by power iteration; omega is the shape's `fastest_frequency`.
/// Damping may have a bound of its own, `damping_safety`: where elements may become stiffer before they are softened,
/// their damping grows with them, and counts whole where a frequency counts by its root.
double stable_substep(const RestShape& shape, double safety, double damping_safety);
inline double stable_substep(const RestShape& shape, double safety) {
  return stable_substep(shape, safety, safety);
}

/// The largest k sum |grad_i C|^2 / m_i of an element at the given positions, 1/s^2: the square of the frequency at
/// which the fastest element alone would vibrate. Areas and volumes stiffen when they are stretched.
double stiffest_element(const RestShape& shape, const std::vector<Vector3>& positions);

}  // namespace tissue_sim
