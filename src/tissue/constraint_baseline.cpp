#include <cmath>

#include "constraint_lanes.h"
#ifdef __x86_64__
#include <immintrin.h>
#endif

#define TISSUE_SIM_TARGET

namespace tissue_sim {
namespace {

using Lane = Four;

TISSUE_SIM_INLINE Quad load(const float* p) {
  return *reinterpret_cast<const Quad*>(p);
}

TISSUE_SIM_INLINE void gather(const float* floats, const int* places, Gathered<Lane>& gathered) {
  const Lane a = load(floats + places[0]);
  const Lane b = load(floats + places[1]);
  const Lane c = load(floats + places[2]);
  const Lane d = load(floats + places[3]);
  const Lane ab = TISSUE_SIM_SHUFFLE(a, b, 0, 4, 1, 5);  // ax bx ay by
  const Lane cd = TISSUE_SIM_SHUFFLE(c, d, 0, 4, 1, 5);
  const Lane abz = TISSUE_SIM_SHUFFLE(a, b, 2, 6, 3, 7);
  const Lane cdz = TISSUE_SIM_SHUFFLE(c, d, 2, 6, 3, 7);
  gathered.vectors.x = TISSUE_SIM_SHUFFLE(ab, cd, 0, 1, 4, 5);
  gathered.vectors.y = TISSUE_SIM_SHUFFLE(ab, cd, 2, 3, 6, 7);
  gathered.vectors.z = TISSUE_SIM_SHUFFLE(abz, cdz, 0, 1, 4, 5);
  gathered.fourth = TISSUE_SIM_SHUFFLE(abz, cdz, 2, 3, 6, 7);
}

/// Vectors lane by lane, the fourth component zero.
TISSUE_SIM_INLINE void to_quads(const Three<Lane>& rows, Quad* quads) {
  const Lane zero{};
  const Quad xy = TISSUE_SIM_SHUFFLE(rows.x, rows.y, 0, 4, 1, 5);  // ax ay bx by
  const Quad zw = TISSUE_SIM_SHUFFLE(rows.z, zero, 0, 4, 1, 5);
  const Quad xy2 = TISSUE_SIM_SHUFFLE(rows.x, rows.y, 2, 6, 3, 7);
  const Quad zw2 = TISSUE_SIM_SHUFFLE(rows.z, zero, 2, 6, 3, 7);
  quads[0] = TISSUE_SIM_SHUFFLE(xy, zw, 0, 1, 4, 5);
  quads[1] = TISSUE_SIM_SHUFFLE(xy, zw, 2, 3, 6, 7);
  quads[2] = TISSUE_SIM_SHUFFLE(xy2, zw2, 0, 1, 4, 5);
  quads[3] = TISSUE_SIM_SHUFFLE(xy2, zw2, 2, 3, 6, 7);
}

TISSUE_SIM_INLINE bool any_above(const Lane& x, const Lane& limit) {
#ifdef __x86_64__
  return _mm_movemask_ps(_mm_cmpgt_ps(x, limit)) != 0;
#else
  bool any = false;
  for (int l = 0; l < 4; ++l) any = any || x[l] > limit[l];
  return any;
#endif
}

TISSUE_SIM_INLINE void root(const Lane& x, Lane& of_x) {
#ifdef __x86_64__
  of_x = _mm_sqrt_ps(x);
#else
  for (int l = 0; l < 4; ++l) of_x[l] = std::sqrt(x[l]);
#endif
}

}  // namespace
}  // namespace tissue_sim

#include "constraint_kernels.h"

namespace tissue_sim {

void add_constraint_forces_baseline(const ConstraintBatches& batches, const ChosenConstraints& chosen,
                                    const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares) {
  add_chosen(batches, chosen, motions, pulls, shares);
}

}  // namespace tissue_sim
