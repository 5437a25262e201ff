#include "tissue_sim/contact/surface_patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace tissue_sim {

namespace {

// Two numbers side by side, in plain arrays. As a `using` clang would drop the alignment.
typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));  // NOLINT(modernize-use-using)

constexpr double never = -1e300;  ///< m; the box of what was fitted then is everywhere

/// Patches gathered for a search: of more than these the tree finds the nearest sooner.
constexpr std::size_t most_near = 64;

struct Builder {
  const std::vector<Vector3>& middles;  ///< of the triangles
  std::vector<int> order;               ///< triangles, patch by patch
  SurfacePatches& patches;

  int build_node(int first, int count) {
    const int index = static_cast<int>(patches.nodes.size());
    patches.nodes.emplace_back();
    if (count <= SurfacePatches::most_triangles) {
      patches.nodes[index].patch = static_cast<int>(patches.leaf_of.size());
      patches.leaf_of.push_back(index);
      std::sort(order.begin() + first, order.begin() + first + count);
      patches.triangles.items.insert(patches.triangles.items.end(), order.begin() + first,
                                     order.begin() + first + count);
      patches.triangles.first.push_back(static_cast<int>(patches.triangles.items.size()));
      return index;
    }
    // Halve along the longest side; equal middles by index, so that the tree is one only.
    Box box;
    for (int i = first; i < first + count; ++i) box.add(middles[order[i]]);
    Eigen::Index axis = 0;
    box.size().maxCoeff(&axis);
    const auto before = [&](int a, int b) {
      return middles[a][axis] < middles[b][axis] || (middles[a][axis] == middles[b][axis] && a < b);
    };
    const int half = count / 2;
    std::nth_element(order.begin() + first, order.begin() + first + half, order.begin() + first + count, before);
    build_node(first, half);
    const int right = build_node(first + half, count - half);
    patches.nodes[index].right = right;
    return index;
  }
};

/// The lists of corners or edges of the triangles of each patch, ascending, each number once a patch.
template <class Items>
void list_items(const SurfacePatches& patches, const Items& items_of, FlatLists& lists) {
  std::vector<int> items;
  lists.first = {0};
  for (int patch = 0; patch < static_cast<int>(patches.leaf_of.size()); ++patch) {
    items.clear();
    for (const int* t = patches.triangles.begin(patch); t != patches.triangles.end(patch); ++t) {
      items.insert(items.end(), items_of[*t].begin(), items_of[*t].end());
    }
    std::sort(items.begin(), items.end());
    items.erase(std::unique(items.begin(), items.end()), items.end());
    lists.items.insert(lists.items.end(), items.begin(), items.end());
    lists.first.push_back(static_cast<int>(lists.items.size()));
  }
}

/// Leaves every item in the first of the lists that have it.
void keep_first(std::size_t count, FlatLists& lists) {
  std::vector<char> seen(count, 0);
  FlatLists kept;
  kept.first = {0};
  for (int list = 0; list + 1 < static_cast<int>(lists.first.size()); ++list) {
    for (const int* item = lists.begin(list); item != lists.end(list); ++item) {
      if (seen[*item] == 0) kept.items.push_back(*item);
      seen[*item] = 1;
    }
    kept.first.push_back(static_cast<int>(kept.items.size()));
  }
  lists = std::move(kept);
}

/// Lists the ends of each patch's edges, and where in that list they are.
void list_ends(const std::vector<Edge>& edges, SurfacePatches& patches) {
  patches.edge_vertices.first = {0};
  for (int patch = 0; patch < static_cast<int>(patches.leaf_of.size()); ++patch) {
    std::vector<int> vertices;
    for (const int* e = patches.edges.begin(patch); e != patches.edges.end(patch); ++e) {
      vertices.insert(vertices.end(), edges[*e].begin(), edges[*e].end());
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    const auto place_of = [&](int vertex) {
      return static_cast<int>(std::lower_bound(vertices.begin(), vertices.end(), vertex) - vertices.begin());
    };
    for (const int* e = patches.edges.begin(patch); e != patches.edges.end(patch); ++e) {
      patches.ends.push_back({place_of(edges[*e][0]), place_of(edges[*e][1])});
    }
    patches.edge_vertices.items.insert(patches.edge_vertices.items.end(), vertices.begin(), vertices.end());
    patches.edge_vertices.first.push_back(static_cast<int>(patches.edge_vertices.items.size()));
  }
}

}  // namespace

SurfacePatches build_patches(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                             const MeshTopology& topology) {
  SurfacePatches patches;
  std::vector<Vector3> middles;
  middles.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) middles.push_back((positions[a] + positions[b] + positions[c]) / 3.0);
  Builder builder = {middles, std::vector<int>(triangles.size()), patches};
  std::iota(builder.order.begin(), builder.order.end(), 0);
  patches.triangles.first = {0};
  builder.build_node(0, static_cast<int>(triangles.size()));

  list_items(patches, triangles, patches.vertices);
  list_items(patches, topology.triangle_edges, patches.edges);
  keep_first(topology.edges.size(), patches.edges);
  list_ends(topology.edges, patches);
  patches.patch_of.assign(positions.size(), 0);
  for (int patch = 0; patch < static_cast<int>(patches.leaf_of.size()); ++patch) {
    for (const int* v = patches.vertices.begin(patch); v != patches.vertices.end(patch); ++v) {
      patches.patch_of[*v] = patch;
    }
  }
  patches.near.reserve(patches.leaf_of.size());
  patches.near_triangles.rows.reserve(most_near * SurfacePatches::most_triangles / WideTree::lanes);
  forget(patches);
  return patches;
}

