#include "tissue_sim/contact/contact_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tissue_sim {

namespace {

/// Of the triangle's longest side: how far a poke pushes a triangle in one pass. After an instrument has appeared
/// inside an organ the nearest surface is far, and pulled over at once it folds.
constexpr double longest_push = 0.5;

/// Of the same: the motion after which a vertex that was no poke is looked at again.
constexpr double recheck = 0.05;

/// m; how far around an instrument the organ's patches are gathered: most of what is looked at touches.
constexpr double near_reach = 0.5e-3;

/// m; how far inside the instrument an edge is left.
constexpr double edge_slop = 0.5 * contact_margin;

/// m; a poke stays the one of its corner until another is deeper by this much. Where the organ rests on the instrument
/// rounding decides which is deepest, and every change is felt (three times as fast a jitter without).
constexpr double hold = 0.25 * contact_margin;

double longest_side(const OrganSurface& organ, int triangle) {
  const auto& [a, b, c] = organ.triangles[triangle];
  const Vector3& p = organ.positions[a];
  const Vector3& q = organ.positions[b];
  const Vector3& r = organ.positions[c];
  return std::sqrt(std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()}));
}

/// A point of the organ pushed along `direction` (scene frame) until it reaches `place` (scene frame).
ContactPoint contact_at(const OrganSurface& organ, int piece, int triangle, const Vector3& weights,
                        const Vector3& place, const Vector3& direction) {
  ContactPoint point;
  point.piece = piece;
  point.triangle = triangle;
  point.weights = weights;
  for (int i = 0; i < 3; ++i) point.bearers.add(organ.triangles[triangle][i], weights[i]);
  point.direction = direction;
  point.target = direction.dot(place);
  return point;
}

ContactPoint vertex_contact(const OrganSurface& organ, int piece, int vertex, const Vector3& place,
                            const Vector3& direction) {
  const int triangle = *organ.topology.vertex_triangles.begin(vertex);
  Vector3 weights = Vector3::Zero();
  for (int i = 0; i < 3; ++i) weights[i] = organ.triangles[triangle][i] == vertex ? 1.0 : 0.0;
  return contact_at(organ, piece, triangle, weights, place, direction);
}

/// Pokes nearest to one corner of a triangle that count. With only the deepest, a triangle that rests on two vertices
/// near one corner fell from one to the other.
constexpr int most_pokes = 3;

int nearest_corner(const ContactPoint& point) {
  int corner = 0;
  point.weights.maxCoeff(&corner);
  return corner;
}

/// Among the points from `first` on, which are all pokes: takes the place of the shallowest of those nearest to the
/// same corner of the same triangle, if there are enough and it is deeper.
void keep_deepest(const OrganSurface& organ, const ContactPoint& poke, bool poked_before, std::size_t first,
                  Clearance& clearance, std::vector<ContactPoint>& points) {
  const auto depth = [&](const ContactPoint& point, bool held) {
    return point.target - point.direction.dot(at_point(point, organ.positions)) + (held ? hold : 0.0);
  };
  const int corner = nearest_corner(poke);
  int there = 0;
  std::size_t shallowest = points.size();
  double least = 0.0;
  for (std::size_t i = first; i < points.size(); ++i) {
    if (points[i].triangle != poke.triangle || nearest_corner(points[i]) != corner) continue;
    const double deep = depth(points[i], clearance.pokes[points[i].poking] == 2);
    if (there++ == 0 || deep < least) {
      shallowest = i;
      least = deep;
    }
  }
  if (there < most_pokes) {
    points.push_back(poke);
  } else {
    if (!(depth(poke, poked_before) > least)) return;
    clearance.pokes[points[shallowest].poking] = 0;
    points[shallowest] = poke;
  }
  clearance.pokes[poke.poking] = poked_before ? 2 : 1;
}

}  // namespace

