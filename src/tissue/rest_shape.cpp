#include "tissue_sim/tissue/rest_shape.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/tissue/material.h"
#include "tissue_sim/tissue/stability.h"

namespace tissue_sim {

namespace {

// Floors for measures that are near zero at rest, as fractions of the mean over the organ. Without the last, Eq. 8
// divides by zero on every flat pair of triangles.
constexpr double shortest_length = 0.5;
constexpr double smallest_area = 0.25;
constexpr double smallest_volume = 0.1;  ///< of the cube of the flap's own mean edge

/// Of the organ's mass: what the mass floor may add. On a liver-like surface 0.26 % took 108 substeps to 11.
constexpr double mass_floor = 0.005;

/// Of the substep that is stable at rest: a stretched surface is stiffer, and contact confines it.
constexpr double safety = 0.4;

/// How much stiffer than its wall an organ's content is when both are blown up alike. 10 keeps the volume to a tenth of
/// what the wall alone would let it change.
constexpr double content_over_wall = 10.0;

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

std::vector<double> triangle_areas(const RestShape& shape) {
  std::vector<double> areas;
  for (const auto& [a, b, c] : shape.triangles) {
    areas.push_back(0.5 * area_normal(shape.positions[a], shape.positions[b], shape.positions[c]).norm());
  }
  return areas;
}

double edge_length(const RestShape& shape, int edge) {
  const auto& [a, b] = shape.topology.edges[edge];
  return (shape.positions[b] - shape.positions[a]).norm();
}

int opposite_corner(const RestShape& shape, int triangle, int edge) {
  const auto& [a, b] = shape.topology.edges[edge];
  for (const int vertex : shape.triangles[triangle]) {
    if (vertex != a && vertex != b) return vertex;
  }
  return -1;
}

void add_distances(const WallStiffness& wall, const std::vector<double>& areas, RestShape& shape) {
  for (std::size_t e = 0; e < shape.topology.edges.size(); ++e) {
    DistanceElement element;
    element.vertices = shape.topology.edges[e];
    element.rest = edge_length(shape, static_cast<int>(e));
    element.scale = std::max(element.rest, shortest_length * shape.mean_edge);
    for (const int t : shape.topology.edge_triangles[e]) {
      if (t >= 0)
        element.stiffness += wall.distance * areas[t] / 3.0;  // each triangle shares its area among three edges
    }
    shape.distances.push_back(element);
  }
}

void add_areas(const WallStiffness& wall, const std::vector<double>& areas, double mean_area, RestShape& shape) {
  if (!(wall.area > 0.0)) return;
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    AreaElement element;
    element.vertices = shape.triangles[t];
    element.rest = areas[t];
    element.scale = std::max(element.rest, smallest_area * mean_area);
    element.stiffness = wall.area * areas[t];
    shape.areas.push_back(element);
  }
}

/// A flap of edge length l between triangles of area A1 and A2 turns by dV = 2 A1 A2 / (3 l) an angle. A hexagonal
/// lattice of hinges with energy 1/2 kappa angle^2 bends like a plate of stiffness D when kappa = D l^2 / (A1 + A2)
/// (Seung and Nelson 1988), so k = kappa (scale / dV)^2.
void add_flaps(const WallStiffness& wall, const std::vector<double>& areas, double mean_area, RestShape& shape) {
  for (std::size_t e = 0; e < shape.topology.edges.size(); ++e) {
    const auto& [t1, t2] = shape.topology.edge_triangles[e];
    if (t1 < 0 || t2 < 0) continue;
    const int edge = static_cast<int>(e);
    VolumeElement element;
    element.vertices = {shape.topology.edges[e][0], shape.topology.edges[e][1], opposite_corner(shape, t1, edge),
                        opposite_corner(shape, t2, edge)};
    const ElementVectors<VolumeElement> x = gather(element, shape.positions);
    double six_edges = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) six_edges += (x[j] - x[i]).norm();
    }
    ElementVectors<VolumeElement> gradient;
    element.rest = element.evaluate(x, gradient);
    element.scale = std::max(std::abs(element.rest), smallest_volume * std::pow(six_edges / 6.0, 3));

