#include "tissue_sim/geometry/coarsening.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {

/// Of the edge asked for: a collapse that would leave a longer one is not made.
constexpr double longest_edge = 1.6;

/// Of the edge asked for: a longer edge of the mesh is split in two before anything is collapsed. Else the triangles at
/// it would stay large, and those elsewhere small to make up for them.
constexpr double split_edge = 1.33;

/// Cosine between a triangle's normal before a collapse and after it: below this the surface would fold.
constexpr double least_turned = 0.2;

/// Cosine between the normals of two triangles whose common edge may be flipped: across a sharp ridge none is.
constexpr double least_flat = 0.7;

/// Twice the area over the square of the longest side; 0.87 is equilateral. A collapse that leaves a triangle thinner
/// is not made.
constexpr double thinnest = 0.1;

/// Edges at a vertex after a collapse.
constexpr int most_edges = 9;

/// Of the sum of the planes' weights: how strongly a new vertex is held to the middle of the edge. It decides where the
/// planes leave the place open, that is along flat surface.
constexpr double hold = 1e-3;

/// Rounds of flips and of moves along the surface; more change the spread of the edges by less than a hundredth.
constexpr int rounds = 6;

/// Of the way to the middle of the neighbours, in one round.
constexpr double stride = 0.6;

double six_volumes(const TriangleMesh& mesh) {
  return 6.0 * enclosed_volume(mesh);
}

double surface_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    area += 0.5 * area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]).norm();
  }
  return area;
}

bool thin(const Vector3& normal, const Vector3& a, const Vector3& b, const Vector3& c) {
  const double side2 = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !(normal.norm() > thinnest * side2);
}

/// The planes that a vertex stands for: the sum over them of weight (n . x - d)^2 is x'Ax - 2 b'x + const.
struct Planes {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Vector3 b = Vector3::Zero();

  void add(const Planes& other) {
    a += other.a;
    b += other.b;
  }
  /// The place nearest to all of them, held to `middle`.
  Vector3 nearest(const Vector3& middle) const {
    const double held = hold * a.trace();
    const Eigen::Matrix3d system = a + held * Eigen::Matrix3d::Identity();
    const Vector3 place = middle + system.ldlt().solve(b - a * middle);
    return place.allFinite() ? place : middle;
  }
};

