#include "tissue_sim/contact/detection.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

/// m; more than the tie break and rounding move a vertex by.
constexpr double clear_margin = 1e-8;

/// Of a patch's radius: how far it moves at least before its distance from the instrument is asked for again.
constexpr double ask_again = 0.1;

/// Of the same: how much farther the instrument is where its distance need not be exact.
constexpr double clearly = 1.3;

/// Whether the instrument's surface is nowhere in the ball that holds a patch. The distance of its middle from the
/// instrument grows and shrinks by no more than the middle's way in the tip frame, so it is computed only when that way
/// could have changed the answer.
bool is_clear(const InstrumentSurface& instrument, const Vector3& middle, double radius, FreeBall& ball) {
  const double way = (middle - ball.centre).norm();
  if (ball.radius - way > radius) return true;
  const double to_change = std::max(std::abs(ball.radius - radius), ask_again * radius);
  if (ball.radius >= 0.0 && !(way > to_change)) return false;
  const ClosestOnMesh closest = free_around(instrument.vertices, instrument.triangles, instrument.tree, middle, radius,
                                            clearly * radius, ball.triangle);
  if (closest.triangle < 0) return false;
  ball = {middle, std::sqrt(closest.squared_distance), closest.triangle};
  return ball.radius > radius;
}

/// Pairs of organ edges and instrument triangles that may cross.
void gather_pairs(const OrganSurface& organ, const InstrumentSurface& instrument, const Pose& pose, Detection& d) {
  d.pairs.clear();
  const FlatLists& vertices = organ.patches.edge_vertices;
  const FlatLists& edges = organ.patches.edges;
  const Eigen::Quaterniond back = pose.orientation.conjugate();
  for_each_patch_near(organ, TurnedBox(instrument.bounds, pose), [&](int patch) {
    const Box& box = organ.patches.nodes[organ.patches.leaf_of[patch]].box;
    const Vector3 middle = back * (0.5 * (box.lower + box.upper) - pose.position);
    if (is_clear(instrument, middle, 0.5 * box.size().norm() + clear_margin, d.free_balls[patch])) return;
    const auto points = static_cast<std::size_t>(vertices.end(patch) - vertices.begin(patch));
    FloatPoint* rounded = d.rounded.data();
    for (const int* v = vertices.begin(patch); v != vertices.end(patch); ++v, ++rounded) {
      if (d.local_stamp[*v] != d.stamp) {
        d.local_stamp[*v] = d.stamp;
        d.local[*v] = back * (organ.positions[*v] - pose.position) + tie_break;  // as local_position()
      }
      // One by one: a whole point, pushed back, would wait for its parts.
      for (std::size_t axis = 0; axis < 3; ++axis) {
        (*rounded)[axis] = static_cast<float>(d.local[*v][static_cast<Eigen::Index>(axis)]);
      }
    }
    const auto count = static_cast<std::size_t>(edges.end(patch) - edges.begin(patch));
    const Edge* ends = organ.patches.ends.data() + edges.first[patch];
    find_crossing_pairs(instrument.tree, {d.rounded.data(), points, ends, edges.begin(patch), count}, d.tree_room,
                        d.pairs);
  });
}

/// Of the pairs, in their order, those whose edge goes through the plane. Returns how many.
std::size_t hit_planes(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& d) {
  constexpr std::size_t ahead = 12;
  if (d.hits.size() < d.pairs.size()) d.hits.resize(d.pairs.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < d.pairs.size(); ++i) {
    const EdgeTrianglePair& pair = d.pairs[i];
    // Planes lie where no one can guess, and too many for the nearest cache.
    if (i + ahead < d.pairs.size()) __builtin_prefetch(&instrument.planes[d.pairs[i + ahead].triangle]);
    const auto& [first, last] = organ.topology.edges[pair.edge];
    const TrianglePlane& plane = instrument.planes[pair.triangle];
    const EdgeTriangleHit hit = hit_plane(d.local[first], d.local[last], plane.corner, plane.normal);
    d.hits[kept] = {pair.edge, pair.triangle, hit.t, hit.direction, pair.within_rims};
    kept += hit.direction != 0 ? 1 : 0;
  }
  return kept;
}

bool within_rims(const Vector3& p, const Vector3& q, const InstrumentSurface& instrument, const PlaneHit& hit) {
  if (hit.within_rims) return true;
  const Triangle& corners = instrument.triangles[hit.triangle];
  return passes_within_rims(
      p, q, {&instrument.vertices[corners[0]], &instrument.vertices[corners[1]], &instrument.vertices[corners[2]]},
      corners);
}

