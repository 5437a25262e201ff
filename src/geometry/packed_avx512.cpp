#ifdef __x86_64__

#include <immintrin.h>

#include <algorithm>
#include <cmath>

#include "packed_triangles.h"

#define TISSUE_SIM_TARGET __attribute__((target("avx512f,avx512bw,avx512dq,avx512vl")))
#define TISSUE_SIM_KERNEL TISSUE_SIM_TARGET __attribute__((always_inline)) inline

namespace tissue_sim {
namespace {

constexpr std::size_t width = 16;

struct Vectors {
  __m512 x, y, z;
};

TISSUE_SIM_KERNEL __m512 read(const NearTriangles::Row& row, std::size_t first) {
  return _mm512_loadu_ps(row.data() + first);
}

TISSUE_SIM_KERNEL void subtract(const std::array<NearTriangles::Row, 3>& corner, std::size_t first, const FloatPoint& p,
                                Vectors& way) {
  way.x = _mm512_sub_ps(read(corner[0], first), _mm512_set1_ps(p[0]));
  way.y = _mm512_sub_ps(read(corner[1], first), _mm512_set1_ps(p[1]));
  way.z = _mm512_sub_ps(read(corner[2], first), _mm512_set1_ps(p[2]));
}

/// (a x b) . along
TISSUE_SIM_KERNEL __m512 side_of(const Vectors& a, const Vectors& b, const Vectors& along) {
  const __m512 x = _mm512_sub_ps(_mm512_mul_ps(a.y, b.z), _mm512_mul_ps(a.z, b.y));
  const __m512 y = _mm512_sub_ps(_mm512_mul_ps(a.z, b.x), _mm512_mul_ps(a.x, b.z));
  const __m512 z = _mm512_sub_ps(_mm512_mul_ps(a.x, b.y), _mm512_mul_ps(a.y, b.x));
  return _mm512_add_ps(_mm512_add_ps(_mm512_mul_ps(x, along.x), _mm512_mul_ps(y, along.y)), _mm512_mul_ps(z, along.z));
}

// With a mask of all lanes: without one g++ 12 warns of a register in its own header that is not set.
constexpr __mmask16 all_lanes = 0xFFFF;
TISSUE_SIM_KERNEL __m512 smaller(const __m512& a, const __m512& b) {
  return _mm512_maskz_min_ps(all_lanes, a, b);
}
TISSUE_SIM_KERNEL __m512 larger(const __m512& a, const __m512& b) {
  return _mm512_maskz_max_ps(all_lanes, a, b);
}

TISSUE_SIM_KERNEL void write(__mmask16 bits, std::size_t kind, std::size_t group, PointCodes& codes) {
  const auto two_bytes = static_cast<std::uint16_t>(bits);
  std::memcpy(&codes.bytes[kind][2 * group], &two_bytes, sizeof two_bytes);
}

}  // namespace

TISSUE_SIM_TARGET void code_points_avx512(const NearTriangles& near, std::size_t first, std::size_t count,
                                          const NearEdges& edges, float farthest, PointCodes* codes) {
  const __m512 unsure = _mm512_set1_ps(unsure_height(farthest));
  const __m512 minus_unsure = _mm512_set1_ps(-unsure_height(farthest));
  for (std::size_t group = 0; width * group < count; ++group) {
    const std::size_t at = first + width * group;
    __m512 lower[3], upper[3], normal[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lower[axis] = read(near.lower[axis], at);
      upper[axis] = read(near.upper[axis], at);
      normal[axis] = read(near.normal[axis], at);
    }
    const __m512 offset = read(near.offset, at);
    for (std::size_t i = 0; i < edges.point_count; ++i) {
      __m512 p[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p[axis] = _mm512_set1_ps(edges.points[i][axis]);
        write(_mm512_cmp_ps_mask(upper[axis], p[axis], _CMP_GE_OQ), 2 * axis, group, codes[i]);
        write(_mm512_cmp_ps_mask(lower[axis], p[axis], _CMP_LE_OQ), 2 * axis + 1, group, codes[i]);
      }
      const __m512 xy = _mm512_add_ps(_mm512_mul_ps(normal[0], p[0]), _mm512_mul_ps(normal[1], p[1]));
      const __m512 height = _mm512_sub_ps(_mm512_add_ps(xy, _mm512_mul_ps(normal[2], p[2])), offset);
      write(_mm512_cmp_ps_mask(height, unsure, _CMP_NGT_UQ), PointCodes::not_in_front, group, codes[i]);
      write(_mm512_cmp_ps_mask(height, minus_unsure, _CMP_NLT_UQ), PointCodes::not_behind, group, codes[i]);
    }
  }
}

TISSUE_SIM_TARGET void find_candidates_avx512(const NearEdges& edges, const PointCodes* codes, std::uint64_t all,
                                              std::size_t step, std::uint64_t* candidates) {
  static_assert(sizeof(PointCodes) == 2 * sizeof(__m256i), "two registers");
  for (std::size_t e = 0; e < edges.count; ++e) {
    const auto* p = reinterpret_cast<const __m256i_u*>(codes + edges.ends[e][0]);
    const auto* q = reinterpret_cast<const __m256i_u*>(codes + edges.ends[e][1]);
    const __m256i four = _mm256_and_si256(_mm256_or_si256(_mm256_loadu_si256(p), _mm256_loadu_si256(q)),
                                          _mm256_or_si256(_mm256_loadu_si256(p + 1), _mm256_loadu_si256(q + 1)));
    const __m128i two = _mm_and_si128(_mm256_castsi256_si128(four), _mm256_extracti128_si256(four, 1));
    const __m128i one = _mm_and_si128(two, _mm_unpackhi_epi64(two, two));
    candidates[e * step] = all & static_cast<std::uint64_t>(_mm_cvtsi128_si64(one));
  }
}

TISSUE_SIM_TARGET std::size_t keep_within_rims_avx512(const NearTriangles& near, const NearEdges& edges, float farthest,
                                                      EdgeVisit* visits, std::size_t count) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    EdgeVisit visit = visits[i];
    const FloatPoint& p = edges.points[edges.ends[visit.edge][0]];
    const FloatPoint& q = edges.points[edges.ends[visit.edge][1]];
    const float x = q[0] - p[0];
    const float y = q[1] - p[1];
    const float z = q[2] - p[2];
    const float along = std::max(std::abs(x), std::max(std::abs(y), std::abs(z)));
    const __m512 unsure = _mm512_set1_ps(unsure_side(farthest, along, near.extent));
    const __m512 minus_unsure = _mm512_sub_ps(_mm512_setzero_ps(), unsure);
    const Vectors way = {_mm512_set1_ps(x), _mm512_set1_ps(y), _mm512_set1_ps(z)};
    Vectors a, b, c;
    const auto first = static_cast<std::size_t>(visit.first);
    subtract(near.corners[0], first, p, a);
    subtract(near.corners[1], first, p, b);
    subtract(near.corners[2], first, p, c);
    const __m512 rim_a = side_of(a, b, way);
    const __m512 rim_b = side_of(b, c, way);
    const __m512 rim_c = side_of(c, a, way);
    const __m512 least = smaller(smaller(rim_a, rim_b), rim_c);
    const __m512 most = larger(larger(rim_b, rim_a), rim_c);
    const __mmask16 above = _mm512_cmp_ps_mask(most, unsure, _CMP_GT_OQ);
    const __mmask16 all_above = _mm512_cmp_ps_mask(least, unsure, _CMP_GT_OQ);
    const __mmask16 all_below = _mm512_cmp_ps_mask(most, minus_unsure, _CMP_LT_OQ);
    const __mmask16 apart = _mm512_mask_cmp_ps_mask(above, least, minus_unsure, _CMP_LT_OQ);
    visit.triangles &= ~static_cast<unsigned>(apart);
    visit.within_rims = static_cast<unsigned>(all_above) | static_cast<unsigned>(all_below);
    visits[kept] = visit;
    kept += visit.triangles != 0 ? 1 : 0;
  }
  return kept;
}

}  // namespace tissue_sim

#endif
