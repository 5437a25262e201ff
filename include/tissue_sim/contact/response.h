#pragma once

#include <vector>

#include "tissue_sim/contact/contact_point.h"

namespace tissue_sim {

/// Moves every contact point out of its instrument, along its direction, its vertices sharing the way by weight and
/// mobility (inverse mass): Gauss-Seidel over the points in order. Returns the farthest way of a vertex, m. `held`, if
/// given, gets 1 for every vertex that moved.
double push_out(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                std::vector<Vector3>& positions, std::vector<char>* held);

/// Gives every contact point at least the instrument's velocity along its direction (inelastic, frictionless, never
/// pulling) and records the impulse of each. At rest that impulse over the substep is the elastic force: m dx / dt^2 of
/// what the elements moved the vertex by since the last response. Taken from velocities and not from the displacement
/// of push_out, since an instrument that appears inside an organ moves it far without any force that a hand could feel.
void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        std::vector<Vector3>& velocities);

}  // namespace tissue_sim
