#pragma once

#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

/// Of what is simulated: every position and velocity is a finite number, no vertex is faster than sound in tissue, and
/// none is farther than ten times the organ's size from where it belongs.
bool healthy(const OrganModel& model, const OrganState& state);

}  // namespace tissue_sim
