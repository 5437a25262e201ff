#include "tissue_sim/contact/response.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// Points that share vertices disturb each other; this many rounds leave less than the contact margin.
constexpr int rounds_of_push = 100;

/// Velocities and forces start from those of the substep before, so that what a few rounds leave, the next ones take:
/// with 200 rounds in every substep a force differs by 0.03 %. Without that start, and with 8 rounds, ten pokes of a
/// ball into a block went on approaching it at 5 mm/s for ever, and were pushed out as far again.
constexpr int rounds_of_stop = 16;
constexpr double stop_tolerance = 1e-5;

/// sum w_i^2 / m_i: how easily the point moves. 0 where all its vertices are attached. Beside attached ones bounded
/// from below, so that no vertex goes more than twice as far as the point is asked to: one free corner with a small
/// weight would be thrown. Where all are free there is nothing to bound, and twelve that share a point would be held
/// back.
struct Mobility {
  double ease = 0.0;
  bool bounded = false;
};

Mobility mobility(const ContactPoint& point, const std::vector<double>& inverse_mass) {
  if (point.bearers.count == 1) {  // most points are vertices
    const double weight = point.bearers.weights[0];
    return {weight * (weight * inverse_mass[point.bearers.vertices[0]]), false};
  }
  double sum = 0.0;
  double most = 0.0;
  bool attached = false;
  for (int i = 0; i < point.bearers.count; ++i) {
    const double free = inverse_mass[point.bearers.vertices[i]];
    const double share = point.bearers.weights[i] * free;
    sum += point.bearers.weights[i] * share;
    most = std::max(most, share);
    attached = attached || free == 0.0;
  }
  const bool bounded = attached && sum < 0.5 * most;
  return {bounded ? 0.5 * most : sum, bounded};
}

}  // namespace

double push_out(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                std::vector<Vector3>& positions, std::vector<char>* held) {
  double farthest = 0.0;
  for (int round = 0; round < rounds_of_push; ++round) {
    double farthest_of_round = 0.0;
    for (const ContactPoint& point : points) {
      const double behind = point.target - point.direction.dot(at_point(point, positions));
      const auto [ease, bounded] = mobility(point, inverse_mass);
      if (!(behind > 0.0) || !(ease > 0.0)) continue;
      if (bounded && round > 0) continue;  // all rounds together would throw the vertex after all
      for (int i = 0; i < point.bearers.count; ++i) {
        const int vertex = point.bearers.vertices[i];
        const double way = behind * point.bearers.weights[i] * inverse_mass[vertex] / ease;
        if (way == 0.0) continue;
        positions[vertex] += way * point.direction;
        if (held) (*held)[vertex] = 1;
        farthest_of_round = std::max(farthest_of_round, std::abs(way));
      }
    }
    farthest += farthest_of_round;
    if (!(farthest_of_round > 0.01 * contact_margin)) break;
  }
  return farthest;
}

namespace {

/// Gives the points non-negative impulses (in `given`, which holds a guess) so that each gets its `pace` along its
/// direction at least: Gauss-Seidel over the points in order until next to nothing changes.
void stop(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass, double ContactPoint::*given,
          std::vector<Vector3>& velocities) {
  const auto push = [&](const ContactPoint& point, double impulse) {
    for (int i = 0; i < point.bearers.count; ++i) {
      const int vertex = point.bearers.vertices[i];
      velocities[vertex] += point.bearers.weights[i] * inverse_mass[vertex] * (impulse * point.direction);
    }
  };
  for (ContactPoint& point : points) {
    point.ease = mobility(point, inverse_mass).ease;
    if (!(point.ease > 0.0)) point.*given = 0.0;
    push(point, point.*given);
  }
  for (int round = 0; round < rounds_of_stop; ++round) {
    double largest_change = 0.0;
    double largest = 0.0;
    for (ContactPoint& point : points) {
      if (!(point.ease > 0.0)) continue;
      const double approach = point.direction.dot(point.pace - at_point(point, velocities));
      const double impulse = std::max(0.0, point.*given + approach / point.ease);
      const double change = impulse - point.*given;
      push(point, change);
      point.*given = impulse;
      largest_change = std::max(largest_change, std::abs(change));
      largest = std::max(largest, impulse);
    }
    if (!(largest_change > stop_tolerance * largest)) break;
  }
}

}  // namespace

void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        const std::vector<Vector3>& positions, double dt, std::vector<Vector3>& velocities) {
  for (ContactPoint& point : points) {
    const double ahead = std::max(0.0, point.direction.dot(at_point(point, positions)) - point.target);
    point.pace = point.instrument_velocity - ahead / dt * point.direction;
  }
  stop(points, inverse_mass, &ContactPoint::impulse, velocities);
}

void bear_forces(const std::vector<double>& inverse_mass, const std::vector<Vector3>& forces,
                 std::vector<Vector3>& accelerations, std::vector<ContactPoint>& points) {
  for (ContactPoint& point : points) {
    point.pace.setZero();  // it stays where it is
    for (int i = 0; i < point.bearers.count; ++i) {
      const int vertex = point.bearers.vertices[i];
      accelerations[vertex] = inverse_mass[vertex] * forces[vertex];
    }
  }
  stop(points, inverse_mass, &ContactPoint::force, accelerations);
}

}  // namespace tissue_sim
