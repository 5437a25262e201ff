#include "tissue_sim/tissue/rest_shape.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/tissue/coarse_shell.h"
#include "tissue_sim/tissue/solid.h"
#include "tissue_sim/tissue/stability.h"
#include "tissue_sim/tissue/wall.h"

namespace tissue_sim {

namespace {

/// Of the organ's mass: what the mass floor may add. On a liver-like surface 0.26 % took 108 substeps to 11.
constexpr double mass_floor = 0.005;

/// Of the tolerance of a coarse shell: the same. At 5 % it took the substeps of a stomach's from 2.8 to 2.4.
constexpr double shell_mass_floor = 0.5;

std::vector<int> find_component_roots(const MeshTopology& topology, int vertex_count) {
  std::vector<int> roots;
  std::vector<char> seen(static_cast<std::size_t>(vertex_count), 0);
  std::vector<int> stack;
  for (int root = 0; root < vertex_count; ++root) {
    if (seen[root]) continue;
    roots.push_back(root);
    seen[root] = 1;
    stack.push_back(root);
    while (!stack.empty()) {
      const int vertex = stack.back();
      stack.pop_back();
      for (const int* edge = topology.vertex_edges.begin(vertex); edge != topology.vertex_edges.end(vertex); ++edge) {
        for (const int next : topology.edges[*edge]) {
          if (seen[next]) continue;
          seen[next] = 1;
          stack.push_back(next);
        }
      }
    }
  }
  return roots;
}

/// d = 2 zeta sqrt(k m_C) with 1 / m_C = sum |grad_i C|^2 / m_i: `ratio` of what makes the element alone return without
/// swinging.
template <class Kind>
void damp(double ratio, const RestShape& shape, std::vector<Kind>& elements) {
  ElementVectors<Kind> gradient;
  for (Kind& element : elements) {
    element.evaluate(gather(element, shape.positions), gradient);
    double inverse_mass = 0.0;
    for (std::size_t i = 0; i < Kind::size; ++i) {
      inverse_mass += gradient[i].squaredNorm() / shape.mass[element.vertices[i]];
    }
    element.damping = inverse_mass > 0.0 ? 2.0 * ratio * std::sqrt(element.stiffness / inverse_mass) : 0.0;
  }
}

void damp_enclosed_volume(double ratio, RestShape& shape) {
  std::vector<Vector3> gradient(shape.positions.size());
  shape.enclosed.evaluate(shape.positions, shape.wall_triangles(), gradient);
  double inverse_mass = 0.0;
  for (std::size_t i = static_cast<std::size_t>(shape.first_simulated); i < gradient.size(); ++i) {
    inverse_mass += gradient[i].squaredNorm() / shape.mass[i];
  }
  shape.enclosed.damping = 2.0 * ratio * std::sqrt(shape.enclosed.stiffness / inverse_mass);
}

/// Puts the vertices of what carries the surface behind the surface's own.
void add_bearers(const std::vector<Vector3>& vertices, Embedding embedding, RestShape& shape) {
  shape.first_simulated = shape.surface_vertices;
  shape.embedding = std::move(embedding);
  for (Tetrahedron& corners : shape.embedding.corners) {
    for (int& corner : corners) corner += shape.first_simulated;
  }
  shape.positions.insert(shape.positions.end(), vertices.begin(), vertices.end());
  // Rounding left them within a hair of where the mesh has them; what is carried is where its bearers carry it.
  carry_surface(shape, shape.positions);
}

/// The surface, its vertices first; behind it what lies inside, or the whole solid or shell that carries it. Attaches
/// the simulated vertices that the organ holds.
void place_vertices(const Organ& organ, RestShape& shape) {
  shape.surface_vertices = static_cast<int>(organ.mesh.vertices.size());
  shape.positions = organ.mesh.vertices;
  std::vector<int> attached = organ.attached;
  if (organ.embedded) {
    add_bearers(organ.solid.vertices, embed(organ.mesh.vertices, organ.solid), shape);
  } else if (!organ.solid.empty()) {
    shape.positions = organ.solid.vertices;
  } else if (const CoarseShell coarse = coarse_shell(organ); !coarse.mesh.triangles.empty()) {
    add_bearers(coarse.mesh.vertices, coarse.embedding, shape);
    shape.shell = coarse.mesh.triangles;
    for (Triangle& corners : shape.shell) {
      for (int& corner : corners) corner += shape.first_simulated;
    }
    shape.shell_bending = coarse.bending;
    shape.shell_topology = build_topology(static_cast<int>(shape.positions.size()), shape.shell);
    attached = coarse.attached;
  }
  shape.attached.assign(shape.positions.size(), 0);
  for (const int vertex : attached) shape.attached[vertex + shape.first_simulated] = 1;
}

/// A foot goes by its weights. What lies above a triangle swings with its normal, which turns by the way of a corner
/// over a height of the triangle; twice that, for triangles that have been squeezed.
double carried_way(const RestShape& shape) {
  double farthest = 1.0;
  const Embedding& embedding = shape.embedding;
  for (std::size_t v = 0; v < embedding.corners.size(); ++v) {
    double way = 0.0;
    for (const double weight : embedding.weights[v]) way += std::abs(weight);
    if (!embedding.offsets.empty()) {
      const Tetrahedron& t = embedding.corners[v];
      const Vector3& a = shape.positions[t[0]];
      const Vector3& b = shape.positions[t[1]];
      const Vector3& c = shape.positions[t[2]];
      const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
      way += 4.0 * std::abs(embedding.offsets[v]) * longest / area_normal(a, b, c).norm();
    }
    farthest = std::max(farthest, way);
  }
  return farthest;
}

}  // namespace

void carry(const RestShape& shape, int vertex, std::vector<Vector3>& positions) {
  positions[vertex] = embedded_point(shape.embedding, static_cast<std::size_t>(vertex), positions);
}

void carry_surface(const RestShape& shape, std::vector<Vector3>& positions) {
  for (int v = 0; v < shape.first_simulated; ++v) carry(shape, v, positions);
}

RestShape build_rest_shape(const Organ& organ) {
  RestShape shape;
  place_vertices(organ, shape);
  shape.carried_way = carried_way(shape);
  shape.triangles = organ.mesh.triangles;
  shape.topology = build_topology(shape.surface_vertices, shape.triangles);
  shape.component_roots = find_component_roots(shape.topology, shape.surface_vertices);
  shape.mean_edge = mean_edge_length(shape.positions, shape.topology.edges);
  shape.size = bounds_of(organ.mesh.vertices).size().norm();
  shape.mass.assign(shape.positions.size(), organ.model == Model::contact_only ? 1.0 : 0.0);

  if (organ.model == Model::surface) add_wall(organ, shape);
  if (is_solid(organ.model)) add_solid(organ, shape);
  if (shape.elastic()) {
    apply_mass_floor(
        shape.shell.empty() ? mass_floor : std::max(mass_floor, shell_mass_floor * *organ.levels_tolerance), shape);
    damp(organ.material.damping, shape, shape.distances);
    damp(organ.material.damping, shape, shape.areas);
    damp(organ.material.damping, shape, shape.volumes);
    if (shape.enclosed.stiffness > 0.0) damp_enclosed_volume(organ.material.damping, shape);
    for (const double m : shape.mass) shape.total_mass += m;
  }

  for (std::size_t v = 0; v < shape.mass.size(); ++v) {
    const bool moves = shape.mass[v] > 0.0 && !shape.attached[v];
    shape.inverse_mass.push_back(moves ? 1.0 / shape.mass[v] : 0.0);
  }
  if (shape.elastic()) {
    shape.fastest_frequency = fastest_frequency(shape);
    // Stiffness-proportional: what moves at the fastest frequency is damped by the ratio, slower motion by less.
    if (!shape.tetrahedra.empty()) shape.damping_time = 2.0 * organ.material.damping / shape.fastest_frequency;
    const double safety = organ.model == Model::fem      ? solid_safety
                          : organ.model == Model::volume ? volume_safety
                                                         : surface_safety;
    shape.stable_substep = stable_substep(shape, safety, organ.model == Model::fem ? solid_safety : surface_safety);
    shape.stiffest_element = stiffest_element(shape, shape.positions);
  }
  return shape;
}

}  // namespace tissue_sim
