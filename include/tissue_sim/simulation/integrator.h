#pragma once

#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

/// How many substeps a step of `duration` (s) takes: as many as the stable substep asks for; 1 where nothing is
/// integrated.
int substeps_for(const RestShape& rest, double duration);

/// Writes the forces (N) of all elements on all vertices. Returns the elastic energy (J). `gradient` is room for the
/// enclosed volume's.
double element_forces(const RestShape& rest, const OrganState& state, std::vector<Vector3>& forces,
                      std::vector<Vector3>& gradient);

/// One explicit (symplectic) substep of dt (s): v += dt (f/m + g), slowed by the drag, then x += dt v. Attached and
/// held vertices stay. Returns the largest speed of a vertex that moved, m/s.
double integrate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                 OrganState& state);

}  // namespace tissue_sim
