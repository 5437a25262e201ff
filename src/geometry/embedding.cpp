#include "tissue_sim/geometry/embedding.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/closest_point.h"

namespace tissue_sim {
namespace {

/// Squared distances that differ by less than this part are equal: tetrahedra around a vertex compute the same distance
/// to it from different corners.
constexpr double tie = 1e-9;

/// Barycentric coordinates of p.
std::array<double, 4> weights_of(const Vector3& p, const TetrahedralMesh& solid, const Tetrahedron& t) {
  const Vector3& origin = solid.vertices[t[0]];
  const Vector3 b = solid.vertices[t[1]] - origin;
  const Vector3 c = solid.vertices[t[2]] - origin;
  const Vector3 d = solid.vertices[t[3]] - origin;
  const Vector3 q = p - origin;
  const double six_volumes = b.cross(c).dot(d);
  const double wb = c.cross(d).dot(q) / six_volumes;
  const double wc = d.cross(b).dot(q) / six_volumes;
  const double wd = b.cross(c).dot(q) / six_volumes;
  return {1.0 - wb - wc - wd, wb, wc, wd};
}

double least(const std::array<double, 4>& weights) {
  return *std::min_element(weights.begin(), weights.end());
}

/// From p to a tetrahedron in which it has these weights. The nearest point of a convex body lies on a face that p is
/// in front of.
double squared_distance(const Vector3& p, const std::array<double, 4>& weights, const TetrahedralMesh& solid,
                        const Tetrahedron& t) {
  double nearest = least(weights) >= 0.0 ? 0.0 : 1e300;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    if (!(weights[corner] < 0.0)) continue;
    const auto& [a, b, c] = outward_faces[corner];
    const ClosestOnTriangle on =
        closest_on_triangle(p, solid.vertices[t[a]], solid.vertices[t[b]], solid.vertices[t[c]]);
    nearest = std::min(nearest, (p - on.point).squaredNorm());
  }
  return nearest;
}

struct Host {
  int tetrahedron = -1;
  std::array<double, 4> weights = {1.0, 0.0, 0.0, 0.0};
  double squared_distance = 0.0;
};

Host find_inside(const Vector3& p, const TetrahedralMesh& solid, const AabbTree& tree) {
  Host host;
  tree.for_each_near({p, p}, [&](int t) {
    if (host.tetrahedron >= 0 && t > host.tetrahedron) return;
    const std::array<double, 4> weights = weights_of(p, solid, solid.tetrahedra[t]);
    if (least(weights) >= 0.0) host = {t, weights, 0.0};
  });
  return host;
}

Host find_nearest(const Vector3& p, const TetrahedralMesh& solid, const AabbTree& tree) {
  Host host;
  double nearest = 1e300;
  tree.for_each_by_distance(p, nearest, [&](int t, double& bound) {
    const std::array<double, 4> weights = weights_of(p, solid, solid.tetrahedra[t]);
    const double distance2 = squared_distance(p, weights, solid, solid.tetrahedra[t]);
    if (!(distance2 < bound)) return;
    bound = distance2;
    host = {t, weights, distance2};
  });
  const double reach2 = nearest * (1.0 + tie);
  const Box box = Box{p, p}.grown(std::sqrt(reach2) * (1.0 + tie));
  tree.for_each_near(box, [&](int t) {
    const std::array<double, 4> weights = weights_of(p, solid, solid.tetrahedra[t]);
    const double low = least(weights), best = least(host.weights);
    if (!(low > best || (low == best && t < host.tetrahedron))) return;
    if (!(squared_distance(p, weights, solid, solid.tetrahedra[t]) <= reach2)) return;
    host.tetrahedron = t;
    host.weights = weights;
  });
  return host;
}

/// What a point has on a triangle: weights of its foot in the plane, which may be negative, and height above it.
struct Foot {
  int triangle = -1;
  Vector3 weights = Vector3::UnitX();
  double height = 0.0;
  double squared_distance = 0.0;
};

Foot foot_on(const Vector3& p, const TriangleMesh& shell, int triangle) {
  const auto& [a, b, c] = shell.triangles[triangle];
  const Vector3& x = shell.vertices[a];
  const Vector3& y = shell.vertices[b];
  const Vector3& z = shell.vertices[c];
  const Vector3 normal = area_normal(x, y, z);
  const double area2 = normal.squaredNorm();
  Foot foot;
  foot.triangle = triangle;
  foot.squared_distance = (closest_on_triangle(p, x, y, z).point - p).squaredNorm();
  if (!(area2 > 0.0)) return foot;
  const double wb = normal.dot((p - x).cross(z - x)) / area2;
  const double wc = normal.dot((y - x).cross(p - x)) / area2;
  foot.weights = {1.0 - wb - wc, wb, wc};
  foot.height = normal.dot(p - x) / std::sqrt(area2);
  return foot;
}

/// `facing` is zero where every triangle will do.
Foot find_foot(const Vector3& p, const Vector3& facing, const TriangleMesh& shell, const AabbTree& tree) {
  Foot best;
  const auto faces = [&](int t) {
    const auto& [a, b, c] = shell.triangles[t];
    return facing.isZero() || facing.dot(area_normal(shell.vertices[a], shell.vertices[b], shell.vertices[c])) > 0.0;
  };
  double nearest = 1e300;
  tree.for_each_by_distance(p, nearest, [&](int t, double& bound) {
    if (!faces(t)) return;
    const Foot foot = foot_on(p, shell, t);
    if (!(foot.squared_distance < bound)) return;
    bound = foot.squared_distance;
    best = foot;
  });
  if (best.triangle < 0) return best;
  const double reach2 = nearest * (1.0 + tie);
  const Box box = Box{p, p}.grown(std::sqrt(reach2) * (1.0 + tie));
  tree.for_each_near(box, [&](int t) {
    if (!faces(t)) return;
    const Foot foot = foot_on(p, shell, t);
    if (!(foot.squared_distance <= reach2)) return;
    const double low = foot.weights.minCoeff(), highest = best.weights.minCoeff();
    if (low > highest || (low == highest && t < best.triangle)) best = foot;
  });
  return best;
}

}  // namespace

