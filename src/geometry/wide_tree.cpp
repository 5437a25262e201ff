#include "tissue_sim/geometry/wide_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "packed_triangles.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

#define TISSUE_SIM_INLINE __attribute__((always_inline)) inline

namespace tissue_sim {

namespace {

// Arithmetic lane by lane, from and to plain arrays, in whatever registers the function has that they are inlined into.
typedef float Four __attribute__((vector_size(16), aligned(4), may_alias));   // NOLINT(modernize-use-using)
typedef float Eight __attribute__((vector_size(32), aligned(4), may_alias));  // NOLINT(modernize-use-using)
using FourBits = int __attribute__((vector_size(16), may_alias));
using EightBits = int __attribute__((vector_size(32)));
using EightFloats = float __attribute__((vector_size(32), may_alias));

constexpr std::size_t lanes = WideTree::lanes;
constexpr float infinite = std::numeric_limits<float>::infinity();

TISSUE_SIM_INLINE unsigned bits_of(const FourBits& lanes_set) {
#ifdef __x86_64__
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<const __m128&>(lanes_set)));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < 4; ++i) bits |= lanes_set[i] != 0 ? 1U << i : 0U;
  return bits;
#endif
}
TISSUE_SIM_INLINE unsigned bits_of(const EightBits& lanes_set) {
#if defined(__x86_64__) && !defined(__clang__)
  return static_cast<unsigned>(__builtin_ia32_movmskps256(reinterpret_cast<const EightFloats&>(lanes_set)));
#endif
  const FourBits* halves = reinterpret_cast<const FourBits*>(&lanes_set);
  return bits_of(halves[0]) | bits_of(halves[1]) << 4U;
}

template <class Lane, class Row>
TISSUE_SIM_INLINE const Lane& lane(const Row& row, std::size_t first) {
  return *reinterpret_cast<const Lane*>(row.data() + first);
}

TISSUE_SIM_INLINE Four& four(FloatPoint& p) {
  return *reinterpret_cast<Four*>(p.data());
}
TISSUE_SIM_INLINE const Four& four(const FloatPoint& p) {
  return *reinterpret_cast<const Four*>(p.data());
}

/// Bits of the lanes that have a child.
TISSUE_SIM_INLINE unsigned occupied(const WideTree::Node& node) {
  return (1U << static_cast<unsigned>(node.children)) - 1U;
}

/// The children whose boxes overlap the box, a bit each. A NaN overlaps nothing.
template <class Lane>
TISSUE_SIM_INLINE unsigned overlapping(const WideTree::Node& node, const FloatPoint& lower, const FloatPoint& upper) {
  unsigned bits = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    const auto overlap = (lane<Lane>(node.lower[0], l) <= upper[0]) & (lane<Lane>(node.upper[0], l) >= lower[0]) &
                         (lane<Lane>(node.lower[1], l) <= upper[1]) & (lane<Lane>(node.upper[1], l) >= lower[1]) &
                         (lane<Lane>(node.lower[2], l) <= upper[2]) & (lane<Lane>(node.upper[2], l) >= lower[2]);
    bits |= bits_of(overlap) << l;
  }
  return bits & occupied(node);
}

template <class Lane>
struct Three {
  Lane x, y, z;
};

// By reference: how wide vectors are passed by value depends on the instruction set.
template <class Lane>
TISSUE_SIM_INLINE void subtract(const std::array<NearTriangles::Row, 3>& corner, std::size_t l, const FloatPoint& p,
                                Three<Lane>& way) {
  way.x = lane<Lane>(corner[0], l) - p[0];
  way.y = lane<Lane>(corner[1], l) - p[1];
  way.z = lane<Lane>(corner[2], l) - p[2];
}
template <class Lane>
TISSUE_SIM_INLINE void cross(const Three<Lane>& a, const Three<Lane>& b, Three<Lane>& product) {
  product.x = a.y * b.z - a.z * b.y;
  product.y = a.z * b.x - a.x * b.z;
  product.z = a.x * b.y - a.y * b.x;
}

