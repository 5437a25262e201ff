#include "tissue_sim/tissue/wall.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/elementary.h"
#include "tissue_sim/tissue/material.h"

namespace tissue_sim {

namespace {

// Floors for measures that are near zero at rest, as fractions of the mean over the organ. Without the last, Eq. 8
// divides by zero on every flat pair of triangles.
constexpr double shortest_length = 0.5;
constexpr double smallest_area = 0.25;
constexpr double smallest_volume = 0.1;  ///< of the cube of the flap's own mean edge

/// How much stiffer than its wall an organ's content is when both are blown up alike. 10 keeps the volume to a tenth of
/// what the wall alone would let it change.
constexpr double content_over_wall = 10.0;

std::vector<double> triangle_areas(const RestShape& shape) {
  std::vector<double> areas;
  for (const auto& [a, b, c] : shape.wall_triangles()) {
    areas.push_back(0.5 * area_normal(shape.positions[a], shape.positions[b], shape.positions[c]).norm());
  }
  return areas;
}

double edge_length(const RestShape& shape, int edge) {
  const auto& [a, b] = shape.wall_topology().edges[edge];
  return (shape.positions[b] - shape.positions[a]).norm();
}

int opposite_corner(const RestShape& shape, int triangle, int edge) {
  const auto& [a, b] = shape.wall_topology().edges[edge];
  for (const int vertex : shape.wall_triangles()[triangle]) {
    if (vertex != a && vertex != b) return vertex;
  }
  return -1;
}

void add_distances(const WallStiffness& wall, const std::vector<double>& areas, double mean_edge, RestShape& shape) {
  const MeshTopology& topology = shape.wall_topology();
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    DistanceElement element;
    element.vertices = topology.edges[e];
    element.rest = edge_length(shape, static_cast<int>(e));
    element.scale = std::max(element.rest, shortest_length * mean_edge);
    for (const int t : topology.edge_triangles[e]) {
      if (t >= 0)
        element.stiffness += wall.distance * areas[t] / 3.0;  // each triangle shares its area among three edges
    }
    shape.distances.push_back(element);
  }
}

void add_areas(const WallStiffness& wall, const std::vector<double>& areas, double mean_area, RestShape& shape) {
  if (!(wall.area > 0.0)) return;
  for (std::size_t t = 0; t < areas.size(); ++t) {
    AreaElement element;
    element.vertices = shape.wall_triangles()[t];
    element.rest = areas[t];
    element.scale = std::max(element.rest, smallest_area * mean_area);
    element.stiffness = wall.area * areas[t];
    shape.areas.push_back(element);
  }
}

/// A flap of edge length l between triangles of area A1 and A2 turns by dV = 2 A1 A2 / (3 l) an angle. A hexagonal
/// lattice of hinges with energy 1/2 kappa angle^2 bends like a plate of stiffness D when kappa = D l^2 / (A1 + A2)
/// (Seung and Nelson 1988), so k = kappa (scale / dV)^2.
void add_flaps(const WallStiffness& wall, const std::vector<double>& areas, double mean_area, double mean_edge,
               RestShape& shape) {
  const MeshTopology& topology = shape.wall_topology();
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    const auto& [t1, t2] = topology.edge_triangles[e];
    if (t1 < 0 || t2 < 0) continue;
    const int edge = static_cast<int>(e);
    VolumeElement element;
    element.vertices = {topology.edges[e][0], topology.edges[e][1], opposite_corner(shape, t1, edge),
                        opposite_corner(shape, t2, edge)};
    const ElementVectors<VolumeElement> x = gather(element, shape.positions);
    double six_edges = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) six_edges += (x[j] - x[i]).norm();
    }
    ElementVectors<VolumeElement> gradient;
    element.rest = element.evaluate(x, gradient);
    element.scale = std::max(std::abs(element.rest), smallest_volume * cube(six_edges / 6.0));

    const double length = std::max(edge_length(shape, edge), shortest_length * mean_edge);
    const double area_1 = std::max(areas[t1], smallest_area * mean_area);
    const double area_2 = std::max(areas[t2], smallest_area * mean_area);
    const double volume_per_angle = 2.0 * area_1 * area_2 / (3.0 * length);
    const double hinge = wall.bending * length * length / (area_1 + area_2);
    element.stiffness = hinge * square(element.scale / volume_per_angle);
    shape.volumes.push_back(element);
  }
}

void add_enclosed_volume(const WallStiffness& wall, const Organ& organ, double area, RestShape& shape) {
  shape.enclosed.rest =
      shape.shell.empty() ? enclosed_volume(organ.mesh) : enclosed_volume({shape.positions, shape.shell});
  shape.enclosed.wall = 2.0 / 9.0 * area * wall.membrane / (1.0 - organ.material.poisson);
  shape.enclosed.stiffness = content_over_wall * shape.enclosed.wall;
}

/// Each triangle of the wall gives a third of its mass to each corner.
void add_wall_masses(const Organ& organ, const std::vector<double>& areas, RestShape& shape) {
  for (std::size_t t = 0; t < areas.size(); ++t) {
    for (const int v : shape.wall_triangles()[t])
      shape.mass[v] += organ.material.density * organ.wall_thickness * areas[t] / 3.0;
  }
}

}  // namespace

void add_wall(const Organ& organ, RestShape& shape) {
  WallStiffness wall = wall_stiffness(organ.material, organ.wall_thickness);
  wall.bending *= shape.shell_bending;
  const std::vector<double> areas = triangle_areas(shape);
  double area = 0.0;
  for (const double a : areas) area += a;
  const double mean_area = area / static_cast<double>(areas.size());
  const double mean_edge = mean_edge_length(shape.positions, shape.wall_topology().edges);

  add_wall_masses(organ, areas, shape);
  add_distances(wall, areas, mean_edge, shape);
  add_areas(wall, areas, mean_area, shape);
  add_flaps(wall, areas, mean_area, mean_edge, shape);
  add_enclosed_volume(wall, organ, area, shape);
}

}  // namespace tissue_sim
