#pragma once

#include <vector>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/tissue/level.h"

namespace tissue_sim {

/// What a level needs to wake only a part of it. Never changes.
struct RegionModel {
  AabbTree batches;     ///< of the batches of tetrahedra or cubes; or of pairs, flaps, triangles, distances; at rest
  FlatLists vertices;   ///< of each batch, every one once
  double radius = 0.0;  ///< m, around what touches an instrument
  double band = 0.0;    ///< m, inside the radius: where the coarser level takes over
  bool wall = false;    ///< of constraints
};

RegionModel build_region_model(const RestShape& shape, double radius, double edge);

/// The same for a wall, which has no coarser level: what is not free stays at its rest place, and there is no band.
RegionModel build_wall_region_model(const RestShape& shape, double radius);

/// What a vertex has to do with a region.
enum class Part : char { asleep, driven, free };

/// A part of a wall's batches.
struct ActiveElements {
  std::vector<int> vertices;        ///< all corners of the batches are among them
  ConstraintSelection constraints;  ///< into RestShape::constraints
  bool others_rest = false;         ///< the others are at rest: they add nothing to the enclosed volume
};

/// The part of a level that is simulated now; the rest follows the next coarser level.
struct ActiveRegion {
  std::vector<Vector3> centres;  ///< m, at rest: what lies within the radius of one of them is free
  std::vector<int> free;         ///< vertices that are integrated
  std::vector<Part> mark;        ///< per vertex
  std::vector<int> driven;       ///< of a wall: the other vertices of the active batches
  ActiveElements active;         ///< of a wall: those with a free vertex
};

/// Room for recentre(), one entry a vertex or batch.
struct RegionRoom {
  std::vector<std::uint64_t> vertex_stamp;
  std::vector<std::uint64_t> batch_stamp;
  std::vector<double> distance;  ///< m, of those that were looked at last
  std::vector<int> batches;      ///< with a free vertex
  std::vector<int> woken;        ///< vertices that were asleep before
  std::vector<int> fallen;       ///< vertices that were free before and are not any more
  std::uint64_t stamp = 0;
};
void prepare(RegionRoom& room, const RestShape& shape);

/// Lets what lies around the region's centres be free, and nothing else.
void recentre(const RegionModel& model, const RestShape& shape, ActiveRegion& region, RegionRoom& room);

}  // namespace tissue_sim