/// Of eight packed triangles, from `first` on, whose boxes overlap the edge's: those whose rims the line p-q does not
/// surely pass on different sides. `within` becomes those of which it surely passes all rims on the same side: farther
/// from them than what hit_edge_triangle() takes for rounding.
///
/// Coordinates up to `farthest` are rounded, so the differences below, up to `length` long, are wrong by 3 farthest *
/// rounding each, and what is made of them by less than farthest * length * (54 * along + 24 * length) * rounding,
/// where `along` bounds the sides of q - p.
template <class Lane>
TISSUE_SIM_INLINE unsigned within_rims(const NearTriangles& near, std::size_t first, const FloatPoint& p,
                                       const FloatPoint& q, float farthest, unsigned& within) {
  const float x = q[0] - p[0];
  const float y = q[1] - p[1];
  const float z = q[2] - p[2];
  const float along = std::max(std::abs(x), std::max(std::abs(y), std::abs(z)));
  const float unsure = unsure_side(farthest, along, near.extent);
  unsigned bits = 0;
  unsigned bits_within = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    Three<Lane> a, b, c, ab, bc, ca;
    subtract(near.corners[0], first + l, p, a);
    subtract(near.corners[1], first + l, p, b);
    subtract(near.corners[2], first + l, p, c);
    cross(a, b, ab);
    cross(b, c, bc);
    cross(c, a, ca);
    const Lane rim_a = ab.x * x + ab.y * y + ab.z * z;
    const Lane rim_b = bc.x * x + bc.y * y + bc.z * z;
    const Lane rim_c = ca.x * x + ca.y * y + ca.z * z;
    const Lane least_ab = rim_a < rim_b ? rim_a : rim_b;
    const Lane most_ab = rim_a < rim_b ? rim_b : rim_a;
    const Lane least = least_ab < rim_c ? least_ab : rim_c;
    const Lane most = most_ab > rim_c ? most_ab : rim_c;
    bits |= bits_of(~((most > unsure) & (least < -unsure))) << l;
    bits_within |= bits_of((least > unsure) | (most < -unsure)) << l;
  }
  within = bits_within;
  return bits;
}

/// Calls visit(node, lane) for the nodes that are leaves and overlap the box.
template <class Lane, class Visit>
TISSUE_SIM_INLINE void for_each_leaf(const WideTree& tree, const FloatPoint& lower, const FloatPoint& upper,
                                     std::vector<int>& stack, Visit&& visit) {
  stack.clear();
  stack.push_back(0);
  while (!stack.empty()) {
    const WideTree::Node& node = tree.nodes[static_cast<std::size_t>(stack.back())];
    stack.pop_back();
    for (unsigned bits = overlapping<Lane>(node, lower, upper); bits != 0; bits &= bits - 1) {
      const auto l = static_cast<std::size_t>(__builtin_ctz(bits));
      const int child = node.child[l];
      if ((node.leaf_children >> l & 1U) != 0) {
        visit(node, l);
      } else {
        stack.push_back(child);
      }
    }
  }
}

/// Not NaN, which could not be compared where floating-point traps are on.
void clear(WideTree::Node& node) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    node.lower[axis].fill(infinite);
    node.upper[axis].fill(-infinite);
  }
  node.child.fill(-1);
  node.children = 0;
  node.leaf_children = 0;
}

void set_lane(const Box& box, int child, std::size_t l, WideTree::Node& node) {
  for (int axis = 0; axis < 3; ++axis) {
    node.lower[static_cast<std::size_t>(axis)][l] = static_cast<float>(box.lower[axis]);
    node.upper[static_cast<std::size_t>(axis)][l] = static_cast<float>(box.upper[axis]);
  }
  node.child[l] = child;
  node.children = std::max(node.children, static_cast<int>(l) + 1);
}

/// Lists the leaves near to a box.
template <class Lane>
TISSUE_SIM_INLINE void gather_leaves(const WideTree& tree, const FloatPoint& lower, const FloatPoint& upper,
                                     WideTreeRoom& room) {
  room.leaves.clear();
  for_each_leaf<Lane>(tree, lower, upper, room.stack,
                      [&](const WideTree::Node& node, std::size_t l) { room.leaves.push_back(node.child[l]); });
}

/// Which lanes to take to the front, for every choice of them.
struct PackingOrder {
  std::array<std::array<int, lanes>, 256> of{};
  constexpr PackingOrder() {
    for (unsigned chosen = 0; chosen < 256; ++chosen) {
      std::size_t to = 0;
      for (unsigned l = 0; l < 8; ++l) {
        if ((chosen >> l & 1U) != 0) of[chosen][to++] = static_cast<int>(l);
      }
    }
  }
};
[[maybe_unused]] constexpr PackingOrder packing_order;  // by clang

/// Writes the chosen lanes of eight one behind the other, and anything behind them.
template <class Lane, class Number>
TISSUE_SIM_INLINE void pack_row(const std::array<Number, lanes>& row, unsigned chosen, Number* to) {
#if defined(__x86_64__) && !defined(__clang__)
  if (sizeof(Lane) == sizeof(Eight)) {
    const EightBits& order = reinterpret_cast<const EightBits&>(packing_order.of[chosen]);
    *reinterpret_cast<Eight*>(to) = __builtin_shuffle(reinterpret_cast<const EightFloats&>(row), order);
    return;
  }
#endif
  for (; chosen != 0; chosen &= chosen - 1) *to++ = row[static_cast<std::size_t>(__builtin_ctz(chosen))];
}

