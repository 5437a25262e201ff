#pragma once

#include <immintrin.h>

#include "constraint_lanes.h"

/// Eight lanes, for the sources that compile constraint_kernels.h for 32-byte registers.
namespace tissue_sim {
namespace {

using Lane = Eight;

TISSUE_SIM_TARGET TISSUE_SIM_INLINE __m256 load_two(const float* low, const float* high) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(low)), _mm_load_ps(high), 1);
}

/// Half by half what four lanes do: lanes 0 to 3 and 4 to 7.
TISSUE_SIM_TARGET TISSUE_SIM_INLINE void gather(const float* floats, const int* places, Gathered<Lane>& gathered) {
  const __m256 a = load_two(floats + places[0], floats + places[4]);
  const __m256 b = load_two(floats + places[1], floats + places[5]);
  const __m256 c = load_two(floats + places[2], floats + places[6]);
  const __m256 d = load_two(floats + places[3], floats + places[7]);
  const __m256 ab = _mm256_unpacklo_ps(a, b);
  const __m256 cd = _mm256_unpacklo_ps(c, d);
  const __m256 abz = _mm256_unpackhi_ps(a, b);
  const __m256 cdz = _mm256_unpackhi_ps(c, d);
  gathered.vectors.x = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(1, 0, 1, 0));
  gathered.vectors.y = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(3, 2, 3, 2));
  gathered.vectors.z = _mm256_shuffle_ps(abz, cdz, _MM_SHUFFLE(1, 0, 1, 0));
  gathered.fourth = _mm256_shuffle_ps(abz, cdz, _MM_SHUFFLE(3, 2, 3, 2));
}

TISSUE_SIM_TARGET TISSUE_SIM_INLINE void take_two(const __m256& both, Quad& low, Quad& high) {
  low = _mm256_castps256_ps128(both);
  high = _mm256_extractf128_ps(both, 1);
}

/// Vectors lane by lane, the fourth component zero.
TISSUE_SIM_TARGET TISSUE_SIM_INLINE void to_quads(const Three<Lane>& rows, Quad* quads) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 xy = _mm256_unpacklo_ps(rows.x, rows.y);
  const __m256 zw = _mm256_unpacklo_ps(rows.z, zero);
  const __m256 xy2 = _mm256_unpackhi_ps(rows.x, rows.y);
  const __m256 zw2 = _mm256_unpackhi_ps(rows.z, zero);
  take_two(_mm256_shuffle_ps(xy, zw, _MM_SHUFFLE(1, 0, 1, 0)), quads[0], quads[4]);
  take_two(_mm256_shuffle_ps(xy, zw, _MM_SHUFFLE(3, 2, 3, 2)), quads[1], quads[5]);
  take_two(_mm256_shuffle_ps(xy2, zw2, _MM_SHUFFLE(1, 0, 1, 0)), quads[2], quads[6]);
  take_two(_mm256_shuffle_ps(xy2, zw2, _MM_SHUFFLE(3, 2, 3, 2)), quads[3], quads[7]);
}

TISSUE_SIM_TARGET TISSUE_SIM_INLINE bool any_above(const Lane& x, const Lane& limit) {
  return _mm256_movemask_ps(_mm256_cmp_ps(x, limit, _CMP_GT_OQ)) != 0;
}

TISSUE_SIM_TARGET TISSUE_SIM_INLINE void root(const Lane& x, Lane& of_x) {
  of_x = _mm256_sqrt_ps(x);
}

}  // namespace
}  // namespace tissue_sim
