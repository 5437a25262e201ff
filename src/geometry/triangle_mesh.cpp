#include "tissue_sim/geometry/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>

namespace tissue_sim {
namespace {

/// Height over length below which a triangle has no area: its normal is rounding error.
constexpr double degenerate_ratio = 1e-14;

/// Side `side` of triangle `triangle`; `low` is the smaller vertex.
struct HalfEdge {
  int high;
  int half;  ///< 3 * triangle + side
};

/// Sides of all triangles, grouped by their smaller vertex and sorted by the larger, then by triangle.
/// A counting sort over the smaller vertex, so that a million triangles take well under a second.
struct HalfEdges {
  std::vector<int> first;
  std::vector<HalfEdge> sides;
};

HalfEdges sort_half_edges(int vertex_count, const std::vector<Triangle>& triangles) {
  HalfEdges sorted;
  sorted.first.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
  sorted.sides.resize(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++sorted.first[std::min(t[i], t[(i + 1) % 3]) + 1];
  }
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  std::vector<int> next(sorted.first.begin(), sorted.first.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(triangles[t][i], triangles[t][(i + 1) % 3]);
      sorted.sides[next[low]++] = {high, static_cast<int>(3 * t + i)};
    }
  }
  for (std::size_t v = 0; v + 1 < sorted.first.size(); ++v) {
    std::sort(sorted.sides.begin() + sorted.first[v], sorted.sides.begin() + sorted.first[v + 1],
              [](HalfEdge a, HalfEdge b) { return a.high != b.high ? a.high < b.high : a.half < b.half; });
  }
  return sorted;
}

/// Calls visit(low, high, first side, last side) for every edge, ascending.
template <typename Visit>
void for_each_edge(const HalfEdges& half_edges, Visit visit) {
  for (std::size_t low = 0; low + 1 < half_edges.first.size(); ++low) {
    const HalfEdge* side = half_edges.sides.data() + half_edges.first[low];
    const HalfEdge* const end = half_edges.sides.data() + half_edges.first[low + 1];
    while (side != end) {
      const HalfEdge* last = side;
      while (last != end && last->high == side->high) ++last;
      visit(static_cast<int>(low), side->high, side, last);
      side = last;
    }
  }
}

/// The lists of which each item names its owners, in ascending order of the items.
template <typename Items>
FlatLists invert(int list_count, const Items& items) {
  FlatLists lists;
  lists.first.assign(static_cast<std::size_t>(list_count) + 1, 0);
  for (const auto& owners : items) {
    for (const int owner : owners) ++lists.first[owner + 1];
  }
  std::partial_sum(lists.first.begin(), lists.first.end(), lists.first.begin());
  lists.items.resize(lists.first.back());
  std::vector<int> next(lists.first.begin(), lists.first.end() - 1);
  for (std::size_t i = 0; i < items.size(); ++i) {
    for (const int owner : items[i]) {
      lists.items[next[owner]++] = static_cast<int>(i);
    }
  }
  return lists;
}

/// Sets that can be joined. The smallest member stands for its set.
struct DisjointSets {
  std::vector<int> parent;