/// Packs the triangles of the listed leaves from `from` on whose boxes overlap the box, as many as there is room for.
/// Returns where in the list to go on.
template <class Lane>
TISSUE_SIM_INLINE std::size_t pack_triangles(const WideTree& tree, const FloatPoint& lower, const FloatPoint& upper,
                                             std::size_t from, WideTreeRoom& room) {
  NearTriangles& near = room.near;
  near.count = 0;
  near.extent = 0.0F;
  for (; from < room.leaves.size() && near.count + lanes <= NearTriangles::most; ++from) {
    const WideTree::Node& node = tree.nodes[static_cast<std::size_t>(room.leaves[from])];
    const unsigned chosen = overlapping<Lane>(node, lower, upper);
    if (chosen == 0) continue;
    const WideTree::Leaf& leaf = tree.leaves[static_cast<std::size_t>(node.leaf)];
    const std::size_t to = near.count;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      pack_row<Lane>(node.lower[axis], chosen, &near.lower[axis][to]);
      pack_row<Lane>(node.upper[axis], chosen, &near.upper[axis][to]);
      pack_row<Lane>(leaf.normal[axis], chosen, &near.normal[axis][to]);
      for (std::size_t corner = 0; corner < 3; ++corner) {
        pack_row<Lane>(leaf.corners[corner][axis], chosen, &near.corners[corner][axis][to]);
      }
    }
    pack_row<Lane>(leaf.offset, chosen, &near.offset[to]);
    near.extent = std::max(near.extent, leaf.extent);
    pack_row<Lane>(node.child, chosen, &near.triangle[to]);
    near.count += static_cast<std::size_t>(__builtin_popcount(chosen));
  }
  return from;
}

using FourWords = std::uint64_t __attribute__((vector_size(32)));
static_assert(sizeof(PointCodes) == 2 * sizeof(FourWords), "eight kinds of a word each");

template <std::size_t bytes>
struct LaneOf {
  typedef Four Type;  // NOLINT(modernize-use-using): its attributes count
};
template <>
struct LaneOf<32> {
  typedef Eight Type;  // NOLINT(modernize-use-using)
};

/// What is done with packed triangles, in registers of so many bytes; packed_triangles.h says what.
template <std::size_t bytes>
struct PackedIn {
  typedef typename LaneOf<bytes>::Type Lane;  // NOLINT(modernize-use-using)
  static constexpr std::size_t group = lanes;

  static TISSUE_SIM_INLINE void code_points(const NearTriangles& near, std::size_t first, std::size_t count,
                                            const NearEdges& edges, float farthest, PointCodes* codes) {
    constexpr std::size_t width = bytes / sizeof(float);
    constexpr unsigned all = (1U << width) - 1;
    const float unsure = unsure_height(farthest);
    for (std::size_t from = 0; from < count; from += width) {
      // Copies, since a byte that is written might be anybody's.
      Lane lower[3], upper[3], normal[3];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lower[axis] = lane<Lane>(near.lower[axis], first + from);
        upper[axis] = lane<Lane>(near.upper[axis], first + from);
        normal[axis] = lane<Lane>(near.normal[axis], first + from);
      }
      const Lane offset = lane<Lane>(near.offset, first + from);
      const std::size_t shift = width < lanes ? from % lanes : 0;
      for (std::size_t i = 0; i < edges.point_count; ++i) {
        const FloatPoint p = edges.points[i];
        std::array<unsigned, PointCodes::kinds> bits;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          bits[2 * axis] = bits_of(upper[axis] >= p[axis]);
          bits[2 * axis + 1] = bits_of(lower[axis] <= p[axis]);
        }
        const Lane height = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset;
        bits[PointCodes::not_in_front] = all & ~bits_of(height > unsure);  // also where it is not a number
        bits[PointCodes::not_behind] = all & ~bits_of(height < -unsure);
        for (std::size_t kind = 0; kind < PointCodes::kinds; ++kind) {
          unsigned char& byte = codes[i].bytes[kind][from / lanes];
          byte = static_cast<unsigned char>(bits[kind] << shift | (shift != 0 ? byte : 0U));
        }
      }
    }
  }

  static TISSUE_SIM_INLINE void find_candidates(const NearEdges& edges, const PointCodes* codes, std::uint64_t all,
                                                std::size_t step, std::uint64_t* candidates) {
    for (std::size_t e = 0; e < edges.count; ++e) {
      std::array<FourWords, 2> p, q;
      std::memcpy(&p, codes + edges.ends[e][0], sizeof p);
      std::memcpy(&q, codes + edges.ends[e][1], sizeof q);
      const FourWords kept = (p[0] | q[0]) & (p[1] | q[1]);
      candidates[e * step] = all & kept[0] & kept[1] & kept[2] & kept[3];
    }
  }

  static TISSUE_SIM_INLINE std::size_t keep_within_rims(const NearTriangles& near, const NearEdges& edges,
                                                        float farthest, EdgeVisit* visits, std::size_t count) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      EdgeVisit visit = visits[i];
      const Edge& ends = edges.ends[visit.edge];
      visit.triangles &= within_rims<Lane>(near, static_cast<std::size_t>(visit.first), edges.points[ends[0]],
                                           edges.points[ends[1]], farthest, visit.within_rims);
      visits[kept] = visit;
      kept += visit.triangles != 0 ? 1 : 0;
    }
    return kept;
  }
};

