#pragma once

#include <vector>

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/contact/delassus_matrix.h"

namespace tissue_sim {

/// Moves every contact point out of its instrument, along its direction, its vertices sharing the way by weight and
/// mobility (inverse mass): Gauss-Seidel over the points in order. Returns the farthest way of a vertex, m. `held`, if
/// given, gets 1 for every vertex that moved.
double push_out(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                std::vector<Vector3>& positions, std::vector<char>* held);

/// What the two functions below need: the matrix of exactly their points, to be built whenever those are others, and
/// room. Without points neither does anything.
struct ResponseRoom {
  DelassusMatrix delassus;
  std::vector<double> lacking;
  std::vector<double> impulses;
};

/// Gives every contact point at least the velocity along its direction at which it keeps ahead of the instrument for
/// the next dt (s): the instrument's, less what closes the gap that is there (inelastic, frictionless, never pulling).
/// Records the impulse of each, and starts from the one that is there; over dt it is the force at rest. Taken from
/// velocities and not from the displacement of push_out, since an instrument that appears inside an organ moves it far
/// without any force that a hand could feel.
void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        const std::vector<Vector3>& positions, double dt, std::vector<Vector3>& velocities,
                        ResponseRoom& room);

/// The force (N) at every contact point that holds the tissue's own forces at the bearing vertices: non-negative, along
/// the point's direction, on the organ. At rest that is what the instrument feels, free of time step, mass and damping;
/// where points share vertices it is divided so that no vertex is driven into an instrument. Starts from the forces
/// that are there.
void bear_forces(const std::vector<double>& inverse_mass, const std::vector<Vector3>& forces,
                 std::vector<ContactPoint>& points, ResponseRoom& room);

}  // namespace tissue_sim
