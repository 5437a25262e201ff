#include "tissue_sim/geometry/wide_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

constexpr std::size_t lanes = WideTree::lanes;
constexpr float infinite = std::numeric_limits<float>::infinity();

/// More leaves than this near to a group of edges: each of them goes down the tree by itself.
constexpr std::size_t most_near_leaves = 64;

/// Half of the last place of a float of size one.
constexpr float rounding = 5.96e-8F;

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
  const FourBits* halves = reinterpret_cast<const FourBits*>(&lanes_set);
  return bits_of(halves[0]) | bits_of(halves[1]) << 4U;
}

template <class Lane>
TISSUE_SIM_INLINE const Lane& lane(const WideTree::Row& row, std::size_t first) {
  return *reinterpret_cast<const Lane*>(row.data() + first);
}

TISSUE_SIM_INLINE Four& four(FloatPoint& p) {
  return *reinterpret_cast<Four*>(p.data());
}
TISSUE_SIM_INLINE const Four& four(const FloatPoint& p) {
  return *reinterpret_cast<const Four*>(p.data());
}

/// The children whose boxes overlap `box`, a bit each. A NaN overlaps nothing.
template <class Lane>
TISSUE_SIM_INLINE unsigned overlapping(const WideTree::Node& node, const FloatPoint& lower, const FloatPoint& upper) {
  unsigned bits = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    const auto overlap = (lane<Lane>(node.lower[0], l) <= upper[0]) & (lane<Lane>(node.upper[0], l) >= lower[0]) &
                         (lane<Lane>(node.lower[1], l) <= upper[1]) & (lane<Lane>(node.upper[1], l) >= lower[1]) &
                         (lane<Lane>(node.lower[2], l) <= upper[2]) & (lane<Lane>(node.upper[2], l) >= lower[2]);
    bits |= bits_of(overlap) << l;
  }
  return bits;
}

template <class Lane>
struct Three {
  Lane x, y, z;
};

// By reference: how wide vectors are passed by value depends on the instruction set.
template <class Lane>
TISSUE_SIM_INLINE void subtract(const std::array<WideTree::Row, 3>& corner, std::size_t l, const FloatPoint& p,
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

/// The triangles of a leaf whose planes the edge p-q may go through: its ends do not surely lie on one side.
///
/// Coordinates up to `farthest`, the normal and all sums of their products are rounded: a height is wrong by less than
/// 16 farthest * rounding.
template <class Lane>
TISSUE_SIM_INLINE unsigned straddled(const WideTree::Leaf& leaf, const FloatPoint& p, const FloatPoint& q,
                                     float farthest) {
  const float unsure = 32.0F * rounding * farthest;
  unsigned bits = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    const Lane& x = lane<Lane>(leaf.normal[0], l);
    const Lane& y = lane<Lane>(leaf.normal[1], l);
    const Lane& z = lane<Lane>(leaf.normal[2], l);
    const Lane height_p = x * p[0] + y * p[1] + z * p[2] - lane<Lane>(leaf.offset, l);
    const Lane height_q = x * q[0] + y * q[1] + z * q[2] - lane<Lane>(leaf.offset, l);
    const auto both_above = (height_p > unsure) & (height_q > unsure);
    const auto both_below = (height_p < -unsure) & (height_q < -unsure);
    bits |= bits_of(~(both_above | both_below)) << l;
  }
  return bits;
}

/// The triangles of a leaf, of those whose boxes overlap the edge's, whose rims the line p-q does not surely pass on
/// different sides. `within` becomes those of which it surely passes all rims on the same side: farther from them than
/// what hit_edge_triangle() takes for rounding.
///
/// Coordinates up to `farthest` are rounded, so the differences below, up to `length` long, are wrong by 3 farthest *
/// rounding each, and what is made of them by less than farthest * length * (54 * along + 24 * length) * rounding,
/// where `along` bounds the sides of q - p.
template <class Lane>
TISSUE_SIM_INLINE unsigned within_rims(const WideTree::Leaf& leaf, const FloatPoint& p, const FloatPoint& q,
                                       float farthest, unsigned& within) {
  const float x = q[0] - p[0];
  const float y = q[1] - p[1];
  const float z = q[2] - p[2];
  const float along = std::max(std::abs(x), std::max(std::abs(y), std::abs(z)));
  const float length = along + leaf.extent;
  const float unsure = rounding * farthest * length * (128.0F * along + 64.0F * length);
  unsigned bits = 0;
  unsigned bits_within = 0;
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    Three<Lane> a, b, c, ab, bc, ca;
    subtract(leaf.corners[0], l, p, a);
    subtract(leaf.corners[1], l, p, b);
    subtract(leaf.corners[2], l, p, c);
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
      if (tree.nodes[static_cast<std::size_t>(child)].leaf >= 0) {
        visit(node, l);
      } else {
        stack.push_back(child);
      }
    }
  }
}