#ifdef __x86_64__
struct PackedInAvx512 {
  static constexpr std::size_t group = 16;
  static constexpr auto code_points = code_points_avx512;
  static constexpr auto find_candidates = find_candidates_avx512;
  static constexpr auto keep_within_rims = keep_within_rims_avx512;
};
#endif

/// Appends the pairs of the edges and the packed triangles that may cross.
///
/// An edge shares its ends with others, so boxes and planes are compared with the ends, and the edges put together what
/// is known of theirs. In passes, each over what the one before has left, since no one can guess what a test will say:
/// writing down every visit and counting on only where it is kept takes no branch.
template <class Packed>
TISSUE_SIM_INLINE void test_packed(const NearEdges& edges, float farthest, WideTreeRoom& room,
                                   std::vector<EdgeTrianglePair>& pairs) {
  const NearTriangles& near = room.near;
  const std::size_t words = (near.count + in_word - 1) / in_word;
  if (room.codes.size() < edges.point_count) room.codes.resize(edges.point_count);
  if (room.candidates.size() < words * edges.count) room.candidates.resize(words * edges.count);
  for (std::size_t word = 0; word < words; ++word) {
    const std::size_t first = word * in_word;
    const std::size_t count = std::min(in_word, near.count - first);
    Packed::code_points(near, first, count, edges, farthest, room.codes.data());
    const std::uint64_t all = ~std::uint64_t{0} >> (in_word - count);
    Packed::find_candidates(edges, room.codes.data(), all, words, room.candidates.data() + word);
  }

  constexpr std::size_t group = Packed::group;
  constexpr std::uint64_t of_group = (std::uint64_t{1} << group) - 1;
  std::vector<EdgeVisit>& visits = room.visits;
  const std::size_t most_visits = edges.count * words * (in_word / group);
  if (visits.size() < most_visits) visits.resize(most_visits);
  std::size_t kept = 0;
  for (std::size_t e = 0; e < edges.count; ++e) {
    for (std::size_t word = 0; word < words; ++word) {
      const std::uint64_t candidates = room.candidates[e * words + word];
      const std::size_t count = std::min(in_word, near.count - in_word * word);
      for (std::size_t at = 0; at < count; at += group) {
        const auto triangles = static_cast<unsigned>((candidates >> at) & of_group);
        visits[kept] = {static_cast<int>(e), static_cast<int>(in_word * word + at), triangles, 0};
        kept += triangles != 0 ? 1 : 0;
      }
    }
  }
  kept = Packed::keep_within_rims(near, edges, farthest, visits.data(), kept);
  std::size_t found = pairs.size();
  std::size_t more = 0;
  for (std::size_t i = 0; i < kept; ++i) more += static_cast<std::size_t>(__builtin_popcount(visits[i].triangles));
  pairs.resize(found + more);
  for (std::size_t i = 0; i < kept; ++i) {
    const EdgeVisit& visit = visits[i];
    for (unsigned bits = visit.triangles; bits != 0; bits &= bits - 1) {
      EdgeTrianglePair& pair = pairs[found++];  // field by field: a whole one would wait for its parts
      pair.edge = edges.edges[visit.edge];
      pair.triangle = near.triangle[static_cast<std::size_t>(visit.first + __builtin_ctz(bits))];
      pair.within_rims = (visit.within_rims & bits & -bits) != 0;
    }
  }
}

