#pragma once

#include <vector>

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

Incidence build_incidence(const RestShape& rest);

/// Room for descend(), one entry a vertex; holds nothing between two calls.
struct DescentRoom {
  std::vector<Vector3> start;     ///< m, positions at the start of the step
  std::vector<Vector3> inertial;  ///< m, where the vertex would go without elements
  std::vector<Vector3> scratch;   ///< for what is computed for all vertices and of no use
  std::vector<int> first_of;      ///< into `pressing`, the first of the vertex's; -1: none
  /// m, from rest, + damping_time velocities: of these tetrahedra make their forces. Empty where there are none.
  std::vector<Eigen::Vector4f> displacements;
  struct Pressing {
    int point;      ///< of the contact points
    double weight;  ///< of the vertex in it
    int next;       ///< the vertex's next, or -1
    bool active;    ///< it presses on the vertex that is being moved
  };
  std::vector<Pressing> pressing;
};

void prepare(DescentRoom& room, const RestShape& rest);

/// One implicit step of dt (s) by vertex block descent (Chen et al., "Vertex Block Descent", 2024): sweeps over the
/// vertices, one a millisecond, that each put one vertex where the energy of the step, 1/2 m/dt^2 |x - inertial|^2 +
/// elements, is lowest to second order, its neighbours held. Each block is positive definite, so no sweep raises that
/// energy much and any dt is stable; what one sweep leaves, the next step takes up.
///
/// A contact point that one vertex bears is met exactly. Those that several share are kept in front of the instrument
/// by an augmented Lagrangian: a force that is remembered in `point.force` (N; what it was in the step before, or 0)
/// grows until the gap is closed, so that nothing is left of a penalty's error at rest.
///
/// Attached and held vertices stay. Returns the largest speed of a vertex that moved, m/s.
double descend(const OrganModel& organ, const Vector3& gravity, double dt, std::vector<ContactPoint>& points,
               OrganState& state, DescentRoom& room);

/// Writes the forces (N) of all elements, without damping, on the vertices that bear a contact point. Those of
/// tetrahedra are good to seven digits of the stresses that meet at a vertex.
void bearing_forces(const OrganModel& organ, const std::vector<ContactPoint>& points, const OrganState& state,
                    DescentRoom& room, std::vector<Vector3>& forces);

}  // namespace tissue_sim