/// No number is on either side of a NaN: an edge that reaches to infinity overlaps every box with sides.
void clear(WideTree::Node& node) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    node.lower[axis].fill(std::numeric_limits<float>::quiet_NaN());
    node.upper[axis].fill(std::numeric_limits<float>::quiet_NaN());
  }
  node.child.fill(-1);
}

/// Boxes of the leaves near to all the edges. False: there are too many of them.
template <class Lane>
TISSUE_SIM_INLINE bool gather_leaves(const WideTree& tree, const FloatPoint& lower, const FloatPoint& upper,
                                     WideTreeRoom& room) {
  room.leaves.clear();
  room.near.clear();
  for_each_leaf<Lane>(tree, lower, upper, room.stack, [&](const WideTree::Node& node, std::size_t from) {
    const std::size_t to = room.leaves.size() % lanes;
    if (to == 0) {
      room.near.emplace_back();
      clear(room.near.back());
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      room.near.back().lower[axis][to] = node.lower[axis][from];
      room.near.back().upper[axis][to] = node.upper[axis][from];
    }
    room.near.back().child[to] = node.child[from];
    room.leaves.push_back(node.child[from]);
  });
  return room.leaves.size() <= most_near_leaves;
}

template <class Lane>
TISSUE_SIM_INLINE void find_pairs(const WideTree& tree, const std::vector<FloatPoint>& points,
                                  const std::vector<Edge>& edges, const int* chosen, std::size_t count,
                                  WideTreeRoom& room, std::vector<EdgeTrianglePair>& pairs) {
  if (room.edges.size() < count) room.edges.resize(count);
  Four lower = Four{} + infinite;
  Four upper = Four{} - infinite;
  for (std::size_t e = 0; e < count; ++e) {
    const Edge& edge = edges[static_cast<std::size_t>(chosen[e])];
    const Four p = four(points[static_cast<std::size_t>(edge[0])]);
    const Four q = four(points[static_cast<std::size_t>(edge[1])]);
    const Four low = p < q ? p : q;
    const Four high = p < q ? q : p;
    lower = low < lower ? low : lower;
    upper = high > upper ? high : upper;
    FloatEdge& kept = room.edges[e];
    four(kept.p) = p;
    four(kept.q) = q;
    four(kept.lower) = low;
    four(kept.upper) = high;
  }
  FloatPoint all_lower;
  FloatPoint all_upper;
  four(all_lower) = lower;
  four(all_upper) = upper;
  const bool few = gather_leaves<Lane>(tree, all_lower, all_upper, room);
  if (room.leaves.empty()) return;
  float farthest = tree.farthest;
  for (std::size_t i = 0; i < 3; ++i) farthest = std::max({farthest, std::abs(all_lower[i]), std::abs(all_upper[i])});

  // In passes, each over what the one before has left, since no one can guess what a test will say: writing down every
  // visit and counting on only where it is kept takes no branch.
  std::vector<EdgeLeafVisit>& visits = room.visits;
  std::size_t kept = 0;
  for (int e = 0; e < static_cast<int>(count); ++e) {
    const FloatEdge& edge = room.edges[static_cast<std::size_t>(e)];
    if (!few) {
      for_each_leaf<Lane>(tree, edge.lower, edge.upper, room.stack, [&](const WideTree::Node& node, std::size_t l) {
        if (visits.size() < kept + 1) visits.resize(2 * kept + 64);
        visits[kept++] = {e, node.child[l], 0, 0};
      });
      continue;
    }
    if (visits.size() < kept + most_near_leaves) visits.resize(2 * kept + most_near_leaves);
    for (const WideTree::Node& eight : room.near) {
      for (unsigned bits = overlapping<Lane>(eight, edge.lower, edge.upper); bits != 0; bits &= bits - 1) {
        visits[kept++] = {e, eight.child[static_cast<std::size_t>(__builtin_ctz(bits))], 0, 0};
      }
    }
  }
  const auto keep_if = [&](auto test) __attribute__((always_inline)) {
    const std::size_t before = kept;
    kept = 0;
    for (std::size_t i = 0; i < before; ++i) {
      EdgeLeafVisit visit = visits[i];
      visit.triangles = test(visit);
      visits[kept] = visit;
      kept += visit.triangles != 0 ? 1 : 0;
    }
  };
  keep_if([&](EdgeLeafVisit & visit) __attribute__((always_inline)) {
    const FloatEdge& edge = room.edges[static_cast<std::size_t>(visit.edge)];
    const WideTree::Node& leaf = tree.nodes[static_cast<std::size_t>(visit.leaf)];
    return overlapping<Lane>(leaf, edge.lower, edge.upper) &
           straddled<Lane>(tree.leaves[static_cast<std::size_t>(leaf.leaf)], edge.p, edge.q, farthest);
  });
  keep_if([&](EdgeLeafVisit & visit) __attribute__((always_inline)) {
    const FloatEdge& edge = room.edges[static_cast<std::size_t>(visit.edge)];
    const WideTree::Node& leaf = tree.nodes[static_cast<std::size_t>(visit.leaf)];
    return visit.triangles & within_rims<Lane>(tree.leaves[static_cast<std::size_t>(leaf.leaf)], edge.p, edge.q,
                                               farthest, visit.within_rims);
  });
  for (std::size_t i = 0; i < kept; ++i) {
    const WideTree::Node& leaf = tree.nodes[static_cast<std::size_t>(visits[i].leaf)];
    for (unsigned bits = visits[i].triangles; bits != 0; bits &= bits - 1) {
      pairs.push_back({chosen[visits[i].edge], leaf.child[static_cast<std::size_t>(__builtin_ctz(bits))],
                       (visits[i].within_rims & bits & -bits) != 0});
    }
  }
}

