#include "tissue_sim/contact/detection.h"

#include <algorithm>

#include "tissue_sim/geometry/edge_triangle.h"

namespace tissue_sim {

namespace {

/// m. Organ vertices are looked at this far from where they are, always the same way: a vertex that a response has put
/// exactly on a triangle, or grids that fall together, then lie on one side for every triangle. Far below any length
/// that matters.
const Vector3 tie_break(0.61e-9, 0.37e-9, 0.70e-9);

Side& side_of(Detection& d, int vertex) {
  if (d.side_stamp[vertex] != d.stamp) {
    d.side_stamp[vertex] = d.stamp;
    d.side[vertex] = Side::unknown;
  }
  return d.side[vertex];
}

void set_side(Detection& d, int vertex, Side side) {
  Side& current = side_of(d, vertex);
  current = current == Side::unknown || current == side ? side : Side::contradicted;
}

/// Every organ edge near the instrument, once, and their vertices.
void gather_candidates(const OrganSurface& organ, const InstrumentSurface& instrument, const Pose& pose, Detection& d) {
  d.candidate_edges.clear();
  d.candidates.clear();
  for_each_patch_near(organ, scene_bounds(instrument.bounds, pose), [&](int patch) {
    const FlatLists& edges = organ.patches.edges;
    for (const int* e = edges.begin(patch); e != edges.end(patch); ++e) {
      const int edge = *e;
      d.edge_stamp[edge] = d.stamp;
      d.crossed_edge_of[edge] = -1;
      d.candidate_edges.push_back(edge);
      for (const int vertex : organ.topology.edges[edge]) {
        if (d.local_stamp[vertex] == d.stamp) continue;
        local_position(d, organ, pose, vertex);
        d.candidates.push_back(vertex);
      }
    }
  });
}

/// Tests one organ edge against the instrument's tree and labels its ends by the first and the last crossing.
void cross_edge(const OrganSurface& organ, const InstrumentSurface& instrument, int edge, Detection& d) {
  const auto& [first, last] = organ.topology.edges[edge];
  const Vector3& p = d.local[first];
  const Vector3& q = d.local[last];
  Box box;
  box.add(p);
  box.add(q);
  if (!box.overlaps(instrument.bounds)) return;

  const int begin = static_cast<int>(d.crossings.size());
  instrument.tree.for_each_near(box, [&](int triangle) {
    const Triangle& corners = instrument.triangles[triangle];
    const EdgeTriangleHit hit = hit_edge_triangle(
        p, q, {&instrument.vertices[corners[0]], &instrument.vertices[corners[1]], &instrument.vertices[corners[2]]},
        corners);
    if (hit.direction != 0) d.crossings.push_back({edge, triangle, hit.t, hit.direction, p + hit.t * (q - p)});
  });
  const int count = static_cast<int>(d.crossings.size()) - begin;
  if (count == 0) return;

  std::sort(d.crossings.begin() + begin, d.crossings.end(),
            [](const Crossing& a, const Crossing& b) { return a.t < b.t || (a.t == b.t && a.triangle < b.triangle); });
  d.crossed_edges.push_back({edge, begin, count});

  bool alternating = true;
  for (int i = begin + 1; i < begin + count; ++i) {
    alternating = alternating && d.crossings[i].direction == -d.crossings[i - 1].direction;
  }
  set_side(d, first,
           !alternating                       ? Side::contradicted
           : d.crossings[begin].direction > 0 ? Side::inside
                                              : Side::outside);
  set_side(d, last,
           !alternating                                   ? Side::contradicted
           : d.crossings[begin + count - 1].direction < 0 ? Side::inside
                                                          : Side::outside);
}

Side decide_by_closest_feature(const InstrumentSurface& instrument, Detection& d, int vertex) {
  ++d.fallbacks;
  Side& side = side_of(d, vertex);
  side = instrument.bounds.contains(d.local[vertex]) && closest_feature(instrument, d.local[vertex]).depth > 0.0
             ? Side::inside
             : Side::outside;
  return side;
}

/// Spreads `inside` over edges that nothing crosses. False: it reached a vertex that the crossings put outside.
bool flood_from(const OrganSurface& organ, const Pose& pose, Detection& d) {
  while (!d.stack.empty()) {
    const int vertex = d.stack.back();
    d.stack.pop_back();
    d.colliding.push_back(vertex);
    const FlatLists& edges = organ.topology.vertex_edges;
    for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
      if (d.edge_stamp[*edge] == d.stamp && d.crossed_edge_of[*edge] >= 0) continue;
      const auto& [a, b] = organ.topology.edges[*edge];
      const int next = a == vertex ? b : a;
      Side& side = side_of(d, next);
      if (side == Side::outside) return false;
      if (side == Side::inside) continue;
      local_position(d, organ, pose, next);
      side = Side::inside;
      d.stack.push_back(next);
    }
  }
  return true;
}

void flood(const OrganSurface& organ, const InstrumentSurface& instrument, const Pose& pose, Detection& d) {
  d.stack = d.border;
  bool consistent = flood_from(organ, pose, d);
  // A surface that lies wholly inside has no crossing to start from.
  for (const int root : organ.component_roots) {
    if (!consistent || side_of(d, root) != Side::unknown || !instrument.closed) continue;
    if (!instrument.bounds.contains(local_position(d, organ, pose, root))) continue;
    if (decide_by_closest_feature(instrument, d, root) != Side::inside) {
      d.side[root] = Side::unknown;
      continue;
    }
    d.stack.push_back(root);
    consistent = flood_from(organ, pose, d);
  }
  if (consistent) return;

  d.colliding.clear();
  for (const int vertex : d.candidates) {
    if (decide_by_closest_feature(instrument, d, vertex) == Side::inside) d.colliding.push_back(vertex);
  }
}

void remember(const OrganSurface& organ, const Pose& pose, std::vector<char>& memory, Detection& d) {
  for (const int vertex : d.border) memory[vertex] = 1;
  for (const int vertex : d.border_outside) memory[vertex] = 0;
  for (std::size_t vertex = 0; vertex < memory.size(); ++vertex) {
    if (memory[vertex] == 0) continue;
    local_position(d, organ, pose, static_cast<int>(vertex));
    d.colliding.push_back(static_cast<int>(vertex));
  }
}

}  // namespace

