#pragma once

#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// What the elements of a solid cost: forces of one explicit substep, or one sweep of vertex block descent.
struct ElementCost {
  Model model = Model::fem;
  Integrator integrator = Integrator::explicit_substeps;
  int tetrahedra = 0;
  double seconds = 0.0;  ///< the least of many repetitions
};

/// `fem` and `volume` by both integrators on one block of 24,000 tetrahedra, slightly deformed, on one core.
std::vector<ElementCost> time_elements();

}  // namespace tissue_sim
