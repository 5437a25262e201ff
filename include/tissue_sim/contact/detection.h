#pragma once

#include "tissue_sim/contact/ascending_set.h"
#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/contact/surface_patches.h"
#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// Where an organ edge goes through an instrument triangle. Tip frame.
struct Crossing {
  int edge = 0;
  int triangle = 0;   ///< of the instrument
  double t = 0.0;     ///< along the edge, 0 at its first vertex
  int direction = 0;  ///< +1: out of the instrument, seen along the edge; -1: into it
  Vector3 point = Vector3::Zero();
};

/// The crossings of one edge: crossings[first] .. crossings[first + count - 1], in order along the edge.
struct CrossedEdge {
  int edge = 0;
  int first = 0;
  int count = 0;
};

/// Where the crossings put a border vertex.
enum class Side : signed char { unknown, inside, outside, contradicted };

/// A ball in the tip frame that the instrument's surface does not reach into, and the triangle that bounds it. The
/// instrument stands still in that frame, so the ball stays free whatever organ and instrument do: it has to be
/// forgotten for no motion, jump or reset.
struct FreeBall {
  Vector3 centre = Vector3::Zero();
  double radius = -1.0;  ///< m; negative: not known
  int triangle = -1;
};

/// An edge that goes through the plane of a triangle.
struct PlaneHit {
  int edge = 0;
  int triangle = 0;
  double t = 0.0;
  int direction = 0;
  bool within_rims = false;  ///< surely, as in EdgeTrianglePair
};

/// What stage 1 finds between one organ and one piece of an instrument. Reused from step to step: nothing is allocated
/// once it has been as large as it needs. To be prepared anew for another organ or piece.
struct Detection {
  std::vector<Crossing> crossings;
  std::vector<CrossedEdge> crossed_edges;  ///< ascending
  std::vector<int> border;                 ///< colliding border vertices, ascending
  std::vector<int> border_outside;         ///< border vertices that do not collide, ascending
  std::vector<int> colliding;              ///< all colliding vertices, ascending; the border among them
  std::vector<Vector3> local;              ///< positions in the tip frame, where local_stamp is the current one
  std::vector<int> crossed_edge_of;        ///< per edge, into crossed_edges, where edge_stamp is the current one

  int stamp = 0;
  std::vector<int> edge_stamp;  ///< the current one: the edge is crossed
  std::vector<int> local_stamp;
  std::vector<int> side_stamp;
  std::vector<Side> side;    ///< per vertex, where side_stamp is the current one
  std::vector<int> nearest;  ///< per vertex: the triangle of the instrument found last, or -1; a guess for the next
                             ///< search, which makes it shorter and changes nothing else
  std::vector<FreeBall> free_balls;     ///< per patch: around where its middle was when that was last asked for
  std::vector<FloatPoint> rounded;      ///< of `local`, those of the ends of a patch's edges
  std::vector<EdgeTrianglePair> pairs;  ///< that may cross
  std::vector<PlaneHit> hits;           ///< of these: where the plane is crossed
  WideTreeRoom tree_room;
  AscendingSet edge_set;
  AscendingSet vertex_set;
  AscendingSet outside_set;
  std::vector<CrossedEdge> unordered;
  std::vector<int> stack;
  int fallbacks = 0;  ///< vertices decided by the closest feature, in all
};

void prepare(Detection& detection, const OrganSurface& organ);

/// Stage 1: crossings, border vertices and, by `set`, the colliding vertices.
///
/// `flood`: from the colliding border inward over edges that nothing crosses; where the border contradicts itself (a
/// vertex on the surface within rounding, an open instrument) the closest feature decides. `paper`: border vertices and
/// what was colliding in the step before; `memory` (one entry a vertex) carries that from call to call and is used by
/// `paper` only.
void detect(const OrganSurface& organ, const InstrumentSurface& instrument, const Pose& pose, CollidingSet set,
            std::vector<char>& memory, Detection& detection);

/// closest_feature() of an organ vertex, from where the last one was found.
ClosestFeature closest_feature_of(const InstrumentSurface& instrument, Detection& detection, int vertex,
                                  double reach = std::numeric_limits<double>::infinity());

/// Position of an organ vertex in the tip frame.
const Vector3& local_position(Detection& detection, const OrganSurface& organ, const Pose& pose, int vertex);

}  // namespace tissue_sim