    const double length = std::max(edge_length(shape, edge), shortest_length * shape.mean_edge);
    const double area_1 = std::max(areas[t1], smallest_area * mean_area);
    const double area_2 = std::max(areas[t2], smallest_area * mean_area);
    const double volume_per_angle = 2.0 * area_1 * area_2 / (3.0 * length);
    const double hinge = wall.bending * length * length / (area_1 + area_2);
    element.stiffness = hinge * std::pow(element.scale / volume_per_angle, 2);
    shape.flaps.push_back(element);
  }
}

void add_enclosed_volume(const WallStiffness& wall, const Organ& organ, double area, RestShape& shape) {
  shape.enclosed.rest = enclosed_volume(organ.mesh);
  const double stiffness_of_wall = 2.0 / 9.0 * area * wall.membrane / (1.0 - organ.material.poisson);
  shape.enclosed.stiffness = content_over_wall * stiffness_of_wall;
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
  shape.enclosed.evaluate(shape.positions, shape.triangles, gradient);
  double inverse_mass = 0.0;
  for (std::size_t i = 0; i < gradient.size(); ++i) inverse_mass += gradient[i].squaredNorm() / shape.mass[i];
  shape.enclosed.damping = 2.0 * ratio * std::sqrt(shape.enclosed.stiffness / inverse_mass);
}

/// Each triangle of the wall gives a third of its mass to each corner.
void add_wall_masses(const Organ& organ, const std::vector<double>& areas, RestShape& shape) {
  shape.mass.assign(shape.positions.size(), 0.0);
  for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
    for (const int v : shape.triangles[t])
      shape.mass[v] += organ.material.density * organ.wall_thickness * areas[t] / 3.0;
  }
}

}  // namespace

RestShape build_rest_shape(const Organ& organ) {
  RestShape shape;
  shape.positions = organ.mesh.vertices;
  shape.triangles = organ.mesh.triangles;
  const int vertex_count = static_cast<int>(shape.positions.size());
  shape.topology = build_topology(vertex_count, shape.triangles);
  shape.component_roots = find_component_roots(shape.topology, vertex_count);
  shape.mean_edge = mean_edge_length(shape.positions, shape.topology.edges);
  shape.size = bounds_of(shape.positions).size().norm();
  shape.attached.assign(shape.positions.size(), 0);
  for (const int vertex : organ.attached) shape.attached[vertex] = 1;
  shape.mass.assign(shape.positions.size(), 1.0);

  if (organ.model == Model::surface) {
    const WallStiffness wall = wall_stiffness(organ.material, organ.wall_thickness);
    const std::vector<double> areas = triangle_areas(shape);
    double area = 0.0;
    for (const double a : areas) area += a;
    const double mean_area = area / static_cast<double>(areas.size());

    add_wall_masses(organ, areas, shape);
    add_distances(wall, areas, shape);
    add_areas(wall, areas, mean_area, shape);
    add_flaps(wall, areas, mean_area, shape);
    add_enclosed_volume(wall, organ, area, shape);
    apply_mass_floor(mass_floor, shape);
    damp(organ.material.damping, shape, shape.distances);
    damp(organ.material.damping, shape, shape.areas);
    damp(organ.material.damping, shape, shape.flaps);
    damp_enclosed_volume(organ.material.damping, shape);
    for (const double m : shape.mass) shape.total_mass += m;
  }

  for (std::size_t v = 0; v < shape.mass.size(); ++v) {
    shape.inverse_mass.push_back(shape.attached[v] ? 0.0 : 1.0 / shape.mass[v]);
  }
  if (shape.elastic()) {
    shape.stable_substep = stable_substep(shape, safety);
    shape.stiffest_element = stiffest_element(shape, shape.positions);
  }
  return shape;
}

}  // namespace tissue_sim