  explicit DisjointSets(int count) : parent(static_cast<std::size_t>(count)) {
    std::iota(parent.begin(), parent.end(), 0);
  }
  int& at(int i) { return parent[i]; }
  int root(int i) {
    while (at(i) != i) i = at(i) = at(at(i));
    return i;
  }
  void join(int a, int b) {
    const std::pair<int, int> ends = std::minmax({root(a), root(b)});
    at(ends.second) = ends.first;
  }
};

bool has_repeated_corner(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

bool runs_low_to_high(const Triangle& t, int side) {
  return t[side] < t[(side + 1) % 3];
}

bool is_degenerate(const Vector3& a, const Vector3& b, const Vector3& c) {
  const double longest2 = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return area_normal(a, b, c).norm() <= degenerate_ratio * longest2;
}

/// Triangles with the same corners meet at their smallest vertex: few are sorted at a time.
int count_duplicates(int vertex_count, const std::vector<Triangle>& triangles) {
  std::vector<std::array<int, 1>> smallest;
  smallest.reserve(triangles.size());
  for (const Triangle& t : triangles) smallest.push_back({std::min({t[0], t[1], t[2]})});
  const FlatLists at = invert(vertex_count, smallest);
  std::vector<Triangle> sorted;
  int duplicates = 0;
  for (int v = 0; v < vertex_count; ++v) {
    sorted.clear();
    for (const int* t = at.begin(v); t != at.end(v); ++t) {
      sorted.push_back(triangles[*t]);
      std::sort(sorted.back().begin(), sorted.back().end());
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 1; i < sorted.size(); ++i) duplicates += sorted[i] == sorted[i - 1];
  }
  return duplicates;
}

/// Vertices where the triangles around form more than one fan. Around a vertex each triangle joins its two other
/// corners; a fan is one connected set of such corners.
int count_split_vertices(int vertex_count, const std::vector<Triangle>& triangles) {
  const FlatLists around = invert(vertex_count, triangles);
  DisjointSets corners(vertex_count);
  std::vector<int> seen;
  int split = 0;
  for (int v = 0; v < vertex_count; ++v) {
    seen.clear();
    for (const int* t = around.begin(v); t != around.end(v); ++t) {
      const Triangle& triangle = triangles[*t];
      const std::size_t own = triangle[0] == v ? 0 : triangle[1] == v ? 1 : 2;
      const int b = triangle[(own + 1) % 3], c = triangle[(own + 2) % 3];
      corners.join(b, c);
      seen.push_back(b);
      seen.push_back(c);
    }
    const bool more_than_one = std::any_of(seen.begin(), seen.end(),
                                           [&](int corner) { return corners.root(corner) != corners.root(seen[0]); });
    split += more_than_one;
    for (const int corner : seen) corners.at(corner) = corner;
  }
  return split;
}

/// Grid cell of a point: whole numbers, kept as doubles so that no coordinate can overflow.
struct Cell {
  double x, y, z;
};

std::uint64_t hash_of(const Cell& cell) {
  std::uint64_t h = 0;
  for (const double c : {cell.x, cell.y, cell.z}) {
    const double same_zero = c + 0.0;  // 0.0 and -0.0 are one place
    std::uint64_t bits = 0;
    std::memcpy(&bits, &same_zero, sizeof bits);
    h = (h ^ (h >> 32) ^ bits) * 0x9e3779b97f4a7c15ull;
  }
  return h ^ (h >> 29);
}

/// The kept vertices by their cells. A bucket may hold several cells, which costs a comparison and nothing else:
/// whoever looks for neighbours compares distances anyway.
class CellBuckets {
 public:
  explicit CellBuckets(std::size_t vertices) : older_(vertices, -1) {
    std::size_t buckets = 1;
    while (buckets < vertices) buckets *= 2;
    newest_.assign(buckets, -1);
  }
  int newest(const Cell& cell) const { return newest_[bucket(cell)]; }
  int older(int vertex) const { return older_[vertex]; }
  void add(const Cell& cell, int vertex) {
    int& newest = newest_[bucket(cell)];
    older_[vertex] = newest;
    newest = vertex;
  }

 private:
  std::size_t bucket(const Cell& cell) const { return hash_of(cell) & (newest_.size() - 1); }

  std::vector<int> newest_;  ///< per bucket, -1: empty
  std::vector<int> older_;   ///< per vertex, the one before it in its bucket
};

/// For each vertex the first kept vertex within `tolerance`, itself if there is none. Cells of four tolerances:
/// most vertices then look into one cell only, and no cell can hold many kept vertices.
std::vector<int> nearby_first(const std::vector<Vector3>& vertices, double tolerance) {
  CellBuckets kept(vertices.size());
  std::vector<int> keeper(vertices.size());
  const auto cell_of = [&](double x) { return tolerance > 0.0 ? std::floor(x / (4.0 * tolerance)) : x; };
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vector3& p = vertices[v];
    keeper[v] = static_cast<int>(v);
    if (!p.allFinite()) continue;
    const auto sides = [&](Eigen::Index axis) {
      return std::array<double, 2>{cell_of(p[axis] - tolerance), cell_of(p[axis] + tolerance)};
    };
    const auto xs = sides(0), ys = sides(1), zs = sides(2);
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t ix = i & 1, iy = (i >> 1) & 1, iz = i >> 2;
      if ((ix && xs[0] == xs[1]) || (iy && ys[0] == ys[1]) || (iz && zs[0] == zs[1])) continue;
      for (int k = kept.newest({xs[ix], ys[iy], zs[iz]}); k >= 0; k = kept.older(k)) {
        if (k < keeper[v] && (vertices[k] - p).norm() <= tolerance) keeper[v] = k;
      }
    }
    if (keeper[v] == static_cast<int>(v)) kept.add({cell_of(p.x()), cell_of(p.y()), cell_of(p.z())}, keeper[v]);
  }
  return keeper;
}