void forget(SurfacePatches& patches) {
  patches.travel = 0.0;  // it need not be a number any more
  patches.near_at = never;
  for (SurfacePatches::Node& node : patches.nodes) {
    node.box = {Vector3::Zero(), Vector3::Zero()};
    node.fitted_at = never;
  }
}

Box bounds_of(const SurfacePatches& patches) {
  return patches.nodes.front().box.grown(patches.travel - patches.nodes.front().fitted_at);
}

void fit_patch(const OrganSurface& organ, SurfacePatches::Node& leaf) {
  const SurfacePatches& patches = organ.patches;
  if (leaf.fitted_at == patches.travel) return;
  const int* first = patches.vertices.begin(leaf.patch);
  const int* last = patches.vertices.end(leaf.patch);
  if (organ.placement.place) organ.placement.place(organ.placement.carrier, first, last);
  // What is not a number hides no other: no comparison with it holds.
  Two lower = {1e300, 1e300}, upper = {-1e300, -1e300};
  double lowest = 1e300, highest = -1e300;
  for (const int* v = first; v != last; ++v) {
    const Vector3& p = organ.positions[*v];
    const Two& xy = *reinterpret_cast<const Two*>(p.data());
    lower = xy < lower ? xy : lower;
    upper = xy > upper ? xy : upper;
    lowest = p.z() < lowest ? p.z() : lowest;
    highest = p.z() > highest ? p.z() : highest;
  }
  leaf.box = {Vector3(lower[0], lower[1], lowest), Vector3(upper[0], upper[1], highest)};
  leaf.fitted_at = patches.travel;
}

void place_around(const OrganSurface& organ, int triangle) {
  if (!organ.placement.place) return;
  const FlatLists& around = organ.topology.vertex_triangles;
  for (const int corner : organ.triangles[triangle]) {
    for (const int* t = around.begin(corner); t != around.end(corner); ++t) {
      for (const int vertex : organ.triangles[*t]) place_vertex(organ, vertex);
    }
  }
}

void gather_near(const OrganSurface& organ, const TurnedBox& box) {
  SurfacePatches& patches = organ.patches;
  patches.near.clear();
  for_each_patch_near(organ, box, [&](int patch) { patches.near.push_back(patch); });
  patches.near_box = box;
  patches.near_at = patches.travel;
  if (patches.near.empty() || patches.near.size() > most_near) return;
  begin_rows(organ.positions[*patches.vertices.begin(patches.near.front())], patches.near_triangles);
  for (const int patch : patches.near) {
    for (const int* t = patches.triangles.begin(patch); t != patches.triangles.end(patch); ++t) {
      const auto& [a, b, c] = organ.triangles[*t];
      add_to_rows(*t, organ.positions[a], organ.positions[b], organ.positions[c], patches.near_triangles);
    }
  }
}

ClosestOnMesh closest_on_organ(const OrganSurface& organ, const Vector3& p, double reach, int guess) {
  SurfacePatches& patches = organ.patches;
  ClosestSearch search(organ.positions, organ.triangles, p, reach);
  if (guess >= 0) {
    for (const int vertex : organ.triangles[guess]) place_vertex(organ, vertex);
    search.look_at(guess);
  }
  if (patches.near_at == patches.travel && patches.near.size() <= most_near &&
      patches.near_box.contains(p, std::sqrt(search.bound))) {
    if (!patches.near.empty()) look_through(patches.near_triangles, search);
    return search.best;
  }
  const auto distance_to = [&](const SurfacePatches::Node& node) {
    return node.box.grown(patches.travel - node.fitted_at).squared_distance(p);
  };
  struct Entry {
    int node;
    double distance;
  };
  std::array<Entry, AabbTree::max_depth> stack;
  int depth = 0;
  stack[0] = {0, distance_to(patches.nodes[0])};
  while (depth >= 0) {
    const Entry entry = stack[depth--];
    if (search.too_far(entry.distance)) continue;
    SurfacePatches::Node& node = patches.nodes[entry.node];
    if (node.patch < 0) {
      Entry near = {entry.node + 1, distance_to(patches.nodes[entry.node + 1])};
      Entry far = {node.right, distance_to(patches.nodes[node.right])};
      if (far.distance < near.distance) std::swap(near, far);
      stack[++depth] = far;
      stack[++depth] = near;
      continue;
    }
    fit_patch(organ, node);
    if (search.too_far(node.box.squared_distance(p))) continue;
    for (const int* t = patches.triangles.begin(node.patch); t != patches.triangles.end(node.patch); ++t) {
      search.look_at_if_near(*t);
    }
  }
  return search.best;
}

}  // namespace tissue_sim
