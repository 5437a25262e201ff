#pragma once

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/triangle_mesh.h"
#include "tissue_sim/geometry/turned_box.h"
#include "tissue_sim/geometry/wide_tree.h"

namespace tissue_sim {

/// The triangles of an organ in patches of neighbours, and a tree of boxes over the patches that is fitted where
/// somebody looks and nowhere else: a box remembers `travel`, the farthest way that any vertex can have gone so far,
/// and holds its patch when grown by what travel has grown since. A query fits anew what its grown box still overlaps.
/// So a pass costs what is near, whatever the size of the organ.
struct SurfacePatches {
  static constexpr int most_triangles = 16;

  /// Children of an inner node: the next node and `right`. A leaf has a patch.
  struct Node {
    Box box;
    double fitted_at = 0.0;  ///< m, of travel
    int right = 0;
    int patch = -1;
  };

  FlatLists triangles;        ///< of each patch, ascending
  FlatLists vertices;         ///< of each patch, ascending: all corners of its triangles
  FlatLists edges;            ///< of each patch, ascending: every edge of the organ is in one patch only
  FlatLists edge_vertices;    ///< of each patch, ascending: the ends of its edges
  std::vector<Edge> ends;     ///< of each entry of edges.items: where the edge's ends are in the patch's edge_vertices
  std::vector<int> patch_of;  ///< per vertex: one of the patches that have it
  std::vector<int> leaf_of;   ///< per patch, into nodes
  std::vector<Node> nodes;    ///< depth first: every child stands after its parent
  double travel = 0.0;        ///< m; whoever moves vertices adds the farthest way of one

  std::vector<int> near;   ///< patches that overlap near_box, while travel is near_at
  BoxRows near_triangles;  ///< theirs, unless they are too many to be looked through
  TurnedBox near_box = {Box(), Pose()};
  double near_at = -1e300;  ///< m
};

SurfacePatches build_patches(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                             const MeshTopology& topology);

/// To be called after vertices were put somewhere without adding to `travel`: no box holds them any more.
void forget(SurfacePatches& patches);

/// Holds the whole surface.
Box bounds_of(const SurfacePatches& patches);

/// Puts vertices of an organ (first .. last - 1 are their numbers) where they are now. For a surface that something
/// coarser carries: given one, contact asks for the vertices of a patch before it looks at them, once for every value
/// of `travel`, and the step need not move the others. A vertex of two patches is asked for twice. Travel has to bound
/// the way of the carried vertices too, placed or not: that of the fastest carrier times the largest sum of |weights|.
struct Placement {
  void (*place)(void* carrier, const int* first, const int* last) = nullptr;  ///< none: all vertices are in place
  void* carrier = nullptr;
};

/// The surface of an organ as contact sees it. Borrowed for the length of a call.
struct OrganSurface {
  const std::vector<Vector3>& positions;  ///< scene frame
  const std::vector<Triangle>& triangles;
  const MeshTopology& topology;
  const std::vector<int>& component_roots;  ///< one vertex of each connected surface
  SurfacePatches& patches;
  Placement placement = {};
};

/// Places the vertices of a leaf's patch and fits its box to them, unless that is done already.
void fit_patch(const OrganSurface& organ, SurfacePatches::Node& leaf);

/// Sees to it that the vertex is where it is now.
inline void place_vertex(const OrganSurface& organ, int vertex) {
  if (!organ.placement.place) return;
  fit_patch(organ, organ.patches.nodes[organ.patches.leaf_of[organ.patches.patch_of[vertex]]]);
}

/// The same for all that touch a triangle: its normals at corners and rims need them.
void place_around(const OrganSurface& organ, int triangle);

/// Calls visit(patch) for every patch whose box overlaps the region (a Box, or what else can tell), in a fixed order,
/// its vertices placed and its box exact.
template <class Region, class Visit>
void for_each_patch_near(const OrganSurface& organ, const Region& region, Visit&& visit, int node = 0) {
  SurfacePatches& patches = organ.patches;
  SurfacePatches::Node& here = patches.nodes[node];
  const double outrun = patches.travel - here.fitted_at;
  if (!region.overlaps(here.box.grown(outrun))) return;
  if (here.patch >= 0) {
    fit_patch(organ, here);
    if (region.overlaps(here.box)) visit(here.patch);
    return;
  }
  for_each_patch_near(organ, region, visit, node + 1);
  for_each_patch_near(organ, region, visit, here.right);
  if (outrun == 0.0) return;
  // What is far below it stays as it is.
  here.box = Box();
  for (const int child : {node + 1, here.right}) {
    here.box.add(patches.nodes[child].box.grown(patches.travel - patches.nodes[child].fitted_at));
  }
  here.fitted_at = patches.travel;
}

/// Gathers the patches near a box for the searches that follow, while nothing moves.
void gather_near(const OrganSurface& organ, const TurnedBox& box);

/// The point of the organ nearest to p (scene frame), as closest_on_mesh finds it.
ClosestOnMesh closest_on_organ(const OrganSurface& organ, const Vector3& p, double reach, int guess = -1);

}  // namespace tissue_sim
