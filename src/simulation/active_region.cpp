#include "tissue_sim/simulation/active_region.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// Edges: how far inside the radius the coarser level begins to take over. Without it the force jumps when the region
/// moves.
constexpr double band_edges = 2.5;

}  // namespace

RegionModel build_region_model(const RestShape& shape, double radius, double edge) {
  RegionModel model;
  model.radius = radius;
  model.band = band_edges * edge;
  std::vector<Box> boxes;
  model.vertices.first.push_back(0);
  for (const NeoHookeanBatch& batch : shape.packed.batches) {
    std::vector<int> vertices;
    for (const auto& row : batch.vertices) vertices.insert(vertices.end(), row.begin(), row.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    Box box;
    for (const int v : vertices) box.add(shape.positions[v]);
    boxes.push_back(box);
    model.vertices.items.insert(model.vertices.items.end(), vertices.begin(), vertices.end());
    model.vertices.first.push_back(static_cast<int>(model.vertices.items.size()));
  }
  model.batches.build(boxes);
  return model;
}

void prepare(RegionRoom& room, const RestShape& shape) {
  room.vertex_stamp.assign(shape.positions.size(), 0);
  room.distance.assign(shape.positions.size(), 0.0);
  room.batch_stamp.assign(shape.packed.batches.size(), 0);
}

void recentre(const RegionModel& model, const RestShape& shape, const std::vector<std::vector<Vector3>>& centres,
              ActiveRegion& region, RegionRoom& room) {
  ++room.stamp;
  room.woken.clear();
  room.fallen.clear();
  const auto distance_to = [&](const Vector3& place) {
    double nearest = 1e300;
    for (const std::vector<Vector3>& of_piece : centres) {
      for (const Vector3& centre : of_piece) nearest = std::min(nearest, (place - centre).squaredNorm());
    }
    return std::sqrt(nearest);
  };

  for (const int v : region.driven) region.mark[v] = Part::asleep;
  std::vector<int>& before = room.fallen;  // becomes those of them that are not free again
  before.swap(region.free);
  region.active.tetrahedra.clear();
  region.driven.clear();
  region.free.clear();
  for (const std::vector<Vector3>& of_piece : centres) {
    if (of_piece.empty()) continue;
    Box box;
    for (const Vector3& centre : of_piece) box.add(centre);
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
      if (awake) region.active.tetrahedra.push_back(batch);
    });
  }
  for (const int batch : region.active.tetrahedra) {
    for (const int* v = model.vertices.begin(batch); v != model.vertices.end(batch); ++v) {
      if (room.vertex_stamp[*v] == 0) continue;
      room.vertex_stamp[*v] = 0;  // listed
      (room.distance[*v] < model.radius ? region.free : region.driven).push_back(*v);
    }
  }

  // What was free and is not any more falls asleep; what is free and was not wakes.
  region.band.clear();
  for (const int v : before) region.mark[v] = Part::driven;
  for (const int v : region.free) {
    if (region.mark[v] == Part::asleep) room.woken.push_back(v);
    region.mark[v] = Part::free;
    const double reach = 1.0 - (model.radius - room.distance[v]) / model.band;
    if (!(reach > 0.0)) continue;
    region.band.emplace_back();
    region.band.back().vertex = v;
    region.band.back().reach = reach;
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
