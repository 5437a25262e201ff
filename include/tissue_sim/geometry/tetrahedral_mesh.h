#pragma once

#include <array>
#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Vertex indices (a, b, c, d) of positive volume: (b - a) x (c - a) . (d - a) > 0, so the triangle (a, b, c) runs
/// counter-clockwise seen from d.
using Tetrahedron = std::array<int, 4>;

/// Corners of the face opposite each corner, counter-clockwise seen from outside.
constexpr std::array<std::array<int, 3>, 4> outward_faces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// A solid cut into tetrahedra. Lengths in metres.
struct TetrahedralMesh {
  std::vector<Vector3> vertices;
  std::vector<Tetrahedron> tetrahedra;

  bool empty() const { return tetrahedra.empty(); }
};

/// Signed volume, m^3.
inline double tetrahedron_volume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

inline double tetrahedron_volume(const TetrahedralMesh& mesh, const Tetrahedron& t) {
  return tetrahedron_volume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]);
}

/// m^2.
double squared_longest_edge(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// Without volume: below 1e-12 of the cube of the longest edge (a regular one has 0.118 of it), which is where the
/// volume is rounding error. NaN counts as flat.
bool is_flat(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// What is wrong with a solid, counted. The surface is the faces of one tetrahedron only.
struct TetrahedralFaults {
  int non_finite_vertices = 0;
  int bad_indices = 0;        ///< tetrahedra that name a vertex that is not there; nothing else is counted then
  int repeated_corners = 0;   ///< tetrahedra that name a vertex twice; they are left out of what follows
  int flat = 0;               ///< is_flat()
  int inverted = 0;           ///< negative volume; orient() mends it
  int duplicates = 0;         ///< the same four corners once more
  int crowded_faces = 0;      ///< faces of three tetrahedra or more
  int overlapping_faces = 0;  ///< faces with both their tetrahedra on one side, duplicates included
  int non_manifold_surface_edges = 0;     ///< surface edges with other than two surface faces
  int non_manifold_surface_vertices = 0;  ///< vertices whose surface faces form more than one fan
  int unreferenced_vertices = 0;
  int components = 0;  ///< solids that share no vertex

  /// One solid or more, and no fault.
  bool sound() const;
};

TetrahedralFaults inspect(const TetrahedralMesh& mesh);

/// Swaps two corners of the tetrahedra of negative volume. Returns how many there were.
int orient(TetrahedralMesh& mesh);

/// Drops the vertices that no tetrahedron names and keeps the order of the others. Returns how many were dropped.
int drop_unreferenced(TetrahedralMesh& mesh);

/// The surface, facing outward: the faces of one tetrahedron only, in the order of the tetrahedra. Renumbers the
/// vertices of `mesh`: first those of the surface, then the others, each in their old order, so that vertex i of the
/// surface is vertex i of the mesh. Needs sound indices and positive volumes.
TriangleMesh take_surface(TetrahedralMesh& mesh);

/// The points' indices along a Morton curve of 2^21 cells along the longest side of their box; ties by index.
std::vector<int> along_curve(const std::vector<Vector3>& points);

/// Sorts the tetrahedra along a Morton curve through their centroids, so that neighbours in memory are neighbours in
/// space. Vertices stay as they are. Needs finite vertices.
void sort_for_locality(TetrahedralMesh& mesh);

/// Renumbers the vertices along a Morton curve through them. take_surface() keeps that order among the vertices of the
/// surface and among the others. Needs finite vertices.
void sort_vertices_for_locality(TetrahedralMesh& mesh);

/// A block with its top at z = 0 and its bottom at z = -size.z, centred on the z axis. Each of the `cells` (along x, y,
/// z; 1 or more) is cut into six tetrahedra around a diagonal (Kuhn), its neighbours mirrored, so that they fit
/// together and no direction is preferred. `size` in metres. Vertex (i, j, k) is number i + (cells[0] + 1) * (j +
/// (cells[1] + 1) * k), k from the bottom up.
TetrahedralMesh make_block(const Vector3& size, const std::array<int, 3>& cells);

/// The same with the planes between the cells given, in metres: two or more along each axis, strictly ascending.
TetrahedralMesh make_block(const std::array<std::vector<double>, 3>& planes);

/// m^3; inverted tetrahedra count as negative.
double solid_volume(const TetrahedralMesh& mesh);

}  // namespace tissue_sim