/// Their box, and the largest coordinate in it and the tree.
TISSUE_SIM_INLINE float bounds_of(const WideTree& tree, const NearEdges& edges, FloatPoint& lower, FloatPoint& upper) {
  Four low = Four{} + infinite;
  Four high = Four{} - infinite;
  for (std::size_t i = 0; i < edges.point_count; ++i) {
    const Four p = four(edges.points[i]);
    low = p < low ? p : low;
    high = p > high ? p : high;
  }
  four(lower) = low;
  four(upper) = high;
  float farthest = tree.farthest;
  for (std::size_t i = 0; i < 3; ++i) farthest = std::max({farthest, std::abs(lower[i]), std::abs(upper[i])});
  return farthest;
}

template <class Lane, class Packed>
TISSUE_SIM_INLINE void find_pairs(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                                  std::vector<EdgeTrianglePair>& pairs) {
  FloatPoint lower;
  FloatPoint upper;
  const float farthest = bounds_of(tree, edges, lower, upper);
  gather_leaves<Lane>(tree, lower, upper, room);
  if (room.leaves.empty()) return;
  if (pack_triangles<Lane>(tree, lower, upper, 0, room) == room.leaves.size()) {
    return test_packed<Packed>(edges, farthest, room, pairs);
  }
  // Too many at once: each edge goes down the tree by itself.
  for (std::size_t e = 0; e < edges.count; ++e) {
    const std::array<FloatPoint, 2> ends = {edges.points[edges.ends[e][0]], edges.points[edges.ends[e][1]]};
    constexpr Edge both = {0, 1};
    const NearEdges one = {ends.data(), 2, &both, edges.edges + e, 1};
    bounds_of(tree, one, lower, upper);
    gather_leaves<Lane>(tree, lower, upper, room);
    for (std::size_t from = 0; from < room.leaves.size();) {
      from = pack_triangles<Lane>(tree, lower, upper, from, room);
      test_packed<Packed>(one, farthest, room, pairs);
    }
  }
}

__attribute__((noinline)) void find_pairs_narrow(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                                                 std::vector<EdgeTrianglePair>& pairs) {
  find_pairs<Four, PackedIn<16>>(tree, edges, room, pairs);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void find_pairs_wide(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                                                     std::vector<EdgeTrianglePair>& pairs) {
  find_pairs<Eight, PackedIn<32>>(tree, edges, room, pairs);
}
__attribute__((target("avx2"))) void find_pairs_widest(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                                                       std::vector<EdgeTrianglePair>& pairs) {
  find_pairs<Eight, PackedInAvx512>(tree, edges, room, pairs);
}
#endif

/// A float that is no smaller. Where only infinity is, no distance is too far, not even one that is too large for a
/// float.
TISSUE_SIM_INLINE float rounded_up(double value) {
  constexpr double largest = std::numeric_limits<float>::max();
  constexpr double smallest = std::numeric_limits<float>::min();
  return value < (1.0 - 1e-6) * largest ? static_cast<float>(value * (1.0 + 1e-6) + smallest) : infinite;
}

/// Squared distances from p to the children's boxes, or a little less; see closest(). Returns a bit for each child that
/// is no farther than `limit`.
template <class Lane>
TISSUE_SIM_INLINE unsigned squared_distances(const WideTree::Node& node, const FloatPoint& p, float slack, float limit,
                                             WideTree::Row& distances) {
  unsigned near = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    Lane sum{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Lane before = lane<Lane>(node.lower[axis], l) - p[axis];
      const Lane behind = p[axis] - lane<Lane>(node.upper[axis], l);
      Lane way = (before > behind ? before : behind) - slack;
      way = way > 0.0F ? way : Lane{};
      sum += way * way;
    }
    sum *= 1.0F - 1e-6F;
    *reinterpret_cast<Lane*>(distances.data() + l) = sum;
    near |= bits_of(sum <= limit) << l;
  }
  return near & occupied(node);
}

/// Raises the distances of a leaf's triangles to those of their planes, and takes away the bits of what is then farther
/// than `limit`: around a point on a curved surface the boxes of all neighbours have it, and their planes do not.
template <class Lane>
TISSUE_SIM_INLINE unsigned plane_distances(const WideTree::Leaf& leaf, const FloatPoint& p, float slack, float limit,
                                           WideTree::Row& distances) {
  unsigned near = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    const Lane height = lane<Lane>(leaf.normal[0], l) * p[0] + lane<Lane>(leaf.normal[1], l) * p[1] +
                        lane<Lane>(leaf.normal[2], l) * p[2] - lane<Lane>(leaf.offset, l);
    Lane way = (height > 0.0F ? height : -height) - slack;
    way = way > 0.0F ? way : Lane{};
    const Lane of_box = lane<Lane>(distances, l);
    const Lane of_plane = way * way * (1.0F - 1e-6F);
    const Lane farther = of_plane > of_box ? of_plane : of_box;
    *reinterpret_cast<Lane*>(distances.data() + l) = farther;
    near |= bits_of(farther <= limit) << l;
  }
  return near;
}

