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

}  // namespace tissue_sim
