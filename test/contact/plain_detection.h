#pragma once

#include "tissue_sim/contact/detection.h"
#include "tissue_sim/geometry/edge_triangle.h"

namespace tissue_sim {

/// What stage 1 finds, by every edge of the organ and every triangle of the instrument.
struct PlainDetection {
  std::vector<Crossing> crossings;         ///< by edge, then in order along it
  std::vector<CrossedEdge> crossed_edges;  ///< ascending
  std::vector<int> border;
  std::vector<int> border_outside;
};

/// `local` are the organ's vertices in the tip frame. Sides where the crossings contradict each other are the closest
/// feature's.
inline PlainDetection detect_plainly(const std::vector<Vector3>& local, const MeshTopology& topology,
                                     const InstrumentSurface& instrument) {
  PlainDetection plain;
  std::vector<Side> sides(local.size(), Side::unknown);
  const auto set_side = [&](int vertex, Side side) {
    sides[vertex] = sides[vertex] == Side::unknown || sides[vertex] == side ? side : Side::contradicted;
  };
  for (int edge = 0; edge < static_cast<int>(topology.edges.size()); ++edge) {
    const auto& [first, last] = topology.edges[edge];
    const Vector3& p = local[first];
    const Vector3& q = local[last];
    std::vector<Crossing> found;
    for (int t = 0; t < static_cast<int>(instrument.triangles.size()); ++t) {
      const auto& [i, j, k] = instrument.triangles[t];
      const EdgeTriangleHit hit = hit_edge_triangle(
          p, q, {&instrument.vertices[i], &instrument.vertices[j], &instrument.vertices[k]}, instrument.triangles[t]);
      if (hit.direction != 0) found.push_back({edge, t, hit.t, hit.direction, p + hit.t * (q - p)});
    }
    if (found.empty()) continue;
    std::sort(found.begin(), found.end(), [](const Crossing& a, const Crossing& b) {
      return a.t < b.t || (a.t == b.t && a.triangle < b.triangle);
    });
    plain.crossed_edges.push_back({edge, static_cast<int>(plain.crossings.size()), static_cast<int>(found.size())});
    plain.crossings.insert(plain.crossings.end(), found.begin(), found.end());
    bool alternating = true;
    for (std::size_t i = 1; i < found.size(); ++i) {
      alternating = alternating && found[i].direction == -found[i - 1].direction;
    }
    const Side of_first = found.front().direction > 0 ? Side::inside : Side::outside;
    const Side of_last = found.back().direction < 0 ? Side::inside : Side::outside;
    set_side(first, alternating ? of_first : Side::contradicted);
    set_side(last, alternating ? of_last : Side::contradicted);
  }
  for (int vertex = 0; vertex < static_cast<int>(local.size()); ++vertex) {
    if (sides[vertex] == Side::unknown) continue;
    const bool inside = sides[vertex] == Side::contradicted ? instrument.bounds.contains(local[vertex]) &&
                                                                  closest_feature(instrument, local[vertex]).depth > 0.0
                                                            : sides[vertex] == Side::inside;
    (inside ? plain.border : plain.border_outside).push_back(vertex);
  }
  return plain;
}

}  // namespace tissue_sim
