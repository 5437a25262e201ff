#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace tissue_sim {

using Vector3 = Eigen::Vector3d;
using Triangle = std::array<int, 3>;  ///< vertex indices, counter-clockwise seen from outside
using Edge = std::array<int, 2>;      ///< vertex indices, the smaller first

/// Zero stays zero; Eigen's own would divide it by itself.
inline Vector3 unit_or_zero(const Vector3& vector) {
  return vector == Vector3::Zero() ? vector : Vector3(vector.stableNormalized());
}

/// A triangulated surface. Lengths in metres.
struct TriangleMesh {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
};

/// Lists of different lengths in one flat array: list i is items[first[i]] .. items[first[i + 1] - 1].
struct FlatLists {
  std::vector<int> first;
  std::vector<int> items;

  const int* begin(int list) const { return items.data() + first[list]; }
  const int* end(int list) const { return items.data() + first[list + 1]; }
};

/// Edges and neighbours of a triangle list. Immutable once built.
struct MeshTopology {
  std::vector<Edge> edges;                         ///< sorted; the smaller vertex index first
  std::vector<std::array<int, 2>> edge_triangles;  ///< the first two triangles at an edge, -1 where there is none
  std::vector<std::array<int, 3>> triangle_edges;  ///< edge i joins corner i and corner (i + 1) % 3
  FlatLists vertex_edges;                          ///< edges at each vertex, ascending
  FlatLists vertex_triangles;                      ///< triangles at each vertex, ascending
};

MeshTopology build_topology(int vertex_count, const std::vector<Triangle>& triangles);

/// What is wrong with a mesh, counted. All zero (and components > 0) for a closed, manifold, oriented surface.
struct MeshFaults {
  int non_finite_vertices = 0;
  int bad_indices = 0;            ///< triangles that name a vertex that is not there; nothing else is counted then
  int repeated_corners = 0;       ///< triangles that name a vertex twice
  int degenerate_triangles = 0;   ///< zero area in double precision, corners distinct
  int duplicate_triangles = 0;    ///< the same three corners once more
  int boundary_edges = 0;         ///< edges with one triangle
  int non_manifold_edges = 0;     ///< edges with three triangles or more
  int misoriented_edges = 0;      ///< edges that both triangles run through in the same direction
  int non_manifold_vertices = 0;  ///< vertices whose triangles form more than one fan
  int unreferenced_vertices = 0;
  int components = 0;  ///< surfaces that share no vertex

  bool closed_manifold() const;
};

MeshFaults inspect(const TriangleMesh& mesh);

struct WeldReport {
  int merged_vertices = 0;
  int removed_triangles = 0;  ///< collapsed by the merge
};

/// Merges vertices closer than `tolerance` (metres; 0 merges equal positions only), removes the triangles
/// that collapse and the vertices that no triangle names. Keeps the order of what remains.
WeldReport weld(TriangleMesh& mesh, double tolerance);

/// Turns triangles so that neighbours agree and each component encloses positive volume.
/// Returns how many triangles were turned. Needs a manifold mesh.
int orient_outward(TriangleMesh& mesh);

/// Closes every simple boundary loop with a fan around its centre. Returns the number of loops closed.
int close_holes(TriangleMesh& mesh);

/// Signed volume, m^3: positive when the triangles face outward. Sum of tetrahedra over the centroid.
double enclosed_volume(const TriangleMesh& mesh);

/// Twice the area times the unit normal of triangle (a, b, c).
inline Vector3 area_normal(const Vector3& a, const Vector3& b, const Vector3& c) {
  return (b - a).cross(c - a);
}

double mean_edge_length(const std::vector<Vector3>& vertices, const std::vector<Edge>& edges);

}  // namespace tissue_sim