/// Nearest first. A coordinate is rounded by at most (its size) * rounding, a difference once more, and a height as
/// straddled() says: `slack` and `slack_of_plane` are more than all of it.
/// What is at a squared distance of more than `limit()` need not be looked at, as far as is known now.
template <class Lane, class Limit>
TISSUE_SIM_INLINE void closest(const WideTree& tree, const Vector3& from, ClosestSearch& search, Limit&& limit) {
  struct Entry {
    int child;
    float distance;
  };
  std::array<Entry, 128> stack;  // 7 a level and 8: enough for 8^17 leaves
  const FloatPoint p = to_float(from);
  const float size = tree.farthest + std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
  const float slack = 8.0F * rounding * size;
  const float slack_of_plane = 32.0F * rounding * size;
  float enough = rounded_up(limit());
  std::size_t waiting = 1;
  stack[0] = {0, 0.0F};
  while (waiting > 0) {
    const Entry entry = stack[--waiting];
    if (!(entry.distance <= enough)) continue;
    const WideTree::Node& node = tree.nodes[static_cast<std::size_t>(entry.child)];
    alignas(32) WideTree::Row distances;
    unsigned near = squared_distances<Lane>(node, p, slack, enough, distances);
    if (node.leaf >= 0) {
      near &=
          plane_distances<Lane>(tree.leaves[static_cast<std::size_t>(node.leaf)], p, slack_of_plane, enough, distances);
    }
    const std::size_t bottom = waiting;
    for (; near != 0; near &= near - 1) {
      const auto l = static_cast<std::size_t>(__builtin_ctz(near));
      std::size_t at = waiting++;
      for (; at > bottom && stack[at - 1].distance < distances[l]; --at) stack[at] = stack[at - 1];
      stack[at] = {node.child[l], distances[l]};
    }
    if (node.leaf < 0) continue;
    for (; waiting > bottom; --waiting) {
      if (!(stack[waiting - 1].distance <= enough)) continue;
      search.look_at(stack[waiting - 1].child);
      enough = rounded_up(limit());
    }
  }
}

