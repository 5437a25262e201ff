#pragma once

#include <array>
#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// An axis-aligned box. Starts empty: it overlaps nothing until a point is added.
struct Box {
  Vector3 lower = Vector3::Constant(1e300);
  Vector3 upper = Vector3::Constant(-1e300);

  void add(const Vector3& p) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  void add(const Box& box) {
    lower = lower.cwiseMin(box.lower);
    upper = upper.cwiseMax(box.upper);
  }
  Box grown(double by) const { return {lower.array() - by, upper.array() + by}; }
  Vector3 size() const { return upper - lower; }

  /// Boxes that share a face overlap. A box with a NaN overlaps nothing. Without branches: which side fails is
  /// anybody's guess.
  bool overlaps(const Box& box) const {
    return static_cast<bool>(
        static_cast<int>(lower.x() <= box.upper.x()) & static_cast<int>(box.lower.x() <= upper.x()) &
        static_cast<int>(lower.y() <= box.upper.y()) & static_cast<int>(box.lower.y() <= upper.y()) &
        static_cast<int>(lower.z() <= box.upper.z()) & static_cast<int>(box.lower.z() <= upper.z()));
  }
  bool contains(const Vector3& p) const {
    return lower.x() <= p.x() && p.x() <= upper.x() && lower.y() <= p.y() && p.y() <= upper.y() && lower.z() <= p.z() &&
           p.z() <= upper.z();
  }
  double squared_distance(const Vector3& p) const {
    return (lower - p).cwiseMax(p - upper).cwiseMax(0.0).squaredNorm();
  }
};

Box bounds_of(const std::vector<Vector3>& points);

/// The box of each triangle, grown by `margin` (m). Allocates only where `boxes` has fewer entries than there are
/// triangles.
void fit_boxes(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles, double margin,
               std::vector<Box>& boxes);

/// A binary tree of boxes over items 0 .. n - 1. The shape is fixed when it is built; refit() follows items that move.
class AabbTree {
 public:
  static constexpr int leaf_size = 4;
  static constexpr int max_depth = 64;  ///< halving 2^31 items ends far above this

  void build(const std::vector<Box>& boxes);

  /// Takes the boxes of moved items, same order and number as in build(). No allocation.
  void refit(const std::vector<Box>& boxes);

  bool empty() const { return nodes_.empty(); }
  const Box& bounds() const { return nodes_.front().box; }

  /// Calls visit(item) for every item whose leaf overlaps `box`: a superset of the items that do, in a fixed order.
  template <class Visit>
  void for_each_near(const Box& box, Visit&& visit) const;

  /// Calls visit(item, other_item) for every pair whose leaves overlap: a superset, in a fixed order.
  template <class Visit>
  void for_each_near_pair(const AabbTree& other, Visit&& visit) const;

  /// Calls visit(item, bound) nearest leaf first, skipping what is farther from `p` than sqrt(bound); visit lowers the
  /// bound (squared distance) when it finds something nearer.
  template <class Visit>
  void for_each_by_distance(const Vector3& p, double& bound, Visit&& visit) const;

 private:
  /// Children of an inner node: the next node and `right`. A leaf has count > 0 items from `first`.
  struct Node {
    Box box;
    int right = 0;
    int first = 0;
    int count = 0;
  };

  int build_node(const std::vector<Box>& boxes, int first, int count);
  void fit_node(const std::vector<Box>& boxes, int node);

  std::vector<Node> nodes_;  ///< depth first: every child stands after its parent
  std::vector<int> items_;
};

template <class Visit>
void AabbTree::for_each_near(const Box& box, Visit&& visit) const {
  if (nodes_.empty()) return;
  std::array<int, max_depth> stack;
  int depth = 0;
  stack[0] = 0;
  while (depth >= 0) {
    const int index = stack[depth--];
    const Node& node = nodes_[index];
    if (!node.box.overlaps(box)) continue;
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) visit(items_[i]);
    } else {
      stack[++depth] = node.right;
      stack[++depth] = index + 1;
    }
  }
}

template <class Visit>
void AabbTree::for_each_near_pair(const AabbTree& other, Visit&& visit) const {
  if (nodes_.empty() || other.nodes_.empty()) return;
  std::array<std::array<int, 2>, 2 * max_depth> stack;
  int depth = 0;
  stack[0] = {0, 0};
  while (depth >= 0) {
    const auto [mine, theirs] = stack[depth--];
    const Node& a = nodes_[mine];
    const Node& b = other.nodes_[theirs];
    if (!a.box.overlaps(b.box)) continue;
    if (a.count > 0 && b.count > 0) {
      for (int i = a.first; i < a.first + a.count; ++i) {
        for (int j = b.first; j < b.first + b.count; ++j) {
          visit(items_[i], other.items_[j]);
        }
      }
    } else if (b.count > 0 || (a.count == 0 && a.box.size().sum() >= b.box.size().sum())) {
      stack[++depth] = {a.right, theirs};
      stack[++depth] = {mine + 1, theirs};
    } else {
      stack[++depth] = {mine, b.right};
      stack[++depth] = {mine, theirs + 1};
    }
  }
}

template <class Visit>
void AabbTree::for_each_by_distance(const Vector3& p, double& bound, Visit&& visit) const {
  if (nodes_.empty()) return;
  struct Entry {
    int node;
    double distance;
  };
  std::array<Entry, max_depth> stack;
  int depth = 0;
  stack[0] = {0, nodes_[0].box.squared_distance(p)};
  while (depth >= 0) {
    const Entry entry = stack[depth--];
    if (!(entry.distance <= bound)) continue;  // a NaN is no hit
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      for (int i = node.first; i < node.first + node.count; ++i) visit(items_[i], bound);
      continue;
    }
    Entry near = {entry.node + 1, nodes_[entry.node + 1].box.squared_distance(p)};
    Entry far = {node.right, nodes_[node.right].box.squared_distance(p)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[++depth] = far;
    stack[++depth] = near;
  }
}

}  // namespace tissue_sim
