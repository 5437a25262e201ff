#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/instruction_set.h"

namespace tissue_sim {

/// Which registers the boxes are compared in: 16 bytes wide, which every x86-64 has (and other processors by the
/// compiler's own means), or 32. Which pairs come out of a query depends on neither.
enum class Registers { narrow, wide };

/// Whether this build has code for it and this processor can run it. `narrow` always is.
bool available(Registers registers);

/// What instruction_set() has.
Registers widest_registers();

/// A point in single precision, rounded; the fourth number is nothing.
using FloatPoint = std::array<float, 4>;

inline FloatPoint to_float(const Vector3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()), 0.0F};
}

/// A tree with eight children a node over the triangles of a mesh that never moves. In single precision: rounding keeps
/// the order of numbers, so boxes that overlap still do when all their sides are rounded.
struct WideTree {
  static constexpr std::size_t lanes = 8;
  using Row = std::array<float, lanes>;

  /// Lanes without a child are boxes that nothing overlaps. The children of a leaf are triangles, those of other nodes are nodes.
  struct alignas(32) Node {
    std::array<Row, 3> lower;
    std::array<Row, 3> upper;
    std::array<int, lanes> child;
    int leaf = -1;  ///< into leaves, or -1
  };

  /// The corners of a leaf's triangles, lane by lane; free lanes repeat the last triangle.
  struct alignas(32) Leaf {
    std::array<std::array<Row, 3>, 3> corners;  ///< corner, axis
    std::array<Row, 3> normal;                  ///< unit, or zero where the triangle is degenerate
    Row offset;                                 ///< m, of the plane: normal . corner
    float extent = 0.0F;                        ///< m, the longest side of the box of any of them
  };

  std::vector<Node> nodes;  ///< the root first
  std::vector<Leaf> leaves;
  int height = 0;      ///< nodes on the way from the root to a leaf
  float farthest = 0;  ///< m, the largest coordinate of a corner
};

WideTree build_wide_tree(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles);

/// An edge and a triangle that may cross.
struct EdgeTrianglePair {
  int edge = 0;
  int triangle = 0;
  bool within_rims = false;  ///< of the triangle, runs the line of the edge, surely: see hit_within_rims
};

/// An edge near to a leaf: numbers among those that are chosen, and among the nodes.
struct EdgeLeafVisit {
  int edge = 0;
  int leaf = 0;
  unsigned triangles = 0;    ///< lanes of the leaf, a bit each
  unsigned within_rims = 0;  ///< of these: surely, as in EdgeTrianglePair
};

/// The ends of an edge and its box.
struct FloatEdge {
  FloatPoint p, q, lower, upper;
};

/// Room for queries. Nothing is allocated once it has been as large as it needs.
struct WideTreeRoom {
  std::vector<int> stack;
  std::vector<int> leaves;           ///< nodes that are leaves
  std::vector<WideTree::Node> near;  ///< boxes of `leaves`, eight a node
  std::vector<FloatEdge> edges;      ///< that are chosen
  std::vector<EdgeLeafVisit> visits;
};

/// Appends the pairs of edges that run near to each other (such as those of a patch) and triangles of the tree that may
/// cross: every pair that does (see hit_edge_triangle), few that do not, the pairs of an edge together. `points` has an
/// entry for every vertex (rounded, in the tree's frame), of which those of the edges are read; `chosen` are the
/// `count` edges to look at.
void find_crossing_pairs(const WideTree& tree, const std::vector<FloatPoint>& points, const std::vector<Edge>& edges,
                         const int* chosen, std::size_t count, WideTreeRoom& room, std::vector<EdgeTrianglePair>& pairs,
                         Registers registers = widest_registers());

/// A ball around p that the surface does not reach into: `squared_distance` is the square of its radius, and `triangle`
/// one near to p, or -1 where p is not a number. The largest such ball where its radius is between `little` and
/// `enough` (m); else at least four fifths of that, on the same side of both: that takes a fraction of the search.
ClosestOnMesh free_around(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                          const WideTree& tree, const Vector3& p, double little, double enough, int guess = -1,
                          Registers registers = widest_registers());

/// As closest_on_mesh.
ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const WideTree& tree, const Vector3& p, double reach, int guess = -1,
                              Registers registers = widest_registers());

}  // namespace tissue_sim