__attribute__((noinline)) void find_pairs_narrow(const WideTree& tree, const std::vector<FloatPoint>& points,
                                                 const std::vector<Edge>& edges, const int* chosen, std::size_t count,
                                                 WideTreeRoom& room, std::vector<EdgeTrianglePair>& pairs) {
  find_pairs<Four>(tree, points, edges, chosen, count, room, pairs);
}
#ifdef __x86_64__
__attribute__((target("avx2"))) void find_pairs_wide(const WideTree& tree, const std::vector<FloatPoint>& points,
                                                     const std::vector<Edge>& edges, const int* chosen,
                                                     std::size_t count, WideTreeRoom& room,
                                                     std::vector<EdgeTrianglePair>& pairs) {
  find_pairs<Eight>(tree, points, edges, chosen, count, room, pairs);
}
#endif

/// Squared distances from p to the children's boxes, or a little less; see closest().
template <class Lane>
TISSUE_SIM_INLINE void squared_distances(const WideTree::Node& node, const FloatPoint& p, float slack,
                                         WideTree::Row& distances) {
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    Lane sum{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Lane before = lane<Lane>(node.lower[axis], l) - p[axis];
      const Lane behind = p[axis] - lane<Lane>(node.upper[axis], l);
      Lane way = (before > behind ? before : behind) - slack;
      way = way > 0.0F ? way : Lane{};
      sum += way * way;
    }
    *reinterpret_cast<Lane*>(distances.data() + l) = sum * (1.0F - 1e-6F);
  }
}

