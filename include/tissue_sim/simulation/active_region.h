#pragma once

#include <vector>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/tissue/level.h"

namespace tissue_sim {

/// What a level needs to wake only a part of it. Never changes.
struct RegionModel {
  AabbTree batches;     ///< of the batches of tetrahedra; or of pairs, flaps, triangles, distances; at rest
  FlatLists vertices;   ///< of each batch, every one once
  double radius = 0.0;  ///< m, around what touches an instrument
  double band = 0.0;    ///< m, inside the radius: where the coarser level takes over
};

RegionModel build_region_model(const RestShape& shape, double radius, double edge);

/// The same for a wall, which has no coarser level: what is not free stays at its rest place, and there is no band.
RegionModel build_wall_region_model(const RestShape& shape, double radius);

/// What a vertex has to do with a region.
enum class Part : char { asleep, driven, free };

/// A part of an organ's batches.
struct ActiveElements {
  std::vector<int> vertices;        ///< all corners of the batches are among them
  std::vector<int> tetrahedra;      ///< ascending, into RestShape::packed
  ConstraintSelection constraints;  ///< into RestShape::constraints
  bool others_rest = false;         ///< the others are at rest: they add nothing to the enclosed volume
};

/// A free vertex that a spring pulls towards the coarser level.
struct BandVertex {
  int vertex = 0;
  double reach = 0.0;                  ///< 0 where the band begins, 1 at the radius
  Vector3 target = Vector3::Zero();    ///< m, where the coarser level would have it
  Vector3 velocity = Vector3::Zero();  ///< m/s, of the target
};

/// The part of a level that is simulated now; the rest follows the next coarser level.
struct ActiveRegion {
  ActiveElements active;         ///< those with a free vertex
  std::vector<int> free;         ///< vertices that are integrated
  std::vector<int> driven;       ///< the other vertices of the batches: they follow the coarser level
  std::vector<BandVertex> band;  ///< the outermost of the free ones
  std::vector<Part> mark;        ///< per vertex
};

/// Room for recentre(), one entry a vertex or batch.
struct RegionRoom {
  std::vector<std::uint64_t> vertex_stamp;
  std::vector<std::uint64_t> batch_stamp;
  std::vector<double> distance;
  std::vector<int> woken;   ///< vertices that were asleep before
  std::vector<int> fallen;  ///< vertices that were free before and are not any more
  std::uint64_t stamp = 0;
};
void prepare(RegionRoom& room, const RestShape& shape);

/// Around the centres, a list a piece (rest places, m): free is what lies within the radius of one of them at rest.
void recentre(const RegionModel& model, const RestShape& shape, const std::vector<std::vector<Vector3>>& centres,
              ActiveRegion& region, RegionRoom& room);

}  // namespace tissue_sim
