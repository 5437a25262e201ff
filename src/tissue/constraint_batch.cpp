#include "tissue_sim/tissue/constraint_batch.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "constraint_lanes.h"
#include "tissue_sim/geometry/elementary.h"
#include "tissue_sim/tissue/neo_hookean_corners.h"

namespace tissue_sim {
namespace {

constexpr int vertex_floats = 8;  // of a VertexMotion, and of a VertexPull
static_assert(sizeof(VertexMotion) == vertex_floats * sizeof(float) && sizeof(VertexPull) == sizeof(VertexMotion),
              "batches say where a vertex's floats begin");

/// Places for elements in batches that grow by one whenever one more is needed.
template <class Batch>
class Filler {
 public:
  explicit Filler(std::vector<Batch>& batches) : batches_(batches) {}

  /// The next lane, of the batch that is the last then. In a new one all corners are in `vertex`.
  std::size_t next(int vertex) {
    const std::size_t lane = count_++ % constraint_lanes;
    if (lane == 0) batches_.push_back(empty_batch(vertex));
    return lane;
  }

 private:
  static Batch empty_batch(int vertex) {
    Batch batch{};
    for (IntLanes& row : vertices_of(batch)) row.fill(vertex_floats * vertex);
    return batch;
  }
  static std::array<IntLanes, 4>& vertices_of(PairBatch& batch) { return batch.flap.vertices; }
  template <class Other>
  static auto& vertices_of(Other& batch) {
    return batch.vertices;
  }

  std::vector<Batch>& batches_;
  std::size_t count_ = 0;
};

float float_of(double value) {
  return static_cast<float>(value);
}

template <std::size_t rows>
void put_vertices(const std::array<int, rows>& vertices, std::size_t l, std::array<IntLanes, rows>& lanes) {
  for (std::size_t i = 0; i < rows; ++i) lanes[i][l] = vertex_floats * vertices[i];
}

/// Of the corners as they are, not as floats: far from the origin those have no digits left for an edge.
void put_edge(const std::vector<Vector3>& rest, int from, int to, std::size_t l, FloatLanes* rows) {
  const Vector3 edge = rest[to] - rest[from];
  for (std::size_t i = 0; i < 3; ++i) rows[i][l] = float_of(edge[static_cast<Eigen::Index>(i)]);
}

/// A distance's k |grad C|^2 is the same at every length: how much of it counts is known beforehand.
double softened(const DistanceElement& element, const StiffnessLimit& limit) {
  const double slope = limit.inverse_mass[element.vertices[0]] + limit.inverse_mass[element.vertices[1]];
  const double squared_frequency = element.stiffness * slope / square(element.scale);
  return squared_frequency > limit.stiffest ? limit.stiffest / squared_frequency : 1.0;
}

using Corners = std::array<int, 4>;

/// Their pull is that of a constraint squared: whether the volume is counted positive or negative is the same.
void put_flap(const Corners& corners, const VolumeElement& element, const DistanceElement* distance,
              const std::vector<Vector3>& rest, const StiffnessLimit& limit, std::size_t l, FlapBatch& batch) {
  put_vertices(corners, l, batch.vertices);
  for (std::size_t i = 1; i < 4; ++i) put_edge(rest, corners[0], corners[i], l, &batch.edges[3 * (i - 1)]);
  batch.length[l] = float_of((rest[corners[1]] - rest[corners[0]]).norm());
  batch.volume_stiffness[l] = float_of(element.stiffness / square(6.0 * element.scale));
  batch.volume_damping[l] = float_of(element.damping / square(6.0 * element.scale));
  if (distance == nullptr) return;
  const double share = softened(*distance, limit) / square(distance->scale);
  batch.distance_stiffness[l] = float_of(share * distance->stiffness);
  batch.distance_damping[l] = float_of(share * distance->damping);
}

void put_area(const Triangle& corners, const AreaElement* element, const std::vector<Vector3>& rest, std::size_t l,
              AreaLanes& lanes) {
  lanes.twice_area[l] = float_of(area_normal(rest[corners[0]], rest[corners[1]], rest[corners[2]]).norm());
  if (element == nullptr) return;
  lanes.stiffness[l] = float_of(element->stiffness / square(2.0 * element->scale));
  lanes.damping[l] = float_of(element->damping / square(2.0 * element->scale));
}

void put_distance(const DistanceElement& element, const std::vector<Vector3>& rest, const StiffnessLimit& limit,
                  std::size_t l, DistanceBatch& batch) {
  put_vertices(element.vertices, l, batch.vertices);
  put_edge(rest, element.vertices[0], element.vertices[1], l, batch.edge.data());
  batch.length[l] = float_of((rest[element.vertices[1]] - rest[element.vertices[0]]).norm());
  const double share = softened(element, limit) / square(element.scale);
  batch.stiffness[l] = float_of(share * element.stiffness);
  batch.damping[l] = float_of(share * element.damping);
}

/// Finds elements by their vertices, in any order. An element is taken once.
template <std::size_t size>
class Finder {
 public:
  template <class Elements>
  Finder(const Elements& elements, std::size_t count) : taken_(count, 0) {
    for (std::size_t i = 0; i < count; ++i) keys_.push_back({sorted(elements(i)), i});
    std::sort(keys_.begin(), keys_.end());
  }