/// Nearest first. A coordinate is rounded by at most (its size) * rounding, a difference once more: `slack` is more
/// than all of it.
/// `near_enough(distance)` says by a squared distance whether what is no nearer has still to be looked at.
template <class Lane, class NearEnough>
TISSUE_SIM_INLINE void closest(const WideTree& tree, const Vector3& from, ClosestSearch& search,
                               NearEnough&& near_enough) {
  struct Entry {
    int child;
    float distance;
  };
  std::array<Entry, 128> stack;  // 7 a level and 8: enough for 8^17 leaves
  const FloatPoint p = to_float(from);
  const float size = tree.farthest + std::max({std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
  const float slack = 8.0F * rounding * size;
  std::size_t waiting = 1;
  stack[0] = {0, 0.0F};
  while (waiting > 0) {
    const Entry entry = stack[--waiting];
    if (!near_enough(entry.distance)) continue;
    const WideTree::Node& node = tree.nodes[static_cast<std::size_t>(entry.child)];
    alignas(32) WideTree::Row distances;
    squared_distances<Lane>(node, p, slack, distances);
    const std::size_t bottom = waiting;
    for (std::size_t l = 0; l < lanes && node.child[l] >= 0; ++l) {
      if (!near_enough(distances[l])) continue;
      std::size_t at = waiting++;
      for (; at > bottom && stack[at - 1].distance < distances[l]; --at) stack[at] = stack[at - 1];
      stack[at] = {node.child[l], distances[l]};
    }
    if (node.leaf < 0) continue;
    for (; waiting > bottom; --waiting) {
      if (near_enough(stack[waiting - 1].distance)) search.look_at(stack[waiting - 1].child);
    }
  }
}

TISSUE_SIM_INLINE bool within(float squared_distance, double bound) {
  return static_cast<double>(std::min(squared_distance, std::numeric_limits<float>::max())) <= bound;
}

template <class Lane>
TISSUE_SIM_INLINE void closest(const WideTree& tree, const Vector3& from, ClosestSearch& search) {
  closest<Lane>(
      tree, from,
      search, [&](float distance) __attribute__((always_inline)) { return within(distance, search.bound); });
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
      tree, from, search, [&](float distance) __attribute__((always_inline)) {
        return within(distance, wanted.free_within(search.bound));
      });
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
      const Vector3 normal = area_normal(vertices[a], vertices[b], vertices[c]).stableNormalized();
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

  void set_lane(int index, std::size_t l, const Box& box, int child) {
    WideTree::Node& node = tree.nodes[static_cast<std::size_t>(index)];
    for (int axis = 0; axis < 3; ++axis) {
      node.lower[static_cast<std::size_t>(axis)][l] = static_cast<float>(box.lower[axis]);
      node.upper[static_cast<std::size_t>(axis)][l] = static_cast<float>(box.upper[axis]);
    }
    node.child[l] = child;
  }
};

}  // namespace

bool available(Registers registers) {
  return registers == Registers::narrow || available(InstructionSet::avx2);
}

Registers widest_registers() {
  return instruction_set() == InstructionSet::baseline ? Registers::narrow : Registers::wide;
}

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

void find_crossing_pairs(const WideTree& tree, const std::vector<FloatPoint>& points, const std::vector<Edge>& edges,
                         const int* chosen, std::size_t count, WideTreeRoom& room, std::vector<EdgeTrianglePair>& pairs,
                         Registers registers) {
#ifdef __x86_64__
  if (registers == Registers::wide) return find_pairs_wide(tree, points, edges, chosen, count, room, pairs);
#endif
  find_pairs_narrow(tree, points, edges, chosen, count, room, pairs);
}

ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const WideTree& tree, const Vector3& p, double reach, int guess, Registers registers) {
  ClosestSearch search(vertices, triangles, p, reach);
  if (!p.allFinite()) return search.best;
  if (guess >= 0) search.look_at(guess);
#ifdef __x86_64__
  if (registers == Registers::wide) {
    closest_wide(tree, p, search);
    return search.best;
  }
#endif
  closest_narrow(tree, p, search);
  return search.best;
}

ClosestOnMesh free_around(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                          const WideTree& tree, const Vector3& p, double little, double enough, int guess,
                          Registers registers) {
  ClosestSearch search(vertices, triangles, p, std::numeric_limits<double>::max());
  if (!p.allFinite()) return search.best;
  if (guess >= 0) search.look_at(guess);
  const Wanted wanted = {little * little, enough * enough};
#ifdef __x86_64__
  if (registers == Registers::wide) {
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
