#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/pose.h"

/// Slow, plain ways to the answers that the library finds quickly, and shapes to ask them about.
namespace tissue_sim {

using Random = std::mt19937;

inline double random_in(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline Vector3 random_point(Random& random, double half = 1.0) {
  const double x = random_in(random, -half, half);
  const double y = random_in(random, -half, half);
  return {x, y, random_in(random, -half, half)};
}

inline Vector3 random_direction(Random& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  return Vector3(x, y, normal(random)).normalized();
}

inline Pose random_pose(Random& random, double half) {
  const Eigen::AngleAxisd turn(random_in(random, 0.0, 3.0), random_direction(random));
  return {random_point(random, half), Eigen::Quaterniond(turn)};
}

inline std::vector<Box> boxes_of(const TriangleMesh& mesh) {
  std::vector<Box> boxes(mesh.triangles.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    for (const int v : mesh.triangles[t]) boxes[t].add(mesh.vertices[v]);
  }
  return boxes;
}

inline AabbTree tree_of(const TriangleMesh& mesh) {
  AabbTree tree;
  tree.build(boxes_of(mesh));
  return tree;
}

/// Triangles in no order at all, each with corners of its own.
inline TriangleMesh random_soup(Random& random, int count, double size) {
  TriangleMesh mesh;
  for (int t = 0; t < count; ++t) {
    const Vector3 centre = random_point(random);
    for (int i = 0; i < 3; ++i) mesh.vertices.push_back(centre + random_point(random, size));
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

/// An octahedron, its triangles cut in four and pushed out to the sphere, again and again: 8 * 4^rounds triangles.
inline TriangleMesh make_octasphere(double radius, int rounds) {
  TriangleMesh mesh = {{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                       {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int round = 0; round < rounds; ++round) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, added] = middles.insert({std::minmax(a, b), static_cast<int>(mesh.vertices.size())});
      if (added) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b);
      const int bc = middle(b, c);
      const int ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (Vector3& v : mesh.vertices) v *= radius;
  return mesh;
}

/// A ring around the z axis, n by n: closed and not convex.
inline TriangleMesh make_torus(double radius, double tube, int n) {
  TriangleMesh mesh;
  const double step = 2.0 * 3.14159265358979323846 / n;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double out = radius + tube * std::cos(j * step);
      mesh.vertices.emplace_back(out * std::cos(i * step), out * std::sin(i * step), tube * std::sin(j * step));
      const int across = (i + 1) % n * n;
      const int next = (j + 1) % n;
      mesh.triangles.push_back({i * n + j, across + j, across + next});
      mesh.triangles.push_back({i * n + j, across + next, i * n + next});
    }
  }
  return mesh;
}

/// A box around the origin, each face an n by n grid.
inline TriangleMesh make_grid_box(const Vector3& size, int n) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      const int first = static_cast<int>(mesh.vertices.size());
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
          Vector3 p;
          p[axis] = 0.5 * sign * size[axis];
          p[(axis + 1) % 3] = size[(axis + 1) % 3] * (static_cast<double>(i) / n - 0.5);
          p[(axis + 2) % 3] = size[(axis + 2) % 3] * (static_cast<double>(j) / n - 0.5);
          mesh.vertices.push_back(p);
          if (i == n || j == n) continue;
          const int a = first + i * (n + 1) + j;
          Triangle one = {a, a + n + 1, a + n + 2};
          Triangle two = {a, a + n + 2, a + 1};
          if (sign < 0) std::swap(one[1], one[2]);
          if (sign < 0) std::swap(two[1], two[2]);
          mesh.triangles.push_back(one);
          mesh.triangles.push_back(two);
        }
      }
    }
  }
  weld(mesh, 0.0);
  return mesh;
}

inline TriangleMesh moved(TriangleMesh mesh, const Pose& pose) {
  for (Vector3& v : mesh.vertices) v = pose.apply(v);
  return mesh;
}

/// How often the surface goes around p: 1 inside, 0 outside. The sum of the solid angles of all triangles over 4 pi
/// (Van Oosterom and Strackee 1983).
inline double winding_number(const TriangleMesh& mesh, const Vector3& p) {
  double half_angles = 0.0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vector3 a = mesh.vertices[i] - p;
    const Vector3 b = mesh.vertices[j] - p;
    const Vector3 c = mesh.vertices[k] - p;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    half_angles += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles / (2.0 * 3.14159265358979323846);
}

inline bool is_inside(const TriangleMesh& mesh, const Vector3& p) {
  return winding_number(mesh, p) > 0.5;
}

inline double distance_to_segment(const Vector3& p, const Vector3& a, const Vector3& b) {
  const double length = (b - a).squaredNorm();
  const double t = length > 0.0 ? (p - a).dot(b - a) / length : 0.0;
  return (a + std::min(1.0, std::max(0.0, t)) * (b - a) - p).norm();
}

/// To the rims, and to the plane if the foot solves a + u (b - a) + v (c - a) with u, v >= 0 and u + v <= 1.
inline double distance_to_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  double nearest = std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
  Eigen::Matrix<double, 3, 2> sides;
  sides << b - a, c - a;
  if ((b - a).cross(c - a).norm() > 1e-12 * (b - a).norm() * (c - a).norm()) {
    const Eigen::Vector2d uv = sides.colPivHouseholderQr().solve(p - a);
    if (uv.minCoeff() >= 0.0 && uv.sum() <= 1.0) nearest = std::min(nearest, (a + sides * uv - p).norm());
  }
  return nearest;
}

inline double distance_to_mesh(const TriangleMesh& mesh, const Vector3& p) {
  double nearest = std::numeric_limits<double>::max();
  for (const auto& [a, b, c] : mesh.triangles) {
    nearest = std::min(nearest, distance_to_triangle(p, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]));
  }
  return nearest;
}

}  // namespace tissue_sim
