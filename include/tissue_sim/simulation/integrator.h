#pragma once

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

/// How many substeps a step of `duration` (s) takes: as many as the stable substep asks for, more where a solid has
/// been `stiffening` (see below; 0: has no contact); 1 where nothing is integrated.
int substeps_for(const RestShape& rest, double duration, double stiffening = 0.0);

/// How much stiffer than the stiffest tetrahedron at rest the stiffest at a contact is now, as squared frequency. Where
/// a thin instrument presses deep into small tetrahedra that is far beyond what the substep at rest is stable for.
/// `tetrahedra_at` lists the tetrahedra at each vertex.
double stiffening(const RestShape& rest, const FlatLists& tetrahedra_at, const std::vector<ContactPoint>& points,
                  const std::vector<Vector3>& positions);

/// Room for element_forces(), one entry a vertex; empty where the organ's elements need none.
struct ElementRoom {
  std::vector<Vector3> gradient;               ///< of the enclosed volume
  std::vector<Eigen::Vector4f> displacements;  ///< m, of tetrahedra
  std::vector<Eigen::Vector4f> forces;         ///< N, of tetrahedra
};
void prepare(ElementRoom& room, const RestShape& rest);

/// Writes the forces (N) of all elements, damping included, on all vertices.
void element_forces(const RestShape& rest, const OrganState& state, std::vector<Vector3>& forces, ElementRoom& room);

/// Writes into `room` the forces (N) of the awake batches of tetrahedra on the free vertices of a region.
void region_forces(const RestShape& rest, const std::vector<Vector3>& positions, const std::vector<Vector3>& velocities,
                   const ActiveRegion& region, ElementRoom& room);

/// The first half of an explicit (symplectic) substep of dt (s): v += dt (f/m + g), slowed by the drag. Attached and
/// held vertices stay.
void accelerate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                OrganState& state);

/// The second half: x += dt v. Returns the largest speed of a vertex that moved, m/s.
double advance(const OrganModel& organ, double dt, OrganState& state);

}  // namespace tissue_sim