/// A mesh while its edges are collapsed.
class Collapse {
 public:
  Collapse(TriangleMesh mesh, double edge) : mesh_(std::move(mesh)), edge_(edge) {
    const std::size_t n = mesh_.vertices.size();
    at_.resize(n);
    planes_.resize(n);
    changes_.assign(n, 0);
    mark_.assign(n, 0);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (const int v : mesh_.triangles[t]) at_[v].push_back(static_cast<int>(t));
      add_plane(mesh_.triangles[t]);
    }
  }

  TriangleMesh down_to(std::size_t triangles) {
    std::size_t left = mesh_.triangles.size();
    std::vector<Candidate> first;
    first.reserve(3 * left / 2);
    for (const Triangle& t : mesh_.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (t[i] < t[(i + 1) % 3]) first.push_back(candidate(t[i], t[(i + 1) % 3]));
      }
    }
    queue_ = Queue(Later(), std::move(first));
    while (left > triangles && !queue_.empty()) {
      const Candidate next = queue_.top();
      queue_.pop();
      if (changes_[next.a] + changes_[next.b] != next.changes || at_[next.a].empty() || at_[next.b].empty()) continue;
      if (collapse(next.a, next.b)) left -= 2;
    }
    return remaining();
  }

 private:
  struct Candidate {
    double length2;
    int a, b;
    int changes;  ///< of both ends, when it was put down
  };
  struct Later {
    bool operator()(const Candidate& one, const Candidate& other) const {
      if (one.length2 != other.length2) return one.length2 > other.length2;
      return one.a != other.a ? one.a > other.a : one.b > other.b;
    }
  };
  using Queue = std::priority_queue<Candidate, std::vector<Candidate>, Later>;

  const Vector3& x(int v) const { return mesh_.vertices[v]; }

  Candidate candidate(int a, int b) const {
    return {(x(b) - x(a)).squaredNorm(), std::min(a, b), std::max(a, b), changes_[a] + changes_[b]};
  }

  /// Weighted by the area.
  void add_plane(const Triangle& t) {
    const Vector3 normal = area_normal(x(t[0]), x(t[1]), x(t[2]));
    const double twice_area = normal.norm();
    if (!(twice_area > 0.0)) return;
    const Planes plane = {normal * normal.transpose() / twice_area, normal * (normal.dot(x(t[0])) / twice_area)};
    for (const int v : t) planes_[v].add(plane);
  }

  /// The corners that follow v in each of its triangles: its neighbours, each once, since the mesh is closed.
  template <class Visit>
  void for_each_neighbour(int v, Visit&& visit) const {
    for (const int t : at_[v]) {
      const Triangle& corners = mesh_.triangles[t];
      const std::size_t i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
      visit(corners[(i + 1) % 3]);
    }
  }

  /// The ends share no neighbours but the two across the edge's triangles, and those keep three edges: else the mesh
  /// would touch itself.
  bool stays_manifold(int a, int b) {
    ++stamp_;
    for_each_neighbour(a, [&](int v) { mark_[v] = stamp_; });
    int shared = 0;
    bool open = true;
    for_each_neighbour(b, [&](int v) {
      if (mark_[v] != stamp_) return;
      ++shared;
      open = open && at_[v].size() > 3;
    });
    const std::size_t edges = at_[a].size() + at_[b].size() - 4;
    return shared == 2 && open && edges >= 3 && edges <= most_edges;
  }

  /// Whether the triangles of v that do not go keep their side and shape when v goes to `place`.
  bool keeps_shape(int v, int other, const Vector3& place) const {
    for (const int t : at_[v]) {
      const Triangle& corners = mesh_.triangles[t];
      if (std::count(corners.begin(), corners.end(), other)) continue;
      const std::size_t i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
      const Vector3& q = x(corners[(i + 1) % 3]);
      const Vector3& r = x(corners[(i + 2) % 3]);
      const Vector3 before = area_normal(x(v), q, r);
      const Vector3 after = area_normal(place, q, r);
      if (!(after.dot(before) >= least_turned * after.norm() * before.norm())) return false;
      if (thin(after, place, q, r) && !thin(before, x(v), q, r)) return false;
      if ((q - place).squaredNorm() > square(longest_edge * edge_)) return false;
    }
    return true;
  }

  bool collapse(int a, int b) {
    if (!stays_manifold(a, b)) return false;
    Planes planes = planes_[a];
    planes.add(planes_[b]);
    const Vector3 place = planes.nearest(0.5 * (x(a) + x(b)));
    if (!keeps_shape(a, b, place) || !keeps_shape(b, a, place)) return false;

    mesh_.vertices[a] = place;
    planes_[a] = planes;
    for (const int t : at_[b]) {
      Triangle& corners = mesh_.triangles[t];
      if (std::count(corners.begin(), corners.end(), a)) {
        for (const int v : corners) {
          if (v != b) at_[v].erase(std::find(at_[v].begin(), at_[v].end(), t));
        }
        corners = {-1, -1, -1};
      } else {
        *std::find(corners.begin(), corners.end(), b) = a;
        at_[a].push_back(t);
      }
    }
    at_[b] = {};
    ++changes_[a];
    for_each_neighbour(a, [&](int v) { queue_.push(candidate(a, v)); });
    return true;
  }

  /// What is left, in the order that it had.
  TriangleMesh remaining() const {
    TriangleMesh left;
    std::vector<int> index(mesh_.vertices.size(), -1);
    for (std::size_t v = 0; v < index.size(); ++v) {
      if (at_[v].empty()) continue;
      index[v] = static_cast<int>(left.vertices.size());
      left.vertices.push_back(mesh_.vertices[v]);
    }
    for (const auto& [a, b, c] : mesh_.triangles) {
      if (a >= 0) left.triangles.push_back({index[a], index[b], index[c]});
    }
    return left;
  }

  TriangleMesh mesh_;
  const double edge_;
  std::vector<std::vector<int>> at_;  ///< triangles at each vertex; none where it is gone
  std::vector<Planes> planes_;
  std::vector<int> changes_;  ///< of each vertex' place
  std::vector<int> mark_;
  int stamp_ = 0;
  Queue queue_;
};

