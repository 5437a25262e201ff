#include "benchmark/plain_step.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/geometry/edge_triangle.h"

namespace tissue_sim {

namespace {

/// m. Which side a vertex is on that a response has put exactly on a triangle is a convention: the same as in the fast
/// detection.
const Vector3 tie_break(0.61e-9, 0.37e-9, 0.70e-9);

constexpr double shortest_distance = 1e-9;   ///< m, floor of the distances in Eq. 1 and 4
constexpr double cancelled = 1e-3;           ///< of the weight: less is left of the normals and they have no direction
constexpr double covered_stiffening = 1.5;   ///< of the stiffest element at rest, beyond which elements are softened
constexpr double farthest_from_rest = 10.0;  ///< of the organ's size: farther away is run away
constexpr double fastest = 1500.0;           ///< m/s

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int build_node(const std::vector<Box>& boxes, std::vector<int>& items, int first, int last, PlainTree& tree) {
  const int index = static_cast<int>(tree.nodes.size());
  tree.nodes.emplace_back();
  if (last - first == 1) {
    tree.nodes[index].item = items[first];
    return index;
  }
  Box all;
  for (int i = first; i < last; ++i) all.add(boxes[items[i]]);
  Eigen::Index axis = 0;
  all.size().maxCoeff(&axis);
  const int middle = first + (last - first) / 2;
  std::nth_element(items.begin() + first, items.begin() + middle, items.begin() + last, [&](int a, int b) {
    return boxes[a].lower[axis] + boxes[a].upper[axis] < boxes[b].lower[axis] + boxes[b].upper[axis];
  });
  const int left = build_node(boxes, items, first, middle, tree);
  const int right = build_node(boxes, items, middle, last, tree);
  tree.nodes[index].left = left;
  tree.nodes[index].right = right;
  return index;
}

std::vector<Box> boxes_of(const std::vector<Vector3>& vertices, const std::vector<Triangle>& triangles) {
  std::vector<Box> boxes;
  boxes.reserve(triangles.size());
  for (const Triangle& triangle : triangles) {
    Box box;
    for (const int vertex : triangle) box.add(vertices[vertex]);
    boxes.push_back(box);
  }
  return boxes;
}

double weight_between(const Vector3& a, const Vector3& b) {
  return 1.0 / std::max((a - b).squaredNorm(), shortest_distance * shortest_distance);
}

}  // namespace

void PlainTree::build(const std::vector<Box>& boxes) {
  nodes.clear();
  std::vector<int> items(boxes.size());
  std::iota(items.begin(), items.end(), 0);
  build_node(boxes, items, 0, static_cast<int>(items.size()), *this);
  refit(boxes);
}

void PlainTree::search(ClosestSearch& closest, int node) const {
  const Node& here = nodes[node];
  if (here.item >= 0) {
    closest.look_at(here.item);
    return;
  }
  std::array<std::pair<double, int>, 2> below;  // squared distance, node
  for (std::size_t i = 0; i < 2; ++i) {
    const int child = i == 0 ? here.left : here.right;
    below[i] = {nodes[child].box.squared_distance(closest.p), child};
  }
  if (below[1].first < below[0].first) std::swap(below[0], below[1]);
  for (const auto& [distance, child] : below) {
    if (!closest.too_far(distance)) search(closest, child);
  }
}

void PlainTree::refit(const std::vector<Box>& boxes) {
  for (std::size_t i = nodes.size(); i-- > 0;) {
    Node& node = nodes[i];
    if (node.item >= 0) {
      node.box = boxes[node.item];
    } else {
      node.box = nodes[node.left].box;
      node.box.add(nodes[node.right].box);
    }
  }
}

PlainSimulation::PlainSimulation(const Scene& scene)
    : rest_(build_rest_shape(scene.organs.front())),
      instrument_(build_instrument_surface(scene.instruments.front().parts.front().mesh,
                                           scene.instruments.front().parts.front().closed)),
      restoration_(scene.organs.front().restoration),
      drag_(scene.organs.front().material.drag),
      gravity_(scene.gravity) {
  const std::size_t vertices = rest_.positions.size();
  positions = rest_.positions;
  velocities.assign(vertices, Vector3::Zero());
  local_ = positions;
  organ_tree_.build(boxes_of(positions, rest_.triangles));
  instrument_tree_.build(boxes_of(instrument_.vertices, instrument_.triangles));
  crossings_of_.resize(rest_.topology.edges.size());
  depth_.assign(vertices, 0.0);
  direction_.assign(vertices, Vector3::Zero());
  held.assign(vertices, 0);
  forces_.assign(vertices, Vector3::Zero());
  gradient_.assign(vertices, Vector3::Zero());
}

void PlainSimulation::step(const Pose& before, const Pose& now, double dt) {
  profile = StepProfile();
  auto start = std::chrono::steady_clock::now();
  const auto lap = [&](double& stage) {
    stage = seconds_since(start);
    profile.total += stage;
    start = std::chrono::steady_clock::now();
  };
  carry_to_tip(now);
  refit_tree();
  lap(profile.refit);
  find_crossings();
  label_border();
  flood();
  lap(profile.detection);
  find_border_depths();
  lap(profile.penetration);
  propagate_depths();
  lap(profile.propagation);
  respond(before, now, dt);
  lap(profile.response);
  integrate(dt);
  bear();
  lap(profile.deformation);
  check_health();
  lap(profile.health);
}

void PlainSimulation::carry_to_tip(const Pose& now) {
  for (std::size_t v = 0; v < positions.size(); ++v) local_[v] = now.apply_inverse(positions[v]) + tie_break;
}

void PlainSimulation::refit_tree() {
  organ_tree_.refit(boxes_of(local_, rest_.triangles));
}

/// Stage 1: both trees are descended together; an edge belongs to the first of its triangles and is tested with it.
void PlainSimulation::find_crossings() {
  for (std::vector<PlainCrossing>& crossings : crossings_of_) crossings.clear();
  cross_triangles(0, 0);
  for (std::vector<PlainCrossing>& crossings : crossings_of_) {
    std::sort(crossings.begin(), crossings.end(), [](const PlainCrossing& a, const PlainCrossing& b) {
      return a.t < b.t || (a.t == b.t && a.triangle < b.triangle);
    });
  }
}

void PlainSimulation::cross_triangles(int organ_node, int instrument_node) {
  const PlainTree::Node& a = organ_tree_.nodes[organ_node];
  const PlainTree::Node& b = instrument_tree_.nodes[instrument_node];
  if (!a.box.overlaps(b.box)) return;
  if (a.item < 0 && (b.item >= 0 || a.box.size().sum() >= b.box.size().sum())) {
    cross_triangles(a.left, instrument_node);
    cross_triangles(a.right, instrument_node);
    return;
  }
  if (b.item < 0) {
    cross_triangles(organ_node, b.left);
    cross_triangles(organ_node, b.right);
    return;
  }
  const Triangle& corners = instrument_.triangles[b.item];
  for (const int edge : rest_.topology.triangle_edges[a.item]) {
    if (rest_.topology.edge_triangles[edge][0] != a.item) continue;
    const Vector3& p = local_[rest_.topology.edges[edge][0]];
    const Vector3& q = local_[rest_.topology.edges[edge][1]];
    const EdgeTriangleHit hit = hit_edge_triangle(
        p, q, {&instrument_.vertices[corners[0]], &instrument_.vertices[corners[1]], &instrument_.vertices[corners[2]]},
        corners);
    if (hit.direction != 0) crossings_of_[edge].push_back({b.item, hit.t, hit.direction, p + hit.t * (q - p)});
  }
}

/// An end of a crossed edge is inside if the nearest crossing leads out. Where crossings contradict each other the
/// closest feature decides.
void PlainSimulation::label_border() {
  side_.assign(positions.size(), 0);
  std::vector<char> contradicted(positions.size(), 0);
  const auto label = [&](int vertex, int side) {
    if (side_[vertex] == -side) contradicted[vertex] = 1;
    side_[vertex] = side;
  };
  for (std::size_t edge = 0; edge < crossings_of_.size(); ++edge) {
    const std::vector<PlainCrossing>& crossings = crossings_of_[edge];
    if (crossings.empty()) continue;
    const auto& [first, last] = rest_.topology.edges[edge];
    label(first, crossings.front().direction);
    label(last, -crossings.back().direction);
    for (std::size_t i = 1; i < crossings.size(); ++i) {
      if (crossings[i].direction == crossings[i - 1].direction) contradicted[first] = contradicted[last] = 1;
    }
  }
  border_.assign(positions.size(), 0);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (contradicted[v]) side_[v] = closest_to(static_cast<int>(v)).depth > 0.0 ? 1 : -1;
    border_[v] = side_[v] == 1 ? 1 : 0;
  }
}

