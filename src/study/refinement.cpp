#include "tissue_sim/study/refinement.h"

#include <algorithm>
#include <queue>

namespace tissue_sim {

namespace {

struct LongEdge {
  double excess = 0.0;  ///< 1, its length over what is allowed there
  Edge vertices{};
};

/// Ties go to the lower vertices, so that the same mesh comes out everywhere.
bool operator<(const LongEdge& a, const LongEdge& b) {
  return a.excess < b.excess || (a.excess == b.excess && a.vertices > b.vertices);
}

}  // namespace

TriangleMesh subdivide(const TriangleMesh& mesh) {
  const auto vertices = static_cast<int>(mesh.vertices.size());
  const MeshTopology topology = build_topology(vertices, mesh.triangles);
  TriangleMesh result{mesh.vertices, {}};
  for (const auto& [a, b] : topology.edges) result.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const int ab = vertices + topology.triangle_edges[t][0];
    const int bc = vertices + topology.triangle_edges[t][1];
    const int ca = vertices + topology.triangle_edges[t][2];
    result.triangles.insert(result.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return result;
}

void refine(TetrahedralMesh& mesh, const std::function<double(const Vector3&)>& longest) {
  std::vector<std::vector<int>> around(mesh.vertices.size());  // tetrahedra at each vertex
  std::priority_queue<LongEdge> queue;
  const auto consider = [&](int a, int b) {
    const Vector3& p = mesh.vertices[a];
    const Vector3& q = mesh.vertices[b];
    const double excess = (q - p).norm() / longest(0.5 * (p + q));
    if (excess > 1.0) queue.push({excess, {std::min(a, b), std::max(a, b)}});
  };
  std::vector<Edge> edges;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& corners = mesh.tetrahedra[t];
    for (std::size_t i = 0; i < 4; ++i) {
      around[corners[i]].push_back(static_cast<int>(t));
      for (std::size_t j = i + 1; j < 4; ++j) {
        edges.push_back({std::min(corners[i], corners[j]), std::max(corners[i], corners[j])});
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [a, b] : edges) consider(a, b);

  while (!queue.empty()) {
    const auto [a, b] = queue.top().vertices;
    queue.pop();
    const auto middle = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    around.emplace_back();
    std::vector<int> ring;  // the other vertices of the tetrahedra around the edge
    const std::vector<int> at_a = around[a];
    for (const int t : at_a) {
      const Tetrahedron old = mesh.tetrahedra[t];
      if (std::find(old.begin(), old.end(), b) == old.end()) continue;
      const auto added = static_cast<int>(mesh.tetrahedra.size());
      Tetrahedron far = old;
      for (std::size_t i = 0; i < 4; ++i) {
        if (old[i] == b) mesh.tetrahedra[t][i] = middle;
        if (old[i] == a) far[i] = middle;
        if (old[i] == a || old[i] == b) continue;
        ring.push_back(old[i]);
        around[old[i]].push_back(added);
      }
      mesh.tetrahedra.push_back(far);
      std::replace(around[b].begin(), around[b].end(), t, added);
      around[middle].push_back(t);
      around[middle].push_back(added);
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    consider(a, middle);
    consider(middle, b);
    for (const int v : ring) consider(v, middle);
  }
}

}  // namespace tissue_sim
