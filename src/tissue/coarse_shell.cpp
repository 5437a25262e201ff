#include "tissue_sim/tissue/coarse_shell.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/coarsening.h"
#include "tissue_sim/geometry/elementary.h"
#include "tissue_sim/tissue/material.h"

namespace tissue_sim {

namespace {

/// Relative error of force and of displacement near the contact, where the squares of the edges differ by that of the
/// bending length. Measured between that and everything on the organ's own mesh, a ball of 5 to 8 mm pressed 2 to 4 mm
/// in at several places, in the mean, x being that difference: sphere x = 0.3: 6 %, 0.6: 6 %, 1.1: 13 %; bundled liver
/// 0.1: 2 %, 0.3: 5 %, 0.7: 10 %; real stomach 0.6: 7 %, 1.5: 15 %, 2.5: 13 %. Over the whole surface it is up to twice
/// as much. The organ's own mesh counts, since it is what the shell is compared with, however coarse it is itself.
constexpr double error_at_one = 0.13;

/// By how much a shell that cannot follow a dent is too stiff in bending, and where it is half of that, x as above.
/// Measured: 3-5 % at x = 0.1, 8-12 % at 0.3, 9-12 % at 0.6, 14-16 % at 0.7 to 1.1. Left as it was, the force of a
/// contact came out by as much too large; with 0.16 in its place it was 2 to 7 % too small in the mean of more places.
constexpr double too_stiff = 0.13;
constexpr double half_too_stiff = 0.25;

/// Of the organ's triangles: a shell that has more is not worth its carrying.
constexpr double most_triangles = 0.85;

/// Of the organ's size: the largest radius of curvature that counts. Nothing is flat.
constexpr double largest_radius = 0.5;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double own_edge(const Organ& organ) {
  const MeshTopology topology = build_topology(static_cast<int>(organ.mesh.vertices.size()), organ.mesh.triangles);
  return mean_edge_length(organ.mesh.vertices, topology.edges);
}

/// Not unit: weighted by the areas.
std::vector<Vector3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3> normals(mesh.vertices.size(), Vector3::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Vector3 normal = area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    for (const int v : t) normals[v] += normal;
  }
  return normals;
}

/// 1/m, of each vertex: the root of the mean square over its edges of how the normal turns along them.
std::vector<double> curvatures(const TriangleMesh& mesh) {
  std::vector<Vector3> normals = vertex_normals(mesh);
  for (Vector3& normal : normals) normal = unit_or_zero(normal);
  std::vector<double> squares(mesh.vertices.size(), 0.0);
  std::vector<int> edges(mesh.vertices.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = t[i];
      const int b = t[(i + 1) % 3];
      const Vector3 along = mesh.vertices[b] - mesh.vertices[a];
      squares[a] += square((normals[b] - normals[a]).dot(along) / along.squaredNorm());
      ++edges[a];
    }
  }
  for (std::size_t v = 0; v < squares.size(); ++v) squares[v] = std::sqrt(squares[v] / edges[v]);
  return squares;
}

/// m^2, a third of the triangles around each vertex.
std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0.0);
  for (const Triangle& t : mesh.triangles) {
    const double area = area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]).norm() / 6.0;
    for (const int v : t) areas[v] += area;
  }
  return areas;
}

/// The connected patches of attached vertices: one number a vertex, -1 where it is free.
std::vector<int> attached_patches(const Organ& organ, int& count) {
  constexpr int unseen = -2;
  std::vector<int> patch(organ.mesh.vertices.size(), -1);
  for (const int v : organ.attached) patch[v] = unseen;
  const MeshTopology topology = build_topology(static_cast<int>(patch.size()), organ.mesh.triangles);
  std::vector<int> stack;
  count = 0;
  for (const int root : organ.attached) {
    if (patch[root] != unseen) continue;
    patch[root] = count;
    stack.push_back(root);
    while (!stack.empty()) {
      const int v = stack.back();
      stack.pop_back();
      for (const int* e = topology.vertex_edges.begin(v); e != topology.vertex_edges.end(v); ++e) {
        for (const int next : topology.edges[*e]) {
          if (patch[next] != unseen) continue;
          patch[next] = count;
          stack.push_back(next);
        }
      }
    }
    ++count;
  }
  return patch;
}

/// Vertices of the shell of whose area the organ holds half or more, which keeps the area that is held; and where a
/// patch would be lost in this way, the vertex that has most of it.
std::vector<int> attach(const Organ& organ, const CoarseShell& coarse) {
  int patches = 0;
  const std::vector<int> patch = attached_patches(organ, patches);
  const std::vector<double> areas = vertex_areas(organ.mesh);
  std::vector<double> of_all(coarse.mesh.vertices.size(), 0.0);
  std::vector<double> of_held(coarse.mesh.vertices.size(), 0.0);
  const auto for_each_share = [&](auto&& visit) {
    for (std::size_t v = 0; v < patch.size(); ++v) {
      for (std::size_t i = 0; i < 3; ++i) {
        visit(patch[v], coarse.embedding.corners[v][i], std::max(0.0, coarse.embedding.weights[v][i]) * areas[v]);
      }
    }
  };
  for_each_share([&](int of, int c, double area) {
    of_all[c] += area;
    if (of >= 0) of_held[c] += area;
  });
  std::vector<char> held(of_all.size(), 0);
  for (std::size_t c = 0; c < held.size(); ++c) held[c] = of_held[c] > 0.0 && of_held[c] >= 0.5 * of_all[c];

  std::vector<int> most(static_cast<std::size_t>(patches), -1);
  for_each_share([&](int of, int c, double area) {
    if (of < 0 || !(area > 0.0)) return;
    const auto part = [&](int vertex) { return of_held[vertex] / of_all[vertex]; };
    if (most[of] < 0 || part(c) > part(most[of])) most[of] = c;
  });
  for (const int c : most) {
    if (c >= 0) held[c] = 1;
  }
  std::vector<int> attached;
  for (std::size_t c = 0; c < held.size(); ++c) {
    if (held[c]) attached.push_back(static_cast<int>(c));
  }
  return attached;
}

}  // namespace

double bending_length(const Organ& organ) {
  const WallStiffness wall = wall_stiffness(organ.material, organ.wall_thickness);
  const double flattest = 1.0 / (largest_radius * bounds_of(organ.mesh.vertices).size().norm());
  const double radius = 1.0 / std::max(flattest, median(curvatures(organ.mesh)));
  return std::sqrt(std::sqrt(wall.bending / wall.membrane * radius * radius));
}

double shell_edge(const Organ& organ) {
  const double bending = std::sqrt(*organ.levels_tolerance / error_at_one) * bending_length(organ);
  return std::sqrt(square(own_edge(organ)) + square(bending));
}

CoarseShell coarse_shell(const Organ& organ) {
  CoarseShell coarse;
  if (!organ.levels_tolerance || organ.model != Model::surface) return coarse;
  coarse.mesh = coarsen(organ.mesh, shell_edge(organ));
  const double triangles = static_cast<double>(coarse.mesh.triangles.size());
  if (triangles > most_triangles * static_cast<double>(organ.mesh.triangles.size())) return {};
  coarse.embedding = embed(organ.mesh.vertices, vertex_normals(organ.mesh), coarse.mesh);
  coarse.attached = attach(organ, coarse);
  const double x = *organ.levels_tolerance / error_at_one;
  coarse.bending = 1.0 - too_stiff * x / (x + half_too_stiff);
  return coarse;
}

}  // namespace tissue_sim
