#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/instruction_set.h"

namespace tissue_sim {

/// A point in single precision, rounded; the fourth number is nothing. Read and written as one register, wherever it
/// is.
struct alignas(16) FloatPoint : std::array<float, 4> {};

inline FloatPoint to_float(const Vector3& p) {
  return {{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()), 0.0F}};
}

/// A tree with eight children a node over the triangles of a mesh that never moves. In single precision: rounding keeps
/// the order of numbers, so boxes that overlap still do when all their sides are rounded.
struct WideTree {
  static constexpr std::size_t lanes = 8;
  using Row = std::array<float, lanes>;

  /// Lanes without a child are boxes that nothing overlaps. The children of a leaf are triangles, those of other nodes
  /// are nodes.
  struct alignas(32) Node {
    std::array<Row, 3> lower;
    std::array<Row, 3> upper;
    std::array<int, lanes> child;
    int leaf = -1;               ///< into leaves, or -1
    int children = 0;            ///< in the first lanes
    unsigned leaf_children = 0;  ///< which of them are leaves, a bit each: saves a look at them
  };

  /// The corners of a leaf's triangles, lane by lane; free lanes repeat the last triangle.
  struct alignas(32) Leaf {
    std::array<std::array<Row, 3>, 3> corners;  ///< corner, axis
    std::array<Row, 3> normal;                  ///< unit, or zero where the triangle has no sure plane
    Row offset;                                 ///< m, of the plane: normal . corner
    float extent = 0.0F;                        ///< m, the longest side of the box of any of them
  };

  std::vector<Node> nodes;  ///< the root first
  std::vector<Leaf> leaves;
  int height = 0;      ///< nodes on the way from the root to a leaf
  float farthest = 0;  ///< m, the largest coordinate of a corner
};

WideTree build_wide_tree(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles);

/// Boxes of triangles that are all near, eight side by side: a search looks through them from one end to the other.
struct BoxRows {
  std::vector<WideTree::Node> rows;  ///< of which only boxes and children count: the triangles
  Vector3 origin = Vector3::Zero();  ///< m, what the boxes are measured from, so that floats keep their digits
  float farthest = 0.0F;             ///< m, the largest coordinate from there
};

/// Empties the rows.
void begin_rows(const Vector3& origin, BoxRows& boxes);

/// Adds the box of a triangle.
void add_to_rows(int triangle, const Vector3& a, const Vector3& b, const Vector3& c, BoxRows& boxes);

/// Looks at every triangle that can be nearer than what the search knows.
void look_through(const BoxRows& boxes, ClosestSearch& search, InstructionSet set = instruction_set());

/// An edge and a triangle that may cross.
struct EdgeTrianglePair {
  int edge = 0;
  int triangle = 0;
  bool within_rims = false;  ///< of the triangle, runs the line of the edge, surely: see hit_within_rims
};

/// Edges that run near to each other, such as those of a patch. Borrowed for the length of a call.
struct NearEdges {
  const FloatPoint* points;  ///< their ends, rounded, in the tree's frame
  std::size_t point_count;
  const Edge* ends;  ///< of each edge, into points
  const int* edges;  ///< what each is called
  std::size_t count;
};

/// Triangles near to some edges, packed side by side.
struct alignas(64) NearTriangles {
  static constexpr std::size_t most = 256;
  using Row = std::array<float, most + 16>;  ///< as many as a register has are written and read where the last begin

  // Set from the start, since what is behind the last is computed too: any bits could be a signalling NaN.
  std::array<Row, 3> lower{}, upper{}, normal{};  ///< as WideTree::Node and Leaf
  Row offset{};
  std::array<std::array<Row, 3>, 3> corners{};  ///< corner, axis
  std::array<int, most> triangle{};
  std::size_t count = 0;
  float extent = 0.0F;  ///< m, the longest side of the box of any of them
};

/// Where a point is to 64 packed triangles, a bit each, eight a byte. An edge can be dropped for a triangle when there
/// is one of these that neither of its ends has: both are then outside the same side of the box, or on the same side
/// of the plane.
struct PointCodes {
  enum Kind : std::size_t {
    x_below_upper,
    x_above_lower,
    y_below_upper,
    y_above_lower,
    z_below_upper,
    z_above_lower,
    not_in_front,
    not_behind,
    kinds
  };
  std::array<std::array<unsigned char, 8>, kinds> bytes;
};

/// An edge and eight packed triangles.
struct EdgeVisit {
  int edge = 0;              ///< into NearEdges
  int first = 0;             ///< into NearTriangles
  unsigned triangles = 0;    ///< that the edge may cross, a bit each
  unsigned within_rims = 0;  ///< of these: surely, as in EdgeTrianglePair
};

/// Room for queries. Nothing is allocated once it has been as large as it needs.
struct WideTreeRoom {
  std::vector<int> stack;
  std::vector<int> leaves;  ///< nodes that are leaves
  NearTriangles near;
  std::vector<PointCodes> codes;          ///< one a point
  std::vector<std::uint64_t> candidates;  ///< per edge: the packed triangles that its ends do not rule out
  std::vector<EdgeVisit> visits;
};

/// Appends the pairs of edges and triangles of the tree that may cross: every pair that does (see hit_edge_triangle),
/// few that do not, the pairs of an edge together.
void find_crossing_pairs(const WideTree& tree, const NearEdges& edges, WideTreeRoom& room,
                         std::vector<EdgeTrianglePair>& pairs, InstructionSet set = instruction_set());

/// A ball around p that the surface does not reach into: `squared_distance` is the square of its radius, and `triangle`
/// one near to p, or -1 where p is not a number. The largest such ball where its radius is between `little` and
/// `enough` (m); else at least four fifths of that, on the same side of both: that takes a fraction of the search.
ClosestOnMesh free_around(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                          const WideTree& tree, const Vector3& p, double little, double enough, int guess = -1,
                          InstructionSet set = instruction_set());

/// As closest_on_mesh.
ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const WideTree& tree, const Vector3& p, double reach, int guess = -1,
                              InstructionSet set = instruction_set());

}  // namespace tissue_sim