void drop_unreferenced(TriangleMesh& mesh) {
  std::vector<int> renamed(mesh.vertices.size(), -1);
  for (const Triangle& t : mesh.triangles) {
    for (const int v : t) renamed[v] = 0;
  }
  std::size_t kept = 0;
  for (std::size_t v = 0; v < renamed.size(); ++v) {
    if (renamed[v] < 0) continue;
    renamed[v] = static_cast<int>(kept);
    mesh.vertices[kept++] = mesh.vertices[v];
  }
  mesh.vertices.resize(kept);
  for (Triangle& t : mesh.triangles) {
    for (int& v : t) v = renamed[v];
  }
}

double volume_over(const std::vector<Vector3>& vertices, const Triangle& t, const Vector3& apex) {
  const Vector3 a = vertices[t[0]] - apex;
  const Vector3 b = vertices[t[1]] - apex;
  const Vector3 c = vertices[t[2]] - apex;
  return a.dot(b.cross(c)) / 6.0;
}

}  // namespace

MeshTopology build_topology(int vertex_count, const std::vector<Triangle>& triangles) {
  MeshTopology topology;
  topology.triangle_edges.resize(triangles.size());
  topology.edges.reserve(triangles.size() * 3 / 2);
  topology.edge_triangles.reserve(triangles.size() * 3 / 2);
  for_each_edge(sort_half_edges(vertex_count, triangles),
                [&](int low, int high, const HalfEdge* side, const HalfEdge* last) {
                  const int edge = static_cast<int>(topology.edges.size());
                  topology.edges.push_back({low, high});
                  topology.edge_triangles.push_back({side->half / 3, last - side > 1 ? side[1].half / 3 : -1});
                  for (; side != last; ++side) {
                    topology.triangle_edges[side->half / 3][side->half % 3] = edge;
                  }
                });
  topology.vertex_edges = invert(vertex_count, topology.edges);
  topology.vertex_triangles = invert(vertex_count, triangles);
  return topology;
}

bool MeshFaults::closed_manifold() const {
  return components > 0 && non_finite_vertices + bad_indices + repeated_corners + degenerate_triangles +
                                   duplicate_triangles + boundary_edges + non_manifold_edges + misoriented_edges +
                                   non_manifold_vertices + unreferenced_vertices ==
                               0;
}

MeshFaults inspect(const TriangleMesh& mesh) {
  MeshFaults faults;
  const int vertex_count = static_cast<int>(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    faults.bad_indices += std::any_of(t.begin(), t.end(), [&](int v) { return v < 0 || v >= vertex_count; });
  }
  if (faults.bad_indices > 0) return faults;

  for (const Vector3& p : mesh.vertices) faults.non_finite_vertices += !p.allFinite();

  std::vector<char> referenced(mesh.vertices.size(), 0);
  std::vector<Triangle> sound;  // those with three corners; the others have no edges to speak of
  sound.reserve(mesh.triangles.size());
  DisjointSets surfaces(vertex_count);
  for (const Triangle& t : mesh.triangles) {
    for (const int v : t) referenced[v] = 1;
    surfaces.join(t[0], t[1]);
    surfaces.join(t[0], t[2]);
    if (has_repeated_corner(t)) {
      ++faults.repeated_corners;
      continue;
    }
    sound.push_back(t);
    faults.degenerate_triangles += is_degenerate(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  }
  for (int v = 0; v < vertex_count; ++v) {
    if (!referenced[v]) {
      ++faults.unreferenced_vertices;
    } else {
      faults.components += surfaces.root(v) == v;
    }
  }
  faults.duplicate_triangles = count_duplicates(vertex_count, sound);
  faults.non_manifold_vertices = count_split_vertices(vertex_count, sound);
  for_each_edge(sort_half_edges(vertex_count, sound), [&](int, int, const HalfEdge* side, const HalfEdge* last) {
    const auto forward = [&](const HalfEdge& h) { return runs_low_to_high(sound[h.half / 3], h.half % 3); };
    faults.boundary_edges += last - side == 1;
    faults.non_manifold_edges += last - side > 2;
    faults.misoriented_edges += last - side == 2 && forward(side[0]) == forward(side[1]);
  });
  return faults;
}

WeldReport weld(TriangleMesh& mesh, double tolerance) {
  WeldReport report;
  const std::vector<int> keeper = nearby_first(mesh.vertices, tolerance);
  for (std::size_t v = 0; v < keeper.size(); ++v) report.merged_vertices += keeper[v] != static_cast<int>(v);
  for (Triangle& t : mesh.triangles) {
    for (int& v : t) v = keeper[v];
  }
  const auto collapsed = std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), has_repeated_corner);
  report.removed_triangles = static_cast<int>(mesh.triangles.end() - collapsed);
  mesh.triangles.erase(collapsed, mesh.triangles.end());
  drop_unreferenced(mesh);
  return report;
}