/// From the colliding border inward over edges that nothing crosses. Where that reaches a vertex that is outside, the
/// closest feature decides about every vertex.
void PlainSimulation::flood() {
  std::vector<int> stack;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (side_[v] == 1) stack.push_back(static_cast<int>(v));
  }
  bool consistent = true;
  const auto spread = [&] {
    while (!stack.empty()) {
      const int vertex = stack.back();
      stack.pop_back();
      const FlatLists& edges = rest_.topology.vertex_edges;
      for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
        if (!crossings_of_[*edge].empty()) continue;
        const auto& [a, b] = rest_.topology.edges[*edge];
        const int next = a == vertex ? b : a;
        if (side_[next] == -1) consistent = false;
        if (side_[next] != 0) continue;
        side_[next] = 1;
        stack.push_back(next);
      }
    }
  };
  spread();
  for (const int root : rest_.component_roots) {  // a surface that lies wholly inside has no crossing
    if (side_[root] != 0 || !(closest_to(root).depth > 0.0)) continue;
    side_[root] = 1;
    stack.push_back(root);
    spread();
  }

  colliding.clear();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (!consistent) side_[v] = closest_to(static_cast<int>(v)).depth > 0.0 ? 1 : -1;
    if (side_[v] == 1) colliding.push_back(static_cast<int>(v));
  }
}