  /// Which of the elements has these vertices and is not taken yet; -1: none.
  int find(const std::array<int, size>& vertices) const {
    const std::array<int, size> key = sorted(vertices);
    const auto found = std::lower_bound(keys_.begin(), keys_.end(), Key{key, 0});
    if (found == keys_.end() || found->first != key || taken_[found->second] != 0) return -1;
    return static_cast<int>(found->second);
  }

  void take(int element) { taken_[static_cast<std::size_t>(element)] = 1; }
  bool taken(std::size_t element) const { return taken_[element] != 0; }

 private:
  using Key = std::pair<std::array<int, size>, std::size_t>;
  static std::array<int, size> sorted(std::array<int, size> vertices) {
    std::sort(vertices.begin(), vertices.end());
    return vertices;
  }

  std::vector<Key> keys_;
  std::vector<char> taken_;
};

/// Takes a distance element between two of the corners, and turns those to the front; null where all are taken.
const DistanceElement* take_edge(const std::vector<DistanceElement>& distances, Finder<2>& edges, Corners& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j) {
      const int distance = edges.find({corners[i], corners[j]});
      if (distance < 0) continue;
      edges.take(distance);
      std::swap(corners[0], corners[i]);
      std::swap(corners[1], corners[j]);
      return &distances[static_cast<std::size_t>(distance)];
    }
  }
  return nullptr;
}

/// Whether the corners go round from a straight to b.
bool goes_from(const Triangle& corners, int a, int b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (corners[i] == a) return corners[(i + 1) % 3] == b;
  }
  return false;
}

void add_chosen(const ConstraintBatches& batches, const ChosenConstraints& chosen, const VertexMotion* motions,
                VertexPull* pulls, EnclosedShare* shares, InstructionSet set) {
  if (!available(set)) {
    throw std::invalid_argument(std::string("add_constraint_forces: this processor has no ") + name(set));
  }
  const TinyIsZero tiny_is_zero;
#ifdef __x86_64__
  if (set == InstructionSet::avx512) return add_constraint_forces_avx512(batches, chosen, motions, pulls, shares);
  if (set == InstructionSet::avx2) return add_constraint_forces_avx2(batches, chosen, motions, pulls, shares);
#endif
  add_constraint_forces_baseline(batches, chosen, motions, pulls, shares);
}

ChosenBatches chosen(const std::vector<int>& list) {
  return {list.data(), list.size(), 0};
}

ChosenBatches chosen(const BatchRange& range) {
  return {nullptr, range.count, range.first};
}

