#pragma once

#include <limits>

#include "tissue_sim/geometry/closest_point.h"
#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/geometry/triangle_mesh.h"
#include "tissue_sim/geometry/turned_box.h"
#include "tissue_sim/geometry/wide_tree.h"

namespace tissue_sim {

/// The plane of a triangle as the exact tests compute it.
struct TrianglePlane {
  Vector3 corner;  ///< the first
  Vector3 normal;  ///< m^2, area_normal()
};

/// One rigid piece of an instrument, ready for contact. Everything is in the frame of the instrument's tip and is built
/// once: organs are carried into this frame, so its tree never moves. Metres.
struct InstrumentSurface {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  MeshTopology topology;
  std::vector<Vector3> normals;         ///< unit, one a triangle; zero where it is degenerate
  std::vector<TrianglePlane> planes;    ///< one a triangle
  std::vector<Vector3> vertex_normals;  ///< unit, one a vertex, angle-weighted
  std::vector<double> radii;  ///< m, one a vertex: of the curve of the surface there, 0 at corners and sharp edges
  WideTree tree;
  Box bounds;
  double reach = 0.0;  ///< of its farthest point from the tip
  bool closed = true;
};

InstrumentSurface build_instrument_surface(const TriangleMesh& mesh, bool closed);

/// The vertices where the surface is curved more sharply than `radius` (m).
std::vector<int> sharper_than(const InstrumentSurface& surface, double radius);

/// The closest point of an instrument's surface, and which side of it p is on.
struct ClosestFeature {
  Vector3 point;
  Vector3 direction;  ///< unit, out of the instrument
  double depth;       ///< m, positive inside
  int triangle = -1;  ///< that has the point
};

/// Depth and direction of p (tip frame) by `closest`, the point of the surface nearest to it. The sign is that of the
/// pseudonormal there; where p lies on the surface the direction is that normal. Where `closest` has no triangle p is
/// outside, far away.
ClosestFeature feature_at(const InstrumentSurface& surface, const Vector3& p, const ClosestOnMesh& closest);

/// Exact depth and direction of p (tip frame). A position that is not a number is outside, far away, and so is what is
/// farther than `reach` (m) from the surface. `guess` is a triangle that may well be the closest, or -1: it
/// changes how long the search takes and not what it finds.
ClosestFeature closest_feature(const InstrumentSurface& surface, const Vector3& p,
                               double reach = std::numeric_limits<double>::infinity(), int guess = -1);

}  // namespace tissue_sim
