#include "tissue_sim/geometry/aabb_tree.h"

#include <algorithm>
#include <numeric>

namespace tissue_sim {

Box bounds_of(const std::vector<Vector3>& points) {
  Box box;
  for (const Vector3& p : points) box.add(p);
  return box;
}

void fit_boxes(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles, double margin,
               std::vector<Box>& boxes) {
  boxes.resize(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    Box box;
    for (const int v : triangles[t]) box.add(vertices[v]);
    boxes[t] = box.grown(margin);
  }
}

void AabbTree::build(const std::vector<Box>& boxes) {
  nodes_.clear();
  items_.resize(boxes.size());
  std::iota(items_.begin(), items_.end(), 0);
  if (boxes.empty()) return;
  nodes_.reserve(boxes.size());
  build_node(boxes, 0, static_cast<int>(boxes.size()));
}

int AabbTree::build_node(const std::vector<Box>& boxes, int first, int count) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  if (count <= leaf_size) {
    nodes_.back().first = first;
    nodes_.back().count = count;
    fit_node(boxes, index);
    return index;
  }

  // Halve by the middle of the boxes along the longest side; equal middles by index, so that the tree is one only.
  Box centres;
  for (int i = first; i < first + count; ++i) {
    const Box& box = boxes[items_[i]];
    centres.add(0.5 * (box.lower + box.upper));
  }
  Eigen::Index axis = 0;
  centres.size().maxCoeff(&axis);
  const auto before = [&](int a, int b) {
    const Box& x = boxes[a];
    const Box& y = boxes[b];
    const double middle_a = x.lower[axis] + x.upper[axis];
    const double middle_b = y.lower[axis] + y.upper[axis];
    return middle_a < middle_b || (middle_a == middle_b && a < b);
  };
  const int half = count / 2;
  std::nth_element(items_.begin() + first, items_.begin() + first + half, items_.begin() + first + count, before);
  build_node(boxes, first, half);
  const int right = build_node(boxes, first + half, count - half);
  nodes_[index].right = right;
  fit_node(boxes, index);
  return index;
}

void AabbTree::refit(const std::vector<Box>& boxes) {
  for (int node = static_cast<int>(nodes_.size()) - 1; node >= 0; --node) fit_node(boxes, node);
}

void AabbTree::fit_node(const std::vector<Box>& boxes, int index) {
  Node& node = nodes_[index];
  node.box = Box();
  if (node.count == 0) {
    node.box.add(nodes_[index + 1].box);
    node.box.add(nodes_[node.right].box);
    return;
  }
  for (int i = node.first; i < node.first + node.count; ++i) {
    node.box.add(boxes[items_[i]]);
  }
}

}  // namespace tissue_sim