void Bearers::add(int vertex, double weight) {
  if (weight == 0.0) return;
  for (int i = 0; i < count; ++i) {
    if (vertices[i] != vertex) continue;
    weights[i] += weight;
    return;
  }
  vertices[count] = vertex;
  weights[count] = weight;
  ++count;
}

Mobility mobility(const Bearers& bearers, const std::vector<double>& inverse_mass) {
  if (bearers.count == 1) {  // most places are vertices
    const double weight = bearers.weights[0];
    const double ease = weight * (weight * inverse_mass[bearers.vertices[0]]);
    return {ease, ease};
  }
  double sum = 0.0;
  double most = 0.0;
  bool attached = false;
  for (int i = 0; i < bearers.count; ++i) {
    const double free = inverse_mass[bearers.vertices[i]];
    const double share = bearers.weights[i] * free;
    sum += bearers.weights[i] * share;
    most = std::max(most, share);
    attached = attached || free == 0.0;
  }
  return {sum, attached ? std::max(sum, 0.5 * most) : sum};
}

void bear_by(const Embedding& embedding, const std::vector<Triangle>& triangles, const std::vector<Vector3>& positions,
             std::vector<ContactPoint>& points) {
  for (ContactPoint& point : points) {
    Vector3 place = Vector3::Zero();
    point.bearers.count = 0;
    for (int corner = 0; corner < 3; ++corner) {
      const int vertex = triangles[point.triangle][corner];
      if (point.weights[corner] == 0.0) continue;
      place += point.weights[corner] * positions[vertex];
      for (int i = 0; i < 4; ++i) {
        point.bearers.add(embedding.corners[vertex][i], point.weights[corner] * embedding.weights[vertex][i]);
      }
    }
    if (embedding.offsets.empty()) continue;
    point.lift = point.direction.dot(place - at_point(point, positions));
    point.target -= point.lift;
  }
}

void add_vertex_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                         const Penetration& penetration, Detection& detection, std::vector<int>& touching,
                         std::vector<ContactPoint>& points) {
  for (const int vertex : detection.colliding) {
    const Vector3 direction = pose.orientation * penetration.direction[vertex];
    const Vector3 place = organ.positions[vertex] + penetration.depth[vertex] * direction;
    points.push_back(vertex_contact(organ, piece, vertex, place, direction));
  }

  // What the last response put on the surface need not be inside yet, and presses all the same.
  detection.stack.clear();
  auto colliding = detection.colliding.begin();
  for (const int vertex : touching) {
    while (colliding != detection.colliding.end() && *colliding < vertex) ++colliding;
    if (colliding != detection.colliding.end() && *colliding == vertex) continue;
    local_position(detection, organ, pose, vertex);
    const ClosestFeature closest = closest_feature_of(instrument, detection, vertex, 2.0 * contact_margin);
    if (!(std::abs(closest.depth) < contact_margin)) continue;
    points.push_back(
        vertex_contact(organ, piece, vertex, pose.apply(closest.point), pose.orientation * closest.direction));
    detection.stack.push_back(vertex);
  }
  touching.resize(detection.colliding.size() + detection.stack.size());
  std::merge(detection.colliding.begin(), detection.colliding.end(), detection.stack.begin(), detection.stack.end(),
             touching.begin());
}