template <class Lane>
TISSUE_SIM_INLINE void look_through_rows(const BoxRows& boxes, ClosestSearch& search) {
  const FloatPoint p = to_float(search.p - boxes.origin);
  const float size = boxes.farthest + std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
  const float slack = 8.0F * rounding * size;
  float enough = rounded_up(search.bound);
  for (const WideTree::Node& row : boxes.rows) {
    alignas(32) WideTree::Row distances;
    for (unsigned near = squared_distances<Lane>(row, p, slack, enough, distances); near != 0; near &= near - 1) {
      const auto l = static_cast<std::size_t>(__builtin_ctz(near));
      if (!(distances[l] <= enough)) continue;
      search.look_at(row.child[l]);
      enough = rounded_up(search.bound);
    }
  }
}
__attribute__((noinline)) void look_through_narrow(const BoxRows& boxes, ClosestSearch& search) {
  look_through_rows<Four>(boxes, search);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void look_through_wide(const BoxRows& boxes, ClosestSearch& search) {
  look_through_rows<Eight>(boxes, search);
}
#endif

template <class Lane>
TISSUE_SIM_INLINE void closest(const WideTree& tree, const Vector3& from, ClosestSearch& search) {
  closest<Lane>(
      tree, from, search, [&]() __attribute__((always_inline)) { return search.bound; });
}
__attribute__((noinline)) void closest_narrow(const WideTree& tree, const Vector3& from, ClosestSearch& search) {
  closest<Four>(tree, from, search);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void closest_wide(const WideTree& tree, const Vector3& from, ClosestSearch& search) {
  closest<Eight>(tree, from, search);
}
#endif

/// Squares of distances between which the nearest one is wanted exactly.
struct Wanted {
  double little;
  double enough;

  /// The square of the radius of a ball that is free once all that is nearer has been looked at and `best` was found.
  double free_within(double best) const {
    constexpr double share = 0.64;  // of a square: a fifth of the distance is given away
    if (best > enough) return std::max(share * best, enough);
    return best < little ? share * best : best;
  }
};

template <class Lane>
TISSUE_SIM_INLINE void free_ball(const WideTree& tree, const Vector3& from, const Wanted& wanted,
                                 ClosestSearch& search) {
  closest<Lane>(
      tree, from, search, [&]() __attribute__((always_inline)) { return wanted.free_within(search.bound); });
}
__attribute__((noinline)) void free_ball_narrow(const WideTree& tree, const Vector3& from, const Wanted& wanted,
                                                ClosestSearch& search) {
  free_ball<Four>(tree, from, wanted, search);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void free_ball_wide(const WideTree& tree, const Vector3& from, const Wanted& wanted,
                                                    ClosestSearch& search) {
  free_ball<Eight>(tree, from, wanted, search);
}
#endif

struct Builder {
  const std::vector<Vector3>& vertices;
  const std::vector<Triangle>& triangles;
  std::vector<Box> boxes;
  std::vector<int> order;
  WideTree& tree;

  /// Puts the `parts` nearly equal parts of the triangles from `first` on in order, by halving along the longest side
  /// of their middles; equal middles by index, so that the tree is one only.
  void split(int first, int count, int parts) {
    if (parts == 1) return;
    Box middles;
    for (int i = first; i < first + count; ++i) middles.add(0.5 * (boxes[order[i]].lower + boxes[order[i]].upper));
    Eigen::Index axis = 0;
    middles.size().maxCoeff(&axis);
    const auto before = [&](int a, int b) {
      const double middle_a = boxes[a].lower[axis] + boxes[a].upper[axis];
      const double middle_b = boxes[b].lower[axis] + boxes[b].upper[axis];
      return middle_a < middle_b || (middle_a == middle_b && a < b);
    };
    const int part = parts / 2;
    const int half = start_of(part, count, parts);
    std::nth_element(order.begin() + first, order.begin() + first + half, order.begin() + first + count, before);
    split(first, half, part);
    split(first + half, count - half, parts - part);
  }
  static int start_of(int part, int count, int parts) {
    return static_cast<int>(static_cast<long long>(count) * part / parts);
  }

  Box build_node(int index, int first, int count, int height) {
    tree.height = std::max(tree.height, height);
    clear(tree.nodes[static_cast<std::size_t>(index)]);
    if (count <= static_cast<int>(lanes) && height > 1) return build_leaf(index, first, count);
    // Children that hold a power of eight: then all leaves but a few are full.
    long long held = static_cast<long long>(lanes);
    while (held * static_cast<long long>(lanes) < count) held *= static_cast<long long>(lanes);
    const int parts = static_cast<int>((count + held - 1) / held);
    const int children = static_cast<int>(tree.nodes.size());
    tree.nodes.resize(tree.nodes.size() + static_cast<std::size_t>(parts));
    Box box;
    std::vector<int> starts = {0};
    split_evenly(first, count, parts, starts);
    for (int part = 0; part < parts; ++part) {
      const Box of_part =
          build_node(children + part, first + starts[part], starts[part + 1] - starts[part], height + 1);
      set_lane(index, static_cast<std::size_t>(part), of_part, children + part);
      if (tree.nodes[static_cast<std::size_t>(children + part)].leaf >= 0) {
        tree.nodes[static_cast<std::size_t>(index)].leaf_children |= 1U << static_cast<unsigned>(part);
      }
      box.add(of_part);
    }
    return box;
  }

  /// Where split() has put the parts.
  void split_evenly(int first, int count, int parts, std::vector<int>& starts) {
    split(first, count, parts);
    add_starts(0, count, parts, starts);
  }
  static void add_starts(int first, int count, int parts, std::vector<int>& starts) {
    if (parts == 1) {
      starts.push_back(first + count);
      return;
    }
    const int part = parts / 2;
    const int half = start_of(part, count, parts);
    add_starts(first, half, part, starts);
    add_starts(first + half, count - half, parts - part, starts);
  }

  Box build_leaf(int index, int first, int count) {
    tree.nodes[static_cast<std::size_t>(index)].leaf = static_cast<int>(tree.leaves.size());
    tree.leaves.emplace_back();
    WideTree::Leaf& leaf = tree.leaves.back();
    std::sort(order.begin() + first, order.begin() + first + count);
    Box box;
    for (std::size_t l = 0; l < lanes; ++l) {
      const int triangle = order[first + std::min(static_cast<int>(l), count - 1)];
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const FloatPoint p = to_float(vertices[triangles[triangle][corner]]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          leaf.corners[corner][axis][l] = p[axis];
          tree.farthest = std::max(tree.farthest, std::abs(p[axis]));
        }
      }
      const auto& [a, b, c] = triangles[triangle];
      const Vector3 normal = plane_normal(vertices[a], vertices[b], vertices[c]);
      const FloatPoint rounded = to_float(normal);
      for (std::size_t axis = 0; axis < 3; ++axis) leaf.normal[axis][l] = rounded[axis];
      leaf.offset[l] = static_cast<float>(normal.dot(vertices[a]));
      leaf.extent = std::max(leaf.extent, 1.001F * static_cast<float>(boxes[triangle].size().maxCoeff()));
      if (static_cast<int>(l) >= count) continue;
      set_lane(index, l, boxes[triangle], triangle);
      box.add(boxes[triangle]);
    }
    return box;
  }

  /// Zero also where rounding leaves so little of a sliver's plane that its corners are not on it.
  static Vector3 plane_normal(const Vector3& a, const Vector3& b, const Vector3& c) {
    const Vector3 normal = unit_or_zero(area_normal(a, b, c));
    const double size =
        std::max({a.lpNorm<Eigen::Infinity>(), b.lpNorm<Eigen::Infinity>(), c.lpNorm<Eigen::Infinity>()});
    const double off = std::max(std::abs(normal.dot(b - a)), std::abs(normal.dot(c - a)));
    return off <= static_cast<double>(rounding) * size ? normal : Vector3(Vector3::Zero());
  }

  void set_lane(int index, std::size_t l, const Box& box, int child) {
    tissue_sim::set_lane(box, child, l, tree.nodes[static_cast<std::size_t>(index)]);
  }
};

}  // namespace

WideTree build_wide_tree(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles) {
  WideTree tree;
  Builder builder = {vertices, triangles, {}, std::vector<int>(triangles.size()), tree};
  fit_boxes(vertices, triangles, 0.0, builder.boxes);
  std::iota(builder.order.begin(), builder.order.end(), 0);
  tree.nodes.emplace_back();
  clear(tree.nodes.front());
  if (!triangles.empty()) builder.build_node(0, 0, static_cast<int>(triangles.size()), 1);
  return tree;
}

void begin_rows(const Vector3& origin, BoxRows& boxes) {
  boxes.rows.clear();
  boxes.origin = origin;
  boxes.farthest = 0.0F;
}

void add_to_rows(int triangle, const Vector3& a, const Vector3& b, const Vector3& c, BoxRows& boxes) {
  if (boxes.rows.empty() || boxes.rows.back().children == static_cast<int>(lanes)) {
    boxes.rows.emplace_back();
    clear(boxes.rows.back());
  }
  Box box;
  for (const Vector3* corner : {&a, &b, &c}) {
    const Vector3 from_origin = *corner - boxes.origin;
    box.add(from_origin);
    boxes.farthest = std::max(boxes.farthest, static_cast<float>(from_origin.lpNorm<Eigen::Infinity>()));
  }
  set_lane(box, triangle, static_cast<std::size_t>(boxes.rows.back().children), boxes.rows.back());
}

void look_through(const BoxRows& boxes, ClosestSearch& search, InstructionSet set) {
#ifdef __x86_64__
  if (set != InstructionSet::baseline) return look_through_wide(boxes, search);
#endif
  look_through_narrow(boxes, search);
}

void find_crossing_pairs(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                         std::vector<EdgeTrianglePair>& pairs, InstructionSet set) {
#ifdef __x86_64__
  if (set == InstructionSet::avx512) return find_pairs_widest(tree, edges, room, pairs);
  if (set == InstructionSet::avx2) return find_pairs_wide(tree, edges, room, pairs);
#endif
  find_pairs_narrow(tree, edges, room, pairs);
}

ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const WideTree& tree, const Vector3& p, double reach, int guess, InstructionSet set) {
  ClosestSearch search(vertices, triangles, p, reach);
  if (!p.allFinite()) return search.best;
  if (guess >= 0) search.look_at(guess);
#ifdef __x86_64__
  if (set != InstructionSet::baseline) {
    closest_wide(tree, p, search);
    return search.best;
  }
#endif
  closest_narrow(tree, p, search);
  return search.best;
}

ClosestOnMesh free_around(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                          const WideTree& tree, const Vector3& p, double little, double enough, int guess,
                          InstructionSet set) {
  ClosestSearch search(vertices, triangles, p, std::numeric_limits<double>::infinity());
  if (!p.allFinite()) return search.best;
  if (guess >= 0) search.look_at(guess);
  const Wanted wanted = {little * little, enough * enough};
#ifdef __x86_64__
  if (set != InstructionSet::baseline) {
    free_ball_wide(tree, p, wanted, search);
  } else
#endif
  {
    free_ball_narrow(tree, p, wanted, search);
  }
  search.best.squared_distance = wanted.free_within(search.best.squared_distance);
  return search.best;
}

}  // namespace tissue_sim