/// Stage 2, Eq. 1-3.
void PlainSimulation::find_border_depths() {
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (!border_[v]) continue;
    const int vertex = static_cast<int>(v);
    const Vector3& p = local_[v];
    double weight_sum = 0.0;
    double depth_sum = 0.0;
    Vector3 normal_sum = Vector3::Zero();
    const FlatLists& edges = rest_.topology.vertex_edges;
    for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
      const std::vector<PlainCrossing>& crossings = crossings_of_[*edge];
      if (crossings.empty()) continue;
      const PlainCrossing& x = rest_.topology.edges[*edge][0] == vertex ? crossings.front() : crossings.back();
      const Vector3& normal = instrument_.normals[x.triangle];
      const double weight = weight_between(x.point, p);
      weight_sum += weight;
      depth_sum += weight * (x.point - p).dot(normal);
      normal_sum += weight * normal;
    }
    if (normal_sum.norm() > cancelled * weight_sum) {
      depth_[v] = std::max(0.0, depth_sum / weight_sum);
      direction_[v] = normal_sum.normalized();
    } else {
      take_closest_feature(vertex);
    }
  }
}

/// Stage 3, Eq. 4-6, layer by layer inward.
void PlainSimulation::propagate_depths() {
  constexpr int far = 1 << 30;
  std::vector<int> layer_of(positions.size(), far);
  std::vector<int> layer;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (!border_[v]) continue;
    layer_of[v] = 0;
    layer.push_back(static_cast<int>(v));
  }
  const FlatLists& edges = rest_.topology.vertex_edges;
  const auto across = [&](int edge, int vertex) {
    const auto& [a, b] = rest_.topology.edges[edge];
    return a == vertex ? b : a;
  };
  for (int number = 1; !layer.empty(); ++number) {
    std::vector<int> next;
    for (const int vertex : layer) {
      for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
        const int neighbour = across(*edge, vertex);
        if (side_[neighbour] != 1 || layer_of[neighbour] != far) continue;
        layer_of[neighbour] = number;
        next.push_back(neighbour);
      }
    }
    for (const int vertex : next) {
      const Vector3& p = local_[vertex];
      double weight_sum = 0.0;
      double depth_sum = 0.0;
      Vector3 direction_sum = Vector3::Zero();
      for (const int* edge = edges.begin(vertex); edge != edges.end(vertex); ++edge) {
        const int j = across(*edge, vertex);
        if (layer_of[j] >= number) continue;
        const double weight = weight_between(local_[j], p);
        weight_sum += weight;
        depth_sum += weight * ((local_[j] - p).dot(direction_[j]) + depth_[j]);
        direction_sum += weight * direction_[j];
      }
      if (direction_sum.norm() > cancelled * weight_sum) {
        depth_[vertex] = std::max(0.0, depth_sum / weight_sum);
        direction_[vertex] = direction_sum.normalized();
      } else {
        take_closest_feature(vertex);
      }
    }
    layer = next;
  }
  for (const int vertex : colliding) {
    if (layer_of[vertex] == far) take_closest_feature(vertex);
  }
}

ClosestFeature PlainSimulation::closest_to(int vertex) const {
  constexpr double anywhere = std::numeric_limits<double>::infinity();
  ClosestSearch closest(instrument_.vertices, instrument_.triangles, local_[vertex], anywhere);
  instrument_tree_.search(closest);
  return feature_at(instrument_, local_[vertex], closest.best);
}