void add_edge_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                       const Detection& detection, std::vector<ContactPoint>& points) {
  for (const CrossedEdge& crossed : detection.crossed_edges) {
    const int first = organ.topology.edges[crossed.edge][0];  // a lambda takes no structured binding in C++17
    const int last = organ.topology.edges[crossed.edge][1];
    const auto add_inside = [&](double t, const Vector3& place) {
      const ClosestFeature closest = closest_feature(instrument, place);
      if (!(closest.depth > 0.0)) return;
      const int triangle = organ.topology.edge_triangles[crossed.edge][0];
      Vector3 weights = Vector3::Zero();
      for (int corner = 0; corner < 3; ++corner) {
        if (organ.triangles[triangle][corner] == first) weights[corner] = 1.0 - t;
        if (organ.triangles[triangle][corner] == last) weights[corner] = t;
      }
      const Vector3 left_at = closest.point - edge_slop * closest.direction;
      points.push_back(
          contact_at(organ, piece, triangle, weights, pose.apply(left_at), pose.orientation * closest.direction));
    };

    const Vector3& p = detection.local[first];
    const Vector3& q = detection.local[last];
    const bool first_inside = detection.side[first] == Side::inside;
    const bool last_inside = detection.side[last] == Side::inside;
    if (first_inside != last_inside) {
      const double t = first_inside ? 0.5 * detection.crossings[crossed.first].t
                                    : 0.5 * (1.0 + detection.crossings[crossed.first + crossed.count - 1].t);
      const ClosestFeature pushed = closest_feature(instrument, first_inside ? p : q);
      add_inside(t,
                 first_inside ? Vector3(pushed.point + t * (q - pushed.point)) : Vector3(p + t * (pushed.point - p)));
    } else if (!first_inside) {
      for (int i = crossed.first; i + 1 < crossed.first + crossed.count; i += 2) {
        const double t = 0.5 * (detection.crossings[i].t + detection.crossings[i + 1].t);
        add_inside(t, p + t * (q - p));
      }
    }
  }
}

void add_poke_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                       const std::vector<int>& vertices, Clearance& clearance, std::vector<ContactPoint>& points) {
  const std::size_t first = points.size();
  gather_near(organ, TurnedBox(instrument.bounds.grown(near_reach), pose));
  // Of an organ that was left inside out all the world is below the surface, metres away too.
  const Box bounds = bounds_of(organ.patches);
  for (const int u : vertices) {
    const bool poked_before = clearance.pokes[u] != 0;
    clearance.pokes[u] = 0;
    const double travelled = clearance.shift + clearance.turn * instrument.vertices[u].norm();
    if (!(travelled >= clearance.free_until[u])) continue;  // a NaN stays for the health check

    const Vector3 tip = pose.apply(instrument.vertices[u]);
    const ClosestOnMesh closest =
        closest_on_organ(organ, tip, std::numeric_limits<double>::infinity(), clearance.nearest[u]);
    if (closest.triangle < 0) continue;  // a position that is not a number is near nothing
    const double distance = std::sqrt(closest.squared_distance);
    clearance.nearest[u] = closest.triangle;
    clearance.free_until[u] = travelled + distance - poke_reach;
    if (closest.on.feature != Feature::face) place_around(organ, closest.triangle);
    const Vector3 outward =
        pseudonormal(organ.positions, organ.triangles, organ.topology, closest.triangle, closest.on.feature);
    const Vector3 above = tip - closest.on.point;
    const bool below_surface = bounds.contains(tip) && !(above.dot(outward) > 0.0);
    if (!below_surface) clearance.first_touch[u] = travelled + distance;
    if (!below_surface && !(distance < poke_reach)) continue;

    const Vector3 direction = distance < 1e-9 ? Vector3(-unit_or_zero(outward))
                              : below_surface ? Vector3(above / distance)
                                              : Vector3(-above / distance);
    const double side = longest_side(organ, closest.triangle);
    const bool with_normal = direction.dot(pose.orientation * instrument.vertex_normals[u]) > 0.0;
    const bool within_reach = !below_surface || distance < travelled - clearance.first_touch[u] + contact_margin;
    if (!with_normal || !within_reach) {
      clearance.free_until[u] = travelled + recheck * side;
      continue;
    }
    if (below_surface) clearance.first_touch[u] = -1e300;
    clearance.free_until[u] = travelled;
    const double way = std::min(below_surface ? distance : -distance, longest_push * side);
    ContactPoint poke = contact_at(organ, piece, closest.triangle, closest.on.barycentric,
                                   closest.on.point + (way + contact_margin) * direction, direction);
    poke.poking = u;
    keep_deepest(organ, poke, poked_before, first, clearance, points);
  }
}

}  // namespace tissue_sim
