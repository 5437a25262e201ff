#include "tissue_sim/contact/propagation.h"

#include <algorithm>
#include <limits>

namespace tissue_sim {

namespace {

constexpr int not_reached = std::numeric_limits<int>::max();
constexpr int not_colliding = -1;
constexpr double no_direction = 1e-3;  ///< of the weight: less is left of the directions and they have no common one

template <class Visit>
void for_each_neighbour(const MeshTopology& topology, int vertex, Visit&& visit) {
  for (const int* edge = topology.vertex_edges.begin(vertex); edge != topology.vertex_edges.end(vertex); ++edge) {
    const auto& [a, b] = topology.edges[*edge];
    visit(a == vertex ? b : a);
  }
}

void take_from_neighbours(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& detection,
                          int vertex, int layer, Penetration& penetration) {
  const Vector3& p = detection.local[vertex];
  double weight_sum = 0.0;
  double depth_sum = 0.0;
  Vector3 direction_sum = Vector3::Zero();
  for_each_neighbour(organ.topology, vertex, [&](int neighbour) {
    const int neighbour_layer = penetration.layer_of[neighbour];
    if (neighbour_layer == not_colliding || neighbour_layer >= layer) return;
    const Vector3& p_j = detection.local[neighbour];
    const Vector3& r_j = penetration.direction[neighbour];
    const double weight = inverse_square_weight(p_j, p);
    weight_sum += weight;
    depth_sum += weight * ((p_j - p).dot(r_j) + penetration.depth[neighbour]);
    direction_sum += weight * r_j;
  });

  if (direction_sum.norm() > no_direction * weight_sum) {
    penetration.depth[vertex] = std::max(0.0, depth_sum / weight_sum);
    penetration.direction[vertex] = direction_sum.normalized();
  } else {
    take_closest_feature(instrument, detection, vertex, penetration);
  }
}

}  // namespace

void propagate(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& detection,
               Penetration& penetration) {
  std::vector<int>& layer = penetration.layer;
  std::vector<int>& next_layer = penetration.next_layer;
  for (const int vertex : detection.colliding) penetration.layer_of[vertex] = not_reached;
  for (const int vertex : detection.border) penetration.layer_of[vertex] = 0;

  layer = detection.border;
  for (int depth = 1; !layer.empty(); ++depth) {
    next_layer.clear();
    for (const int vertex : layer) {
      for_each_neighbour(organ.topology, vertex, [&](int neighbour) {
        if (penetration.layer_of[neighbour] != not_reached) return;
        penetration.layer_of[neighbour] = depth;
        next_layer.push_back(neighbour);
      });
    }
    for (const int vertex : next_layer) detection.vertex_set.add(vertex);
    next_layer.clear();
    detection.vertex_set.drain_to(next_layer);
    for (const int vertex : next_layer) {
      take_from_neighbours(organ, instrument, detection, vertex, depth, penetration);
    }
    layer.swap(next_layer);
  }

  for (const int vertex : detection.colliding) {
    if (penetration.layer_of[vertex] == not_reached) {
      take_closest_feature(instrument, detection, vertex, penetration);
    }
    penetration.layer_of[vertex] = not_colliding;
  }
}

}  // namespace tissue_sim