/// Takes the crossings of one edge, of hits first .. last - 1, and labels its ends by the first and the last of them.
void cross_edge(const OrganSurface& organ, const InstrumentSurface& instrument, std::size_t first_hit,
                std::size_t last_hit, Detection& d) {
  const int edge = d.hits[first_hit].edge;
  const auto& [first, last] = organ.topology.edges[edge];
  const Vector3& p = d.local[first];
  const Vector3& q = d.local[last];

  const std::size_t begin = d.crossings.size();
  for (std::size_t i = first_hit; i < last_hit; ++i) {
    const PlaneHit& hit = d.hits[i];
    if (!within_rims(p, q, instrument, hit)) continue;
    d.crossings.push_back({edge, hit.triangle, hit.t, hit.direction, p + hit.t * (q - p)});
    // Mostly there are one or two: they are put in order as they come.
    for (std::size_t c = d.crossings.size() - 1; c > begin; --c) {
      Crossing& before = d.crossings[c - 1];
      Crossing& after = d.crossings[c];
      if (before.t < after.t || (before.t == after.t && before.triangle < after.triangle)) break;
      std::swap(before, after);
    }
  }
  const int count = static_cast<int>(d.crossings.size() - begin);
  if (count == 0) return;
  d.edge_stamp[edge] = d.stamp;
  d.crossed_edge_of[edge] = static_cast<int>(d.unordered.size());
  d.unordered.push_back({edge, static_cast<int>(begin), count});
  d.edge_set.add(edge);

  bool alternating = true;
  for (std::size_t i = begin + 1; i < d.crossings.size(); ++i) {
    alternating = alternating && d.crossings[i].direction == -d.crossings[i - 1].direction;
  }
  set_side(d, first,
           !alternating                       ? Side::contradicted
           : d.crossings[begin].direction > 0 ? Side::inside
                                              : Side::outside);
  set_side(d, last,
           !alternating                       ? Side::contradicted
           : d.crossings.back().direction < 0 ? Side::inside
                                              : Side::outside);
}

void cross_edges(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& d) {
  d.crossings.clear();
  d.unordered.clear();
  const std::size_t hits = hit_planes(organ, instrument, d);
  for (std::size_t first = 0, last = 0; first < hits; first = last) {
    while (last < hits && d.hits[last].edge == d.hits[first].edge) ++last;
    cross_edge(organ, instrument, first, last, d);
  }
  d.stack.clear();
  d.edge_set.drain_to(d.stack);
  d.crossed_edges.clear();
  for (const int edge : d.stack) {
    d.crossed_edges.push_back(d.unordered[d.crossed_edge_of[edge]]);
    d.crossed_edge_of[edge] = static_cast<int>(d.crossed_edges.size()) - 1;
  }
}

Side decide_by_closest_feature(const InstrumentSurface& instrument, Detection& d, int vertex) {
  ++d.fallbacks;
  Side& side = side_of(d, vertex);
  side = instrument.bounds.contains(d.local[vertex]) && closest_feature_of(instrument, d, vertex).depth > 0.0
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
      if (d.edge_stamp[*edge] == d.stamp) continue;
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
  d.stack.clear();
  for_each_patch_near(organ, TurnedBox(instrument.bounds, pose), [&](int patch) {
    const FlatLists& vertices = organ.patches.vertices;
    for (const int* v = vertices.begin(patch); v != vertices.end(patch); ++v) d.vertex_set.add(*v);
  });
  d.vertex_set.drain_to(d.stack);
  for (const int vertex : d.stack) {
    local_position(d, organ, pose, vertex);
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
  d.nearest.assign(vertices, -1);
  d.free_balls.assign(organ.patches.leaf_of.size(), FreeBall());
  std::size_t most_points = 0;
  for (std::size_t patch = 0; patch < organ.patches.leaf_of.size(); ++patch) {
    const auto list = static_cast<int>(patch);
    const auto points = organ.patches.edge_vertices.end(list) - organ.patches.edge_vertices.begin(list);
    most_points = std::max(most_points, static_cast<std::size_t>(points));
  }
  d.rounded.resize(most_points);
  d.edge_set.prepare(edges);
  d.vertex_set.prepare(vertices);
  d.outside_set.prepare(vertices);
}

ClosestFeature closest_feature_of(const InstrumentSurface& instrument, Detection& d, int vertex, double reach) {
  const ClosestFeature closest = closest_feature(instrument, d.local[vertex], reach, d.nearest[vertex]);
  if (closest.triangle >= 0) d.nearest[vertex] = closest.triangle;
  return closest;
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
  d.border.clear();
  d.border_outside.clear();
  d.colliding.clear();

  gather_pairs(organ, instrument, pose, d);
  cross_edges(organ, instrument, d);
  for (const CrossedEdge& crossed : d.crossed_edges) {
    for (const int vertex : organ.topology.edges[crossed.edge]) {
      if (d.side[vertex] == Side::contradicted) decide_by_closest_feature(instrument, d, vertex);
      (d.side[vertex] == Side::inside ? d.vertex_set : d.outside_set).add(vertex);
    }
  }
  d.vertex_set.drain_to(d.border);
  d.outside_set.drain_to(d.border_outside);

  if (set == CollidingSet::paper) {
    remember(organ, pose, memory, d);
    return;
  }
  flood(organ, instrument, pose, d);
  for (const int vertex : d.colliding) d.vertex_set.add(vertex);
  d.colliding.clear();
  d.vertex_set.drain_to(d.colliding);
}

}  // namespace tissue_sim
