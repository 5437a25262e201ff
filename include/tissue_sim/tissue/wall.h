#pragma once

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Adds the elements and masses of a hollow organ's wall: distances on its edges, areas on its triangles, a flap at
/// each edge for its bending, and the enclosed volume.
void add_wall(const Organ& organ, RestShape& shape);

}  // namespace tissue_sim
