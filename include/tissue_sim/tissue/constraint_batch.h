#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "tissue_sim/tissue/area.h"
#include "tissue_sim/tissue/distance.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"
#include "tissue_sim/tissue/volume.h"

namespace tissue_sim {

constexpr std::size_t constraint_lanes = 8;
using IntLanes = std::array<int, constraint_lanes>;
using FloatLanes = std::array<float, constraint_lanes>;

/// Eight volume elements side by side, each with the distance element of its vertices 0 and 1: a flap with its edge,
/// or a tetrahedron with one of its edges. Lane l of every array belongs to the l-th. Where a tetrahedron got no edge
/// the stiffness of the distance is 0. What is left free in the last batch of any kind has all corners in one vertex
/// and pulls at nothing. Vertices are given times 8: where the floats of a VertexMotion or VertexPull begin.
struct alignas(32) FlapBatch {
  std::array<IntLanes, 4> vertices;                 ///< one row a corner
  std::array<FloatLanes, 9> edges;                  ///< m, at rest: from corner 0 to corner 1, to 2, to 3
  FloatLanes length;                                ///< m, at rest, of the first of them
  FloatLanes distance_stiffness, distance_damping;  ///< of the length: N/m, N s/m
  FloatLanes volume_stiffness, volume_damping;      ///< of six times the volume: N/m^5, N s/m^5
};

/// The area element of a triangle, if it has one.
struct alignas(32) AreaLanes {
  FloatLanes twice_area;          ///< m^2, at rest
  FloatLanes stiffness, damping;  ///< of twice the area: N/m^3, N s/m^3
};

/// Flaps with both of their triangles: corners 0 1 2 and 0 3 1. Most triangles of a surface can be joined in such
/// pairs, and need no gathering of their own.
struct alignas(32) PairBatch {
  FlapBatch flap;
  std::array<AreaLanes, 2> areas;
};

/// Triangles that are left over.
struct alignas(32) TriangleBatch {
  std::array<IntLanes, 3> vertices;
  std::array<FloatLanes, 6> edges;  ///< m, at rest: from corner 0 to corner 1, to 2
  AreaLanes area;
};

/// Distance elements that are left over.
struct alignas(32) DistanceBatch {
  std::array<IntLanes, 2> vertices;
  std::array<FloatLanes, 3> edge;  ///< m, at rest
  FloatLanes length;               ///< m, at rest
  FloatLanes stiffness, damping;   ///< N/m, N s/m
};

/// Distance, area and volume elements in single precision, eight a batch. What they measure at rest is what the rest
/// positions have.
struct ConstraintBatches {
  std::vector<PairBatch> pairs;
  std::vector<FlapBatch> flaps;
  std::vector<TriangleBatch> triangles;
  std::vector<DistanceBatch> distances;
  float stiffest = 0.0F;  ///< 1/s^2, see StiffnessLimit

  bool empty() const { return pairs.empty() && flaps.empty() && triangles.empty() && distances.empty(); }
  std::size_t shares() const { return pairs.size() + triangles.size(); }
};

/// `triangles`: the surface, if it has areas or encloses a volume that is kept; else empty. There are as many areas as
/// triangles, in their order, or none.
ConstraintBatches pack(const std::vector<DistanceElement>& distances, const std::vector<AreaElement>& areas,
                       const std::vector<VolumeElement>& volumes, const std::vector<Triangle>& triangles,
                       const std::vector<Vector3>& rest, const StiffnessLimit& limit);

/// What the elements read of a vertex. A displacement is measured from the rest position: a float keeps seven digits of
/// it, and every measure's change is computed from displacements, so that small strains keep their digits too.
struct alignas(32) VertexMotion {
  std::array<float, 3> displacement{};  ///< m
  float inverse_mass = 0.0F;            ///< 1/kg
  std::array<float, 3> velocity{};      ///< m/s
  float unused = 0.0F;
};

/// What they add to at a vertex.
struct alignas(32) VertexPull {
  std::array<float, 3> force{};  ///< N
  float unused = 0.0F;
  std::array<float, 3> normal{};  ///< m^2, gradient of six times the enclosed volume: sum of twice the areas around
  float unused_too = 0.0F;
};

/// What the triangles of a batch add to six times the enclosed volume, lane by lane.
struct alignas(32) EnclosedShare {
  FloatLanes change{};  ///< m^3, since rest
  FloatLanes rate{};    ///< m^3/s
};

/// Some of the batches, by their ascending indices.
struct ConstraintSelection {
  std::vector<int> pairs;
  std::vector<int> flaps;
  std::vector<int> triangles;
  std::vector<int> distances;
};

/// Batches of each kind that follow each other.
struct ConstraintRanges {
  BatchRange pairs;
  BatchRange flaps;
  BatchRange triangles;
  BatchRange distances;
};

/// Adds the elements' forces and normals to `pulls` and writes `shares`, one a batch of pairs, then one a batch of
/// triangles. With the same bits for every instruction set: the lanes do not meet, and a vertex's forces are added in
/// the order of the kinds, the batches and the lanes. Numbers below the smallest normal float count as zero.
///
/// On a Zen 4 core a sphere of 8,064 triangles takes 5.7, 3.7 and 3.3 ns an element with the three instruction sets,
/// a stomach of 20,000 6.3, 4.1 and 3.7; one by one in double it is 21. All flaps and all triangles by themselves took
/// 5.2 where this takes 3.7; registers of 64 bytes took as long as 32, on a Zen 5 core too. Lanes that are far from
/// each other, so that no vertex is added to twice in a row, would gain 3 to 10 %, but spread a small part of an organ
/// over many batches.
void add_constraint_forces(const ConstraintBatches& batches, const VertexMotion* motions, VertexPull* pulls,
                           EnclosedShare* shares, InstructionSet set = instruction_set());

/// The same for some of the batches only: the same bits as if there were no others. The shares of others stay.
void add_constraint_forces(const ConstraintBatches& batches, const ConstraintSelection& selection,
                           const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares,
                           InstructionSet set = instruction_set());
void add_constraint_forces(const ConstraintBatches& batches, const ConstraintRanges& ranges,
                           const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares,
                           InstructionSet set = instruction_set());

}  // namespace tissue_sim
