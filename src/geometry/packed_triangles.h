#pragma once

#include <cstring>

#include "tissue_sim/geometry/wide_tree.h"

/// What find_crossing_pairs() does with packed triangles in registers of 64 bytes, in a source of its own. The same
/// arithmetic, operation by operation, as its templates in wide_tree.cpp do for narrower ones.
namespace tissue_sim {

/// Packed triangles a word of PointCodes.
constexpr std::size_t in_word = 64;

/// Half of the last place of a float of size one.
constexpr float rounding = 5.96e-8F;

/// More than rounding makes wrong of a height above a plane: coordinates up to `farthest`, the normal and all sums of
/// their products are rounded, and it is wrong by less than 16 farthest * rounding.
inline float unsure_height(float farthest) {
  return 32.0F * rounding * farthest;
}

/// The same of the side on which the line along an edge passes a rim: within_rims() in wide_tree.cpp says why. `along`
/// is the longest side of the edge's box, `extent` that of the triangles.
inline float unsure_side(float farthest, float along, float extent) {
  const float length = along + extent;
  return rounding * farthest * length * (128.0F * along + 64.0F * length);
}

#ifdef __x86_64__
/// Where the points are to the packed triangles `first` .. `first` + count - 1, at most a word.
void code_points_avx512(const NearTriangles& near, std::size_t first, std::size_t count, const NearEdges& edges,
                        float farthest, PointCodes* codes);

/// The packed triangles of a word, of those in `all`, that the ends of an edge do not rule out: every `step`-th entry
/// of `candidates` is for the next edge.
void find_candidates_avx512(const NearEdges& edges, const PointCodes* codes, std::uint64_t all, std::size_t step,
                            std::uint64_t* candidates);

/// Keeps the visits, of sixteen packed triangles each, of which rims say that they may cross. Returns how many.
std::size_t keep_within_rims_avx512(const NearTriangles& near, const NearEdges& edges, float farthest,
                                    EdgeVisit* visits, std::size_t count);
#endif

}  // namespace tissue_sim