int orient_outward(TriangleMesh& mesh) {
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  std::vector<char> turned(mesh.triangles.size(), 0);
  std::vector<char> visited(mesh.triangles.size(), 0);
  std::vector<std::size_t> surface;
  const auto side_of = [&](std::size_t t, int edge) {
    const auto& sides = topology.triangle_edges[t];
    return sides[0] == edge ? 0 : sides[1] == edge ? 1 : 2;
  };
  for (std::size_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (visited[seed]) continue;
    visited[seed] = 1;
    surface.assign(1, seed);
    for (std::size_t next = 0; next < surface.size(); ++next) {
      const std::size_t t = surface[next];
      for (const int edge : topology.triangle_edges[t]) {
        for (const int neighbour : topology.edge_triangles[edge]) {
          const int n = neighbour;
          if (neighbour < 0 || visited[n]) continue;
          visited[n] = 1;
          const bool same_way = runs_low_to_high(mesh.triangles[t], side_of(t, edge)) ==
                                runs_low_to_high(mesh.triangles[n], side_of(n, edge));
          turned[n] = static_cast<char>(turned[t] != static_cast<char>(same_way));
          surface.push_back(n);
        }
      }
    }
    Vector3 centre = Vector3::Zero();
    for (const std::size_t t : surface) {
      for (const int v : mesh.triangles[t]) centre += mesh.vertices[v];
    }
    centre /= 3.0 * static_cast<double>(surface.size());
    double volume = 0.0;
    for (const std::size_t t : surface) {
      volume += (turned[t] ? -1.0 : 1.0) * volume_over(mesh.vertices, mesh.triangles[t], centre);
    }
    if (volume < 0.0) {
      for (const std::size_t t : surface) turned[t] = static_cast<char>(!turned[t]);
    }
  }
  int count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!turned[t]) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    ++count;
  }
  return count;
}

int close_holes(TriangleMesh& mesh) {
  // The two boundary sides at each vertex, as the triangles run through them; more than two is not a simple loop.
  struct Sides {
    int count = 0;
    std::array<std::size_t, 2> side{};
  };
  std::vector<Edge> boundary;
  std::vector<Sides> at(mesh.vertices.size());
  for_each_edge(sort_half_edges(static_cast<int>(mesh.vertices.size()), mesh.triangles),
                [&](int, int, const HalfEdge* side, const HalfEdge* last) {
                  if (last - side != 1) return;
                  const Triangle& t = mesh.triangles[side->half / 3];
                  const int corner = side->half % 3;
                  boundary.push_back({t[corner], t[(corner + 1) % 3]});
                });
  for (std::size_t b = 0; b < boundary.size(); ++b) {
    for (const int v : boundary[b]) {
      Sides& sides = at[v];
      if (sides.count < 2) sides.side[sides.count] = b;
      ++sides.count;
    }
  }
  int closed = 0;
  std::vector<char> used(boundary.size(), 0);
  std::vector<std::size_t> loop;
  for (std::size_t seed = 0; seed < boundary.size(); ++seed) {
    if (used[seed]) continue;
    loop.clear();
    bool simple = true;
    std::size_t b = seed;
    int v = boundary[seed][0];
    do {
      used[b] = 1;
      loop.push_back(b);
      v = boundary[b][0] == v ? boundary[b][1] : boundary[b][0];
      const Sides& sides = at[v];
      simple = sides.count == 2;
      b = sides.side[0] == b ? sides.side[1] : sides.side[0];
    } while (simple && !used[b]);
    if (!simple || b != seed || loop.size() < 3) continue;
    Vector3 centre = Vector3::Zero();
    for (const std::size_t side : loop) {
      centre += mesh.vertices[boundary[side][0]] + mesh.vertices[boundary[side][1]];
    }
    const int apex = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(centre / (2.0 * static_cast<double>(loop.size())));
    for (const std::size_t side : loop) mesh.triangles.push_back({boundary[side][1], boundary[side][0], apex});
    ++closed;
  }
  return closed;
}

double enclosed_volume(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0.0;
  Vector3 centroid = Vector3::Zero();
  for (const Vector3& p : mesh.vertices) centroid += p;
  centroid /= static_cast<double>(mesh.vertices.size());
  double volume = 0.0;
  for (const Triangle& t : mesh.triangles) volume += volume_over(mesh.vertices, t, centroid);
  return volume;
}

double mean_edge_length(const std::vector<Vector3>& vertices, const std::vector<Edge>& edges) {
  if (edges.empty()) return 0.0;
  double sum = 0.0;
  for (const Edge& e : edges) {
    sum += (vertices[e[0]] - vertices[e[1]]).norm();
  }
  return sum / static_cast<double>(edges.size());
}

}  // namespace tissue_sim
