#include "tissue_sim/contact/penetration.h"

#include <algorithm>

namespace tissue_sim {

namespace {

constexpr double shortest_distance = 1e-9;  ///< m, see inverse_square_weight

/// Unit normals that cancel to less than this fraction of their weight have no common direction left.
constexpr double cancelled = 1e-3;

}  // namespace

void prepare(Penetration& penetration, const OrganSurface& organ) {
  penetration.depth.assign(organ.positions.size(), 0.0);
  penetration.direction.assign(organ.positions.size(), Vector3::Zero());
  penetration.layer_of.assign(organ.positions.size(), -1);
}

double inverse_square_weight(const Vector3& a, const Vector3& b) {
  return 1.0 / std::max((a - b).squaredNorm(), shortest_distance * shortest_distance);
}

void penetrate_border(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& detection,
                      Penetration& penetration) {
  for (const int vertex : detection.border) {
    const Vector3& p = detection.local[vertex];
    double weight_sum = 0.0;
    double depth_sum = 0.0;
    Vector3 normal_sum = Vector3::Zero();
    const FlatLists& edges = organ.topology.vertex_edges;
    for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
      if (detection.edge_stamp[*edge] != detection.stamp) continue;
      const CrossedEdge& crossed = detection.crossed_edges[detection.crossed_edge_of[*edge]];
      const bool leaves_from_start = organ.topology.edges[*edge][0] == vertex;
      const Crossing& crossing =
          detection.crossings[leaves_from_start ? crossed.first : crossed.first + crossed.count - 1];
      const Vector3& normal = instrument.normals[crossing.triangle];
      const double weight = inverse_square_weight(crossing.point, p);
      weight_sum += weight;
      depth_sum += weight * (crossing.point - p).dot(normal);
      normal_sum += weight * normal;
    }

    if (normal_sum.norm() > cancelled * weight_sum) {
      penetration.depth[vertex] = std::max(0.0, depth_sum / weight_sum);
      penetration.direction[vertex] = normal_sum.normalized();
    } else {
      take_closest_feature(instrument, detection, vertex, penetration);
    }
  }
}

void take_closest_feature(const InstrumentSurface& instrument, Detection& detection, int vertex,
                          Penetration& penetration) {
  const ClosestFeature closest = closest_feature_of(instrument, detection, vertex);
  penetration.depth[vertex] = std::max(0.0, closest.depth);
  penetration.direction[vertex] = closest.direction;
}

void penetrate_exactly(const InstrumentSurface& instrument, Detection& detection, Penetration& penetration) {
  for (const int vertex : detection.colliding) {
    take_closest_feature(instrument, detection, vertex, penetration);
  }
}

}  // namespace tissue_sim
