#pragma once

#include <vector>

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// Some of an organ's simulated vertices are moved a little, the others go where they are pulled.
struct PatchTest {
  std::vector<char> moved;             ///< one a vertex: held at its displacement
  std::vector<Vector3> displacements;  ///< m, where moved, else zero
};

/// One end of the organ along `axis` (its outermost tenth) is held, the other is moved along the axis `along`.
PatchTest pull_ends(const RestShape& shape, int axis, int along);

/// The energy (J) that the organ's elements hold in the test, in linear elasticity at rest, by conjugate gradients on
/// what is free.
double patch_energy(const RestShape& shape, const PatchTest& test);

}  // namespace tissue_sim