/// Of a ConstraintSelection, or of ConstraintRanges.
template <class Selection>
ChosenConstraints chosen_of(const Selection& selection) {
  return {chosen(selection.pairs), chosen(selection.flaps), chosen(selection.triangles), chosen(selection.distances)};
}

}  // namespace

ConstraintBatches pack(const std::vector<DistanceElement>& distances, const std::vector<AreaElement>& areas,
                       const std::vector<VolumeElement>& volumes, const std::vector<Triangle>& triangles,
                       const std::vector<Vector3>& rest, const StiffnessLimit& limit) {
  ConstraintBatches batches;
  batches.stiffest = float_of(limit.stiffest);
  Filler<PairBatch> pairs(batches.pairs);
  Filler<FlapBatch> flaps(batches.flaps);
  Filler<TriangleBatch> left_triangles(batches.triangles);
  Filler<DistanceBatch> left_distances(batches.distances);
  Finder<2> edges([&](std::size_t i) { return distances[i].vertices; }, distances.size());
  Finder<3> surface([&](std::size_t i) { return triangles[i]; }, triangles.size());
  const auto area_of = [&](int t) { return areas.empty() ? nullptr : &areas[static_cast<std::size_t>(t)]; };

  for (const VolumeElement& volume : volumes) {
    Corners corners = volume.vertices;
    const DistanceElement* distance = take_edge(distances, edges, corners);
    const int first = surface.find({corners[0], corners[1], corners[2]});
    const int second = surface.find({corners[0], corners[1], corners[3]});
    if (first < 0 || second < 0) {
      const std::size_t l = flaps.next(corners[0]);
      put_flap(corners, volume, distance, rest, limit, l, batches.flaps.back());
      continue;
    }
    surface.take(first);
    surface.take(second);
    // The first triangle's corners go round as 0 1 2: that is where the enclosed volume is on its other side.
    if (!goes_from(triangles[static_cast<std::size_t>(first)], corners[0], corners[1]))
      std::swap(corners[0], corners[1]);
    const std::size_t l = pairs.next(corners[0]);
    PairBatch& batch = batches.pairs.back();
    put_flap(corners, volume, distance, rest, limit, l, batch.flap);
    put_area({corners[0], corners[1], corners[2]}, area_of(first), rest, l, batch.areas[0]);
    put_area({corners[0], corners[3], corners[1]}, area_of(second), rest, l, batch.areas[1]);
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (surface.taken(t)) continue;
    const std::size_t l = left_triangles.next(triangles[t][0]);
    TriangleBatch& batch = batches.triangles.back();
    put_vertices(triangles[t], l, batch.vertices);
    put_edge(rest, triangles[t][0], triangles[t][1], l, &batch.edges[0]);
    put_edge(rest, triangles[t][0], triangles[t][2], l, &batch.edges[3]);
    put_area(triangles[t], area_of(static_cast<int>(t)), rest, l, batch.area);
  }
  for (std::size_t d = 0; d < distances.size(); ++d) {
    if (edges.taken(d)) continue;
    const std::size_t l = left_distances.next(distances[d].vertices[0]);
    put_distance(distances[d], rest, limit, l, batches.distances.back());
  }
  return batches;
}

void add_constraint_forces(const ConstraintBatches& batches, const VertexMotion* motions, VertexPull* pulls,
                           EnclosedShare* shares, InstructionSet set) {
  const ConstraintRanges all = {{0, batches.pairs.size()},
                                {0, batches.flaps.size()},
                                {0, batches.triangles.size()},
                                {0, batches.distances.size()}};
  add_chosen(batches, chosen_of(all), motions, pulls, shares, set);
}

void add_constraint_forces(const ConstraintBatches& batches, const ConstraintSelection& selection,
                           const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares, InstructionSet set) {
  add_chosen(batches, chosen_of(selection), motions, pulls, shares, set);
}

void add_constraint_forces(const ConstraintBatches& batches, const ConstraintRanges& ranges,
                           const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares, InstructionSet set) {
  add_chosen(batches, chosen_of(ranges), motions, pulls, shares, set);
}

}  // namespace tissue_sim
