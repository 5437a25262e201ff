#include "tissue_sim/geometry/primitives.h"

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {
constexpr double pi = 3.14159265358979323846;

Vector3 on_circle(int i, int n, double radius, double z) {
  const double angle = 2.0 * pi * i / n;
  return {radius * cosine(angle), radius * sine(angle), z};
}
}  // namespace

TriangleMesh make_sphere(double radius, int n) {
  TriangleMesh mesh;
  mesh.vertices.reserve(static_cast<std::size_t>(n * (n - 1) + 2));
  mesh.triangles.reserve(static_cast<std::size_t>(2 * n * (n - 1)));
  mesh.vertices.emplace_back(0.0, 0.0, radius);
  for (int stack = 1; stack < n; ++stack) {
    const double polar = pi * stack / n;
    for (int i = 0; i < n; ++i) mesh.vertices.push_back(on_circle(i, n, radius * sine(polar), radius * cosine(polar)));
  }
  mesh.vertices.emplace_back(0.0, 0.0, -radius);

  const int south = n * (n - 1) + 1;
  const auto at = [n](int stack, int i) { return 1 + (stack - 1) * n + i % n; };
  for (int i = 0; i < n; ++i) mesh.triangles.push_back({0, at(1, i), at(1, i + 1)});
  for (int stack = 1; stack + 1 < n; ++stack) {
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({at(stack, i), at(stack + 1, i), at(stack + 1, i + 1)});
      mesh.triangles.push_back({at(stack, i), at(stack + 1, i + 1), at(stack, i + 1)});
    }
  }
  for (int i = 0; i < n; ++i) mesh.triangles.push_back({south, at(n - 1, i + 1), at(n - 1, i)});
  return mesh;
}

TriangleMesh make_cylinder(double radius, double length, int segments) {
  TriangleMesh mesh;
  for (const double z : {-0.5 * length, 0.5 * length}) {
    for (int i = 0; i < segments; ++i) mesh.vertices.push_back(on_circle(i, segments, radius, z));
  }
  const int bottom = 2 * segments;
  const int top = bottom + 1;
  mesh.vertices.emplace_back(0.0, 0.0, -0.5 * length);
  mesh.vertices.emplace_back(0.0, 0.0, 0.5 * length);
  for (int i = 0; i < segments; ++i) {
    const int next = (i + 1) % segments;
    mesh.triangles.push_back({i, next, segments + next});
    mesh.triangles.push_back({i, segments + next, segments + i});
    mesh.triangles.push_back({bottom, next, i});
    mesh.triangles.push_back({top, segments + i, segments + next});
  }
  return mesh;
}

TriangleMesh make_box(const Vector3& size) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices.emplace_back(size.x() * ((corner & 1) - 0.5), size.y() * (((corner >> 1) & 1) - 0.5),
                               size.z() * (((corner >> 2) & 1) - 0.5));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace tissue_sim