Embedding embed(const std::vector<Vector3>& points, const TetrahedralMesh& solid) {
  std::vector<Box> boxes(solid.tetrahedra.size());
  for (std::size_t t = 0; t < boxes.size(); ++t) {
    for (const int v : solid.tetrahedra[t]) boxes[t].add(solid.vertices[v]);
  }
  AabbTree tree;
  tree.build(boxes);
  Embedding embedding;
  embedding.corners.reserve(points.size());
  embedding.weights.reserve(points.size());
  double farthest2 = 0.0;
  for (const Vector3& p : points) {
    Host host = find_inside(p, solid, tree);
    if (host.tetrahedron < 0) host = find_nearest(p, solid, tree);
    embedding.corners.push_back(solid.tetrahedra[std::max(host.tetrahedron, 0)]);
    embedding.weights.push_back(host.weights);
    farthest2 = std::max(farthest2, host.squared_distance);
  }
  embedding.farthest_outside = std::sqrt(farthest2);
  return embedding;
}

Embedding embed(const std::vector<Vector3>& points, const std::vector<Vector3>& normals, const TriangleMesh& shell) {
  std::vector<Box> boxes;
  fit_boxes(shell.vertices, shell.triangles, 0.0, boxes);
  AabbTree tree;
  tree.build(boxes);
  Embedding embedding;
  embedding.corners.reserve(points.size());
  embedding.weights.reserve(points.size());
  embedding.offsets.reserve(points.size());
  double farthest2 = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Foot foot = find_foot(points[i], normals[i], shell, tree);
    if (foot.triangle < 0) foot = find_foot(points[i], Vector3::Zero(), shell, tree);
    const auto& [a, b, c] = shell.triangles[std::max(foot.triangle, 0)];
    embedding.corners.push_back({a, b, c, a});
    embedding.weights.push_back({foot.weights[0], foot.weights[1], foot.weights[2], 0.0});
    embedding.offsets.push_back(foot.height);
    farthest2 = std::max(farthest2, foot.squared_distance);
  }
  embedding.farthest_outside = std::sqrt(farthest2);
  return embedding;
}

}  // namespace tissue_sim
