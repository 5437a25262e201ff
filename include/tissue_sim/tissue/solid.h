#pragma once

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Adds the elements and masses of a solid organ. `fem`: a stable neo-Hookean tetrahedron for each. `volume`: the
/// paper's distance energy on each edge and its volume energy in each tetrahedron.
///
/// A sliver is softened: its modulus counts with the square of its smallest height over a tenth of its longest edge. It
/// fills next to nothing, and as it is it would set the substep of the whole organ.
void add_solid(const Organ& organ, RestShape& shape);

}  // namespace tissue_sim