void PlainSimulation::take_closest_feature(int vertex) {
  const ClosestFeature closest = closest_to(vertex);
  depth_[vertex] = std::max(0.0, closest.depth);
  direction_[vertex] = closest.direction;
}

/// Colliding vertices go out by their depth. What was in contact in the step before and is within the margin stays in
/// contact.
void PlainSimulation::respond(const Pose& before, const Pose& now, double dt) {
  contacts.clear();
  const auto add = [&](int vertex, const Vector3& direction, const Vector3& place) {
    const Vector3& x = positions[vertex];
    const Vector3 velocity = (x - before.apply(now.apply_inverse(x))) / dt;
    contacts.push_back({vertex, direction, direction.dot(place), velocity, 0.0});
  };
  for (const int vertex : colliding) {
    const Vector3 direction = now.orientation * direction_[vertex];
    add(vertex, direction, positions[vertex] + depth_[vertex] * direction);
  }
  for (const int vertex : touching) {
    if (side_[vertex] == 1) continue;
    const ClosestFeature closest = closest_to(vertex);
    if (!(std::abs(closest.depth) < contact_margin)) continue;
    add(vertex, now.orientation * closest.direction, now.apply(closest.point));
  }
  touching.clear();
  for (const PlainContact& contact : contacts) {
    touching.push_back(contact.vertex);
    const double behind = contact.target - contact.direction.dot(positions[contact.vertex]);
    if (!(behind > 0.0) || rest_.attached[contact.vertex]) continue;
    positions[contact.vertex] += behind * contact.direction;
    if (!restoration_) held[contact.vertex] = 1;
  }
  std::sort(touching.begin(), touching.end());
}

/// Forces of Eq. 6-8, element by element, and a symplectic step; contacts keep ahead of the instrument.
void PlainSimulation::integrate(double dt) {
  if (!rest_.elastic()) return;
  const StiffnessLimit limit = {rest_.inverse_mass, covered_stiffening * rest_.stiffest_element};
  std::fill(forces_.begin(), forces_.end(), Vector3::Zero());
  for (const DistanceElement& element : rest_.distances) add_forces(element, limit, positions, velocities, forces_);
  for (const AreaElement& element : rest_.areas) add_forces(element, limit, positions, velocities, forces_);
  for (const VolumeElement& element : rest_.volumes) add_forces(element, limit, positions, velocities, forces_);
  if (rest_.enclosed.stiffness > 0.0) {
    const double c = rest_.enclosed.evaluate(positions, rest_.triangles, gradient_);
    double rate = 0.0;
    for (std::size_t v = 0; v < positions.size(); ++v) rate += gradient_[v].dot(velocities[v]);
    const double pull = rest_.enclosed.stiffness * c + rest_.enclosed.damping * rate;
    for (std::size_t v = 0; v < positions.size(); ++v) forces_[v] -= pull * gradient_[v];
  }

  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (rest_.attached[v]) continue;
    const Vector3 acceleration = rest_.inverse_mass[v] * forces_[v] + gravity_;
    velocities[v] = held[v] ? Vector3::Zero() : Vector3((velocities[v] + dt * acceleration) / (1.0 + dt * drag_));
  }
  for (const PlainContact& contact : contacts) {
    if (rest_.attached[contact.vertex]) continue;
    const double ahead = std::max(0.0, contact.direction.dot(positions[contact.vertex]) - contact.target);
    const double least = contact.direction.dot(contact.instrument_velocity) - ahead / dt;
    const double missing = least - contact.direction.dot(velocities[contact.vertex]);
    if (missing > 0.0) velocities[contact.vertex] += missing * contact.direction;
  }
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (!rest_.attached[v] && !held[v]) positions[v] += dt * velocities[v];
  }
}

/// The force on the instrument is what holds the tissue's own forces at the vertices in contact.
void PlainSimulation::bear() {
  if (!rest_.elastic()) return;
  for (PlainContact& contact : contacts) {
    contact.force =
        rest_.attached[contact.vertex] ? 0.0 : std::max(0.0, -contact.direction.dot(forces_[contact.vertex]));
  }
}

void PlainSimulation::check_health() {
  healthy = true;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const bool here = (positions[v] - rest_.positions[v]).norm() < farthest_from_rest * rest_.size;
    healthy = healthy && here && velocities[v].norm() < fastest;
  }
  if (healthy) {
    good_positions_ = positions;
    good_velocities_ = velocities;
  } else {
    positions = good_positions_;
    velocities.assign(positions.size(), Vector3::Zero());
  }
}

}  // namespace tissue_sim
