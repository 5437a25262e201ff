#include "tissue_sim/geometry/closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {

/// Nearest point of the segment between corners i and j. A zero-length segment is its first corner.
ClosestOnTriangle closest_on_rim(const Vector3& p, const std::array<const Vector3*, 3>& corners, int i, int j) {
  const Vector3& a = *corners[i];
  const Vector3 along = *corners[j] - a;
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp(along.dot(p - a) / length, 0.0, 1.0) : 0.0;
  ClosestOnTriangle closest;
  closest.barycentric.setZero();
  closest.barycentric[i] = 1.0 - t;
  closest.barycentric[j] = t;
  closest.point = t < 1.0 ? Vector3(a + t * along) : *corners[j];
  closest.feature = t <= 0.0   ? static_cast<Feature>(i)
                    : t >= 1.0 ? static_cast<Feature>(j)
                               : static_cast<Feature>(static_cast<int>(Feature::rim_0) + i);
  return closest;
}

double angle_between(const Vector3& u, const Vector3& v) {
  return angle_of(u.cross(v).norm(), u.dot(v));
}

}  // namespace

ClosestOnTriangle closest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  // The weights of the foot of p in the plane: its areas against the three rims. All positive means the foot is inside.
  const Vector3 normal = area_normal(a, b, c);
  const double area = normal.squaredNorm();
  const double weight_a = normal.dot((b - p).cross(c - p));
  const double weight_b = normal.dot((c - p).cross(a - p));
  const double weight_c = normal.dot((a - p).cross(b - p));
  if (area > 0.0 && weight_a > 0.0 && weight_b > 0.0 && weight_c > 0.0) {
    const Vector3 weights = Vector3(weight_a, weight_b, weight_c) / (weight_a + weight_b + weight_c);
    return {p - normal * (normal.dot(p - a) / area), weights, Feature::face};
  }

  const std::array<const Vector3*, 3> corners = {&a, &b, &c};
  ClosestOnTriangle best = closest_on_rim(p, corners, 0, 1);
  double best_distance = (best.point - p).squaredNorm();
  for (int i = 1; i < 3; ++i) {
    const ClosestOnTriangle rim = closest_on_rim(p, corners, i, (i + 1) % 3);
    const double distance = (rim.point - p).squaredNorm();
    if (distance < best_distance) {
      best = rim;
      best_distance = distance;
    }
  }
  return best;
}

void ClosestSearch::look_at(int triangle) {
  const auto& [a, b, c] = triangles[triangle];
  const ClosestOnTriangle on = closest_on_triangle(p, vertices[a], vertices[b], vertices[c]);
  const double distance = (on.point - p).squaredNorm();
  if (distance < bound || (distance == bound && best.triangle >= 0 && triangle < best.triangle)) {
    bound = distance;
    best = {triangle, distance, on};
  }
}

void ClosestSearch::look_at_if_near(int triangle) {
  const auto& [a, b, c] = triangles[triangle];
  const Box box = {vertices[a].cwiseMin(vertices[b]).cwiseMin(vertices[c]),
                   vertices[a].cwiseMax(vertices[b]).cwiseMax(vertices[c])};
  if (!too_far(box.squared_distance(p))) look_at(triangle);
}

ClosestOnMesh closest_on_mesh(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                              const AabbTree& tree, const Vector3& p, double reach, int guess) {
  ClosestSearch search(vertices, triangles, p, reach);
  if (guess >= 0) search.look_at(guess);
  tree.for_each_by_distance(p, search.bound, [&](int triangle, double&) { search.look_at(triangle); });
  return search.best;
}

Vector3 pseudonormal(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles,
                     const MeshTopology& topology, int triangle, Feature feature) {
  const auto corner = [&](int t, int i) -> const Vector3& { return vertices[triangles[t][i % 3]]; };
  const auto face_normal = [&](int t) { return area_normal(corner(t, 0), corner(t, 1), corner(t, 2)); };

  if (feature == Feature::face) return face_normal(triangle);
  const int which = static_cast<int>(feature) % 3;
  if (feature >= Feature::rim_0) {
    const int edge = topology.triangle_edges[triangle][which];
    Vector3 sum = Vector3::Zero();
    for (const int t : topology.edge_triangles[edge]) {
      if (t >= 0) sum += unit_or_zero(face_normal(t));
    }
    return sum;
  }
  const int vertex = triangles[triangle][which];
  Vector3 sum = Vector3::Zero();
  for (const int* t = topology.vertex_triangles.begin(vertex); t != topology.vertex_triangles.end(vertex); ++t) {
    const Triangle& corners = triangles[*t];
    const int i = corners[0] == vertex ? 0 : corners[1] == vertex ? 1 : 2;
    const double angle = angle_between(corner(*t, i + 1) - corner(*t, i), corner(*t, i + 2) - corner(*t, i));
    sum += angle * unit_or_zero(face_normal(*t));
  }
  return sum;
}

}  // namespace tissue_sim
