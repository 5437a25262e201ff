#pragma once

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Energy (J) stored in all elements of the organ at the given positions.
double elastic_energy(const RestShape& rest, const std::vector<Vector3>& positions);

/// The same with room for a vector a vertex, whose contents are lost: allocates nothing.
double elastic_energy(const RestShape& rest, const std::vector<Vector3>& positions, std::vector<Vector3>& room);

}  // namespace tissue_sim
