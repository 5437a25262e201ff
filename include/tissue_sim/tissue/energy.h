#pragma once

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Energy (J) stored in all elements of the organ at the given positions.
double elastic_energy(const RestShape& rest, const std::vector<Vector3>& positions);

}  // namespace tissue_sim