int opposite(const Triangle& triangle, const Edge& edge) {
  for (const int v : triangle) {
    if (v != edge[0] && v != edge[1]) return v;
  }
  return -1;
}

/// The triangles at an edge of a closed mesh, and the ends in the order in which the first one runs through them.
struct Neighbourhood {
  int first, second;  ///< triangles (a, b, c) and (b, a, d)
  int a, b, c, d;
};

Neighbourhood around(const TriangleMesh& mesh, const MeshTopology& topology, std::size_t edge) {
  const auto& [first, second] = topology.edge_triangles[edge];
  const Edge& ends = topology.edges[edge];
  const Triangle& corners = mesh.triangles[first];
  const auto at = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), ends[0]) - corners.begin());
  const bool forward = corners[(at + 1) % 3] == ends[1];
  return {first,
          second,
          forward ? ends[0] : ends[1],
          forward ? ends[1] : ends[0],
          opposite(corners, ends),
          opposite(mesh.triangles[second], ends)};
}

/// Splits each edge that is too long in its middle, of a triangle's edges one at a time.
void split_edges(double longest, TriangleMesh& mesh) {
  for (bool again = true; again;) {
    again = false;
    const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
    std::vector<char> touched(mesh.triangles.size(), 0);
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      const auto [first, second, a, b, c, d] = around(mesh, topology, e);
      const Vector3 p = mesh.vertices[a], q = mesh.vertices[b];
      if (!((q - p).norm() > longest)) continue;
      again = true;
      if (touched[first] || touched[second]) continue;
      touched[first] = touched[second] = 1;
      const int middle = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(0.5 * (p + q));
      mesh.triangles[first] = {a, middle, c};
      mesh.triangles[second] = {b, middle, d};
      mesh.triangles.push_back({middle, b, c});
      mesh.triangles.push_back({middle, a, d});
    }
  }
}

/// Flips edges where that brings the numbers of edges at the four vertices nearer to six. Returns how many.
int flip_edges(TriangleMesh& mesh) {
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  std::vector<char> touched(mesh.vertices.size(), 0);
  const auto off = [&](int v, int change) {
    const FlatLists& edges = topology.vertex_edges;
    const int count = static_cast<int>(edges.end(v) - edges.begin(v)) + change;
    return count < 4 ? 100 : (count - 6) * (count - 6);
  };
  const auto joined = [&](int c, int d) {
    return std::any_of(topology.vertex_edges.begin(c), topology.vertex_edges.end(c), [&](int e) {
      return topology.edges[e] == Edge{std::min(c, d), std::max(c, d)};
    });
  };
  int flips = 0;
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    const auto [first, second, a, b, c, d] = around(mesh, topology, e);
    if (touched[a] || touched[b] || touched[c] || touched[d] || joined(c, d)) continue;
    if (off(a, -1) + off(b, -1) + off(c, 1) + off(d, 1) >= off(a, 0) + off(b, 0) + off(c, 0) + off(d, 0)) continue;

    const auto normal = [&](int i, int j, int k) {
      return area_normal(mesh.vertices[i], mesh.vertices[j], mesh.vertices[k]);
    };
    const auto agree = [](const Vector3& n, const Vector3& m) { return n.dot(m) > least_flat * n.norm() * m.norm(); };
    const Vector3 sum = normal(a, b, c) + normal(b, a, d);
    const Vector3 left = normal(c, a, d);
    const Vector3 right = normal(d, b, c);
    if (!agree(normal(a, b, c), normal(b, a, d)) || !agree(left, sum) || !agree(right, sum)) continue;
    if (thin(left, mesh.vertices[c], mesh.vertices[a], mesh.vertices[d])) continue;
    if (thin(right, mesh.vertices[d], mesh.vertices[b], mesh.vertices[c])) continue;
    mesh.triangles[first] = {c, a, d};
    mesh.triangles[second] = {d, b, c};
    for (const int v : {a, b, c, d}) touched[v] = 1;
    ++flips;
  }
  return flips;
}