void prepare(Detection& d, const OrganSurface& organ) {
  const std::size_t vertices = organ.positions.size();
  const std::size_t edges = organ.topology.edges.size();
  d.local.assign(vertices, Vector3::Zero());
  d.local_stamp.assign(vertices, 0);
  d.side_stamp.assign(vertices, 0);
  d.side.assign(vertices, Side::unknown);
  d.edge_stamp.assign(edges, 0);
  d.crossed_edge_of.assign(edges, -1);
}

const Vector3& local_position(Detection& d, const OrganSurface& organ, const Pose& pose, int vertex) {
  if (d.local_stamp[vertex] != d.stamp) {
    place_vertex(organ, vertex);
    d.local_stamp[vertex] = d.stamp;
    d.local[vertex] = pose.apply_inverse(organ.positions[vertex]) + tie_break;
  }
  return d.local[vertex];
}

void detect(const OrganSurface& organ, const InstrumentSurface& instrument, const Pose& pose, CollidingSet set,
            std::vector<char>& memory, Detection& d) {
  ++d.stamp;
  d.crossings.clear();
  d.crossed_edges.clear();
  d.border.clear();
  d.border_outside.clear();
  d.colliding.clear();

  gather_candidates(organ, instrument, pose, d);
  for (const int edge : d.candidate_edges) cross_edge(organ, instrument, edge, d);
  std::sort(d.crossed_edges.begin(), d.crossed_edges.end(),
            [](const CrossedEdge& a, const CrossedEdge& b) { return a.edge < b.edge; });
  for (std::size_t i = 0; i < d.crossed_edges.size(); ++i) {
    d.crossed_edge_of[d.crossed_edges[i].edge] = static_cast<int>(i);
  }
  for (const int vertex : d.candidates) {
    if (side_of(d, vertex) == Side::contradicted) decide_by_closest_feature(instrument, d, vertex);
  }
  for (const CrossedEdge& crossed : d.crossed_edges) {
    for (const int vertex : organ.topology.edges[crossed.edge]) {
      (d.side[vertex] == Side::inside ? d.border : d.border_outside).push_back(vertex);
    }
  }
  for (std::vector<int>* list : {&d.border, &d.border_outside}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }

  if (set == CollidingSet::paper) {
    remember(organ, pose, memory, d);
  } else {
    flood(organ, instrument, pose, d);
    std::sort(d.colliding.begin(), d.colliding.end());
  }
}

}  // namespace tissue_sim
