#include "tissue_sim/contact/instrument_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {
/// m; nearer to the surface than this, the way to the closest point is rounding and the surface's normal is used.
constexpr double on_surface = 1e-9;

/// rad; triangles that turn from the vertex's normal by more than this meet in a corner and do not stand for a curve.
constexpr double corner_angle = 0.5;

double angle_between(const Vector3& unit_a, const Vector3& unit_b) {
  return arc_cosine(std::clamp(unit_a.dot(unit_b), -1.0, 1.0));
}

/// Along an edge of length e the normal of a curve of radius r turns by e / r.
double radius_at(const InstrumentSurface& surface, int vertex) {
  const Vector3& normal = surface.vertex_normals[vertex];
  const FlatLists& triangles = surface.topology.vertex_triangles;
  for (const int* t = triangles.begin(vertex); t != triangles.end(vertex); ++t) {
    if (angle_between(surface.normals[*t], normal) > corner_angle) return 0.0;
  }
  double smallest = std::numeric_limits<double>::max();
  const FlatLists& edges = surface.topology.vertex_edges;
  for (const int* e = edges.begin(vertex); e != edges.end(vertex); ++e) {
    const auto& [a, b] = surface.topology.edges[*e];
    const double angle = angle_between(surface.vertex_normals[a], surface.vertex_normals[b]);
    smallest = std::min(smallest, (surface.vertices[a] - surface.vertices[b]).norm() / std::max(angle, 1e-9));
  }
  return smallest;
}

/// As pseudonormal() and normalised, from what was computed when the surface was built.
Vector3 normal_at(const InstrumentSurface& surface, int triangle, Feature feature) {
  if (feature == Feature::face) return surface.normals[triangle];
  const int which = static_cast<int>(feature) % 3;
  if (feature < Feature::rim_0) return surface.vertex_normals[surface.triangles[triangle][which]];
  Vector3 sum = Vector3::Zero();
  for (const int t : surface.topology.edge_triangles[surface.topology.triangle_edges[triangle][which]]) {
    if (t >= 0) sum += surface.normals[t];
  }
  return unit_or_zero(sum);
}

}  // namespace

InstrumentSurface build_instrument_surface(const TriangleMesh& mesh, bool closed) {
  InstrumentSurface surface;
  surface.vertices = mesh.vertices;
  surface.triangles = mesh.triangles;
  surface.topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  surface.bounds = bounds_of(mesh.vertices);
  surface.closed = closed;
  for (const Vector3& v : mesh.vertices) surface.reach = std::max(surface.reach, v.norm());

  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 normal = area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    surface.planes.push_back({mesh.vertices[a], normal});
    surface.normals.push_back(unit_or_zero(normal));
  }
  surface.tree = build_wide_tree(mesh.vertices, mesh.triangles);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const int vertex = static_cast<int>(v);
    const int triangle = *surface.topology.vertex_triangles.begin(vertex);
    const Triangle& corners = mesh.triangles[triangle];
    const int corner = corners[0] == vertex ? 0 : corners[1] == vertex ? 1 : 2;
    surface.vertex_normals.push_back(unit_or_zero(
        pseudonormal(mesh.vertices, mesh.triangles, surface.topology, triangle, static_cast<Feature>(corner))));
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    surface.radii.push_back(radius_at(surface, static_cast<int>(v)));
  }
  return surface;
}

std::vector<int> sharper_than(const InstrumentSurface& surface, double radius) {
  std::vector<int> vertices;
  for (std::size_t v = 0; v < surface.radii.size(); ++v) {
    if (surface.radii[v] < radius) vertices.push_back(static_cast<int>(v));
  }
  return vertices;
}

ClosestFeature feature_at(const InstrumentSurface& surface, const Vector3& p, const ClosestOnMesh& closest) {
  if (closest.triangle < 0) return {p, Vector3::UnitZ(), -std::numeric_limits<double>::max(), -1};
  const Vector3 normal = normal_at(surface, closest.triangle, closest.on.feature);
  const Vector3 way_out = closest.on.point - p;
  const double distance = std::sqrt(closest.squared_distance);
  const bool inside = way_out.dot(normal) > 0.0;
  if (distance < on_surface) return {closest.on.point, normal, inside ? distance : -distance, closest.triangle};
  if (inside) return {closest.on.point, way_out / distance, distance, closest.triangle};
  return {closest.on.point, -way_out / distance, -distance, closest.triangle};
}

ClosestFeature closest_feature(const InstrumentSurface& surface, const Vector3& p, double reach, int guess) {
  return feature_at(surface, p, closest_on_mesh(surface.vertices, surface.triangles, surface.tree, p, reach, guess));
}

}  // namespace tissue_sim
