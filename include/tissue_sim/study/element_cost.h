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

/// The elements of one explicit substep, in batches and one by one, and what a machine could do at best.
struct SubstepCost {
  const char* organ = "";
  int elements = 0;
  double seconds = 0.0;        ///< element_forces(), the least of many repetitions
  double plain_seconds = 0.0;  ///< the plain elements in double, one after another
  double bytes = 0.0;          ///< read or written, every array once
  double operations = 0.0;     ///< floating point: sums, products, quotients and roots, each one
};

/// Measured on one core with the registers that the elements use.
struct MachineLimit {
  double bytes_per_second = 0.0;         ///< a = b + s c over arrays that the last level of cache does not hold
  double cached_bytes_per_second = 0.0;  ///< the same over 1 MB, as much as the batches of 8,000 triangles
  double operations_per_second = 0.0;    ///< sums and products that do not wait for each other, as many of each
};

/// A sphere of 8,064 triangles as `surface`, and the block above as `volume` and `fem`.
std::vector<SubstepCost> time_substeps();

MachineLimit measure_machine();

/// One explicit substep of a large organ by one thread and by two, in turn.
struct ThreadsCost {
  const char* organ = "";
  int elements = 0;
  double seconds = 0.0;      ///< of one thread, the least of many repetitions
  double two_seconds = 0.0;  ///< of two
};

/// The block in finer cells, 81,000 tetrahedra, as `fem`, and a sphere of 20,000 triangles as `surface`.
std::vector<ThreadsCost> time_threads();

/// s, what the substep would take if it only moved its bytes through the cache or only did its operations, whichever is
/// longer.
double least_possible(const SubstepCost& cost, const MachineLimit& limit);

}  // namespace tissue_sim
