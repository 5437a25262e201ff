#ifdef __x86_64__

#define TISSUE_SIM_TARGET __attribute__((target("avx512f,avx512vl")))

#include "constraint_eight.h"
#include "constraint_kernels.h"

namespace tissue_sim {

TISSUE_SIM_TARGET void add_constraint_forces_avx512(const ConstraintBatches& batches, const ChosenConstraints& chosen,
                                                    const VertexMotion* motions, VertexPull* pulls,
                                                    EnclosedShare* shares) {
  add_chosen(batches, chosen, motions, pulls, shares);
}

}  // namespace tissue_sim

#endif