std::vector<Vector3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3> normals(mesh.vertices.size(), Vector3::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Vector3 normal = area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    for (const int v : t) normals[v] += normal;
  }
  for (Vector3& normal : normals) normal = unit_or_zero(normal);
  return normals;
}

/// Moves vertices towards the middle of their neighbours along the surface, and onto `surface` again, on the side that
/// they are on: not to a wall that lies close by.
void even_out(const TriangleMesh& surface, const AabbTree& tree, TriangleMesh& mesh) {
  const std::vector<Vector3> normals = vertex_normals(mesh);
  std::vector<Vector3> middles(mesh.vertices.size(), Vector3::Zero());
  std::vector<double> count(mesh.vertices.size(), 0.0);
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      middles[t[i]] += mesh.vertices[t[(i + 1) % 3]];
      count[t[i]] += 1.0;
    }
  }
  std::vector<Vector3> moved = mesh.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) {
    Vector3 way = stride * (middles[v] / count[v] - mesh.vertices[v]);
    way -= normals[v].dot(way) * normals[v];
    const Vector3 place = mesh.vertices[v] + way;
    double bound = 4.0 * (middles[v] / count[v] - mesh.vertices[v]).squaredNorm() + 1e-30;
    tree.for_each_by_distance(place, bound, [&](int t, double& nearest) {
      const auto& [a, b, c] = surface.triangles[t];
      const Vector3& p = surface.vertices[a];
      const Vector3& q = surface.vertices[b];
      const Vector3& r = surface.vertices[c];
      if (!(area_normal(p, q, r).dot(normals[v]) > 0.0)) return;
      const ClosestOnTriangle on = closest_on_triangle(place, p, q, r);
      const double distance2 = (on.point - place).squaredNorm();
      if (!(distance2 < nearest)) return;
      nearest = distance2;
      moved[v] = on.point;
    });
  }
  // A vertex whose triangles would turn over stays where it is.
  std::vector<char> stays(moved.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    const Vector3 before = area_normal(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
    const Vector3 after = area_normal(moved[t[0]], moved[t[1]], moved[t[2]]);
    if (after.dot(before) > least_turned * after.norm() * before.norm() &&
        !thin(after, moved[t[0]], moved[t[1]], moved[t[2]])) {
      continue;
    }
    for (const int v : t) stays[v] = 1;
  }
  for (std::size_t v = 0; v < moved.size(); ++v) {
    if (!stays[v]) mesh.vertices[v] = moved[v];
  }
}

/// Moves all vertices along their normals by the same small way, so that the mesh encloses what it should.
void restore_volume(double six_wanted, TriangleMesh& mesh) {
  for (int round = 0; round < 2; ++round) {
    const double way = (six_wanted - six_volumes(mesh)) / (6.0 * surface_area(mesh));
    const std::vector<Vector3> normals = vertex_normals(mesh);
    for (std::size_t v = 0; v < normals.size(); ++v) mesh.vertices[v] += way * normals[v];
  }
}

}  // namespace

TriangleMesh coarsen(const TriangleMesh& mesh, double edge) {
  const double wanted = surface_area(mesh) / (std::sqrt(3.0) / 4.0 * edge * edge);
  if (!(wanted < static_cast<double>(mesh.triangles.size()))) return mesh;
  TriangleMesh coarse = mesh;
  split_edges(split_edge * edge, coarse);
  coarse = Collapse(std::move(coarse), edge).down_to(static_cast<std::size_t>(wanted));
  std::vector<Box> boxes;
  fit_boxes(mesh.vertices, mesh.triangles, 0.0, boxes);
  AabbTree tree;
  tree.build(boxes);
  for (int round = 0; round < rounds; ++round) {
    while (flip_edges(coarse) > static_cast<int>(coarse.triangles.size() / 100)) continue;
    even_out(mesh, tree, coarse);
  }
  restore_volume(six_volumes(mesh), coarse);
  return coarse;
}

}  // namespace tissue_sim
