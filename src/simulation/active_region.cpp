#include "tissue_sim/simulation/active_region.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// Edges: how far inside the radius the coarser level begins to take over. Without it the force jumps when the region
/// moves.
constexpr double band_edges = 1.5;

/// What the batches of constraints multiply their vertices by.
constexpr int floats_of_vertex = 8;

/// Every vertex of the rows once, and the box around them.
template <class Rows>
void add_batch(const Rows& rows, int scale, const RestShape& shape, std::vector<Box>& boxes, RegionModel& model) {
  std::vector<int> vertices;
  for (const auto& row : rows) vertices.insert(vertices.end(), row.begin(), row.end());
  for (int& v : vertices) v /= scale;
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  Box box;
  for (const int v : vertices) box.add(shape.positions[v]);
  boxes.push_back(box);
  model.vertices.items.insert(model.vertices.items.end(), vertices.begin(), vertices.end());
  model.vertices.first.push_back(static_cast<int>(model.vertices.items.size()));
}

std::size_t count_batches(const RestShape& shape) {
  const ConstraintBatches& constraints = shape.constraints;
  return shape.packed.batches.size() + shape.cubes.batches.size() + constraints.pairs.size() +
         constraints.flaps.size() + constraints.triangles.size() + constraints.distances.size();
}

/// Where all batches are constraints: each kind's own, ascending, as ConstraintSelection asks for.
void sort_out(const ConstraintBatches& constraints, std::vector<int>& batches, ConstraintSelection& selection) {
  std::sort(batches.begin(), batches.end());
  auto next = batches.begin();
  int first = 0;
  const auto take = [&](std::size_t count, std::vector<int>& kind) {
    kind.clear();
    for (; next != batches.end() && *next < first + static_cast<int>(count); ++next) kind.push_back(*next - first);
    first += static_cast<int>(count);
  };
  take(constraints.pairs.size(), selection.pairs);
  take(constraints.flaps.size(), selection.flaps);
  take(constraints.triangles.size(), selection.triangles);
  take(constraints.distances.size(), selection.distances);
}

/// Boxes around centres that follow each other in the list and are near each other.
template <class Visit>
void for_each_box(const std::vector<Vector3>& centres, double near, const Visit& visit) {
  Box box;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (i > 0 && (centres[i] - centres[i - 1]).norm() > near) {
      visit(box);
      box = Box();
    }
    box.add(centres[i]);
  }
  if (!centres.empty()) visit(box);
}

}  // namespace

RegionModel build_region_model(const RestShape& shape, double radius, double edge) {
  RegionModel model;
  model.radius = radius;
  model.band = band_edges * edge;
  std::vector<Box> boxes;
  model.vertices.first.push_back(0);
  for (const NeoHookeanBatch& batch : shape.packed.batches) add_batch(batch.vertices, 1, shape, boxes, model);
  for (const CubeBatch& batch : shape.cubes.batches) add_batch(batch.vertices, 1, shape, boxes, model);
  model.batches.build(boxes);
  return model;
}

RegionModel build_wall_region_model(const RestShape& shape, double radius) {
  RegionModel model;
  model.wall = true;
  model.radius = radius;
  std::vector<Box> boxes;
  model.vertices.first.push_back(0);
  const auto add = [&](const auto& rows) { add_batch(rows, floats_of_vertex, shape, boxes, model); };
  for (const PairBatch& batch : shape.constraints.pairs) add(batch.flap.vertices);
  for (const FlapBatch& batch : shape.constraints.flaps) add(batch.vertices);
  for (const TriangleBatch& batch : shape.constraints.triangles) add(batch.vertices);
  for (const DistanceBatch& batch : shape.constraints.distances) add(batch.vertices);
  model.batches.build(boxes);
  return model;
}

void prepare(RegionRoom& room, const RestShape& shape) {
  room.vertex_stamp.assign(shape.positions.size(), 0);
  room.distance.assign(shape.positions.size(), 0.0);
  room.batch_stamp.assign(count_batches(shape), 0);
}

void recentre(const RegionModel& model, const RestShape& shape, ActiveRegion& region, RegionRoom& room) {
  ++room.stamp;
  room.woken.clear();
  room.batches.clear();
  for (const int v : region.driven) region.mark[v] = Part::asleep;
  region.driven.clear();
  std::vector<int>& before = room.fallen;  // becomes those of them that are not free again
  before.clear();
  before.swap(region.free);
  const auto distance_to = [&](const Vector3& place) {
    double nearest = 1e300;
    for (const Vector3& centre : region.centres) nearest = std::min(nearest, (place - centre).squaredNorm());
    return std::sqrt(nearest);
  };

  for_each_box(region.centres, model.radius, [&](const Box& box) {
    model.batches.for_each_near(box.grown(model.radius), [&](int batch) {
      if (room.batch_stamp[batch] == room.stamp) return;
      room.batch_stamp[batch] = room.stamp;
      bool awake = false;
      for (const int* v = model.vertices.begin(batch); v != model.vertices.end(batch); ++v) {
        if (room.vertex_stamp[*v] != room.stamp) {
          room.vertex_stamp[*v] = room.stamp;
          room.distance[*v] = distance_to(shape.positions[*v]);
        }
        awake = awake || room.distance[*v] < model.radius;
      }
      if (awake) room.batches.push_back(batch);
    });
  });
  for (const int batch : room.batches) {
    for (const int* v = model.vertices.begin(batch); v != model.vertices.end(batch); ++v) {
      if (room.vertex_stamp[*v] == 0) continue;
      room.vertex_stamp[*v] = 0;  // listed
      if (room.distance[*v] < model.radius) {
        region.free.push_back(*v);
      } else if (model.wall) {
        region.driven.push_back(*v);
      }
    }
  }
  if (model.wall) {
    sort_out(shape.constraints, room.batches, region.active.constraints);
    region.active.others_rest = true;
  }

  // What was free and is not any more falls asleep; what is free and was not wakes.
  for (const int v : before) region.mark[v] = Part::driven;
  for (const int v : region.free) {
    if (region.mark[v] == Part::asleep) room.woken.push_back(v);
    region.mark[v] = Part::free;
  }
  std::size_t fallen = 0;
  for (const int v : before) {
    if (region.mark[v] == Part::free) continue;
    region.mark[v] = Part::asleep;
    before[fallen++] = v;
  }
  before.resize(fallen);
  for (const int v : region.driven) region.mark[v] = Part::driven;
  region.active.vertices = region.free;
  region.active.vertices.insert(region.active.vertices.end(), region.driven.begin(), region.driven.end());
}

}  // namespace tissue_sim
