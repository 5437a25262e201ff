#pragma once

#include <cstddef>

#include "lanes.h"
#include "tissue_sim/tissue/constraint_batch.h"

namespace tissue_sim {

/// Which batches: `count` of them, those in `list` or, without one, from `first` on.
struct ChosenBatches {
  const int* list;
  std::size_t count;
  std::size_t first = 0;
  std::size_t operator[](std::size_t i) const {
    return list != nullptr ? static_cast<std::size_t>(list[i]) : first + i;
  }
};

struct ChosenConstraints {
  ChosenBatches pairs, flaps, triangles, distances;
};

/// One for each InstructionSet, in a source of its own.
using AddConstraintForces = void(const ConstraintBatches& batches, const ChosenConstraints& chosen,
                                 const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares);
AddConstraintForces add_constraint_forces_baseline;
#ifdef __x86_64__
AddConstraintForces add_constraint_forces_avx2;
AddConstraintForces add_constraint_forces_avx512;
#endif

namespace {

/// One vector of each lane's vertex, and the number that follows it there.
template <class Lane>
struct Gathered {
  Three<Lane> vectors;
  Lane fourth;
};

}  // namespace
}  // namespace tissue_sim
