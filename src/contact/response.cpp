#include "tissue_sim/contact/response.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// Points that share vertices disturb each other; this many rounds leave less than the contact margin.
constexpr int rounds_of_push = 100;

}  // namespace

double push_out(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                std::vector<Vector3>& positions, std::vector<char>* held) {
  double farthest = 0.0;
  for (int round = 0; round < rounds_of_push; ++round) {
    double farthest_of_round = 0.0;
    for (const ContactPoint& point : points) {
      const double behind = point.target - point.direction.dot(at_point(point, positions));
      const auto [unbounded, ease] = mobility(point.bearers, inverse_mass);
      if (!(behind > 0.0) || !(ease > 0.0)) continue;
      if (ease > unbounded && round > 0) continue;  // all rounds together would throw the vertex after all
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

/// Solves for the impulses or forces of the points, starting from those that they have.
void solve(std::vector<ContactPoint>& points, double ContactPoint::*given, ResponseRoom& room) {
  room.impulses.clear();
  for (const ContactPoint& point : points) room.impulses.push_back(point.*given);
  room.delassus.solve(room.lacking, room.impulses);
  for (std::size_t p = 0; p < points.size(); ++p) points[p].*given = room.impulses[p];
}

}  // namespace

void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        const std::vector<Vector3>& positions, double dt, std::vector<Vector3>& velocities,
                        ResponseRoom& room) {
  if (points.empty()) return;  // the matrix is that of points before
  room.lacking.clear();
  for (const ContactPoint& point : points) {
    const double ahead = std::max(0.0, point.direction.dot(at_point(point, positions)) - point.target);
    const double pace = point.direction.dot(point.instrument_velocity) - ahead / dt;
    room.lacking.push_back(pace - point.direction.dot(at_point(point, velocities)));
  }
  solve(points, &ContactPoint::impulse, room);
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      const int vertex = point.bearers.vertices[i];
      velocities[vertex] += point.bearers.weights[i] * inverse_mass[vertex] * (point.impulse * point.direction);
    }
  }
}

void bear_forces(const std::vector<double>& inverse_mass, const std::vector<Vector3>& forces,
                 std::vector<ContactPoint>& points, ResponseRoom& room) {
  if (points.empty()) return;
  room.lacking.clear();
  for (const ContactPoint& point : points) {
    double away = 0.0;
    for (int i = 0; i < point.bearers.count; ++i) {
      const int vertex = point.bearers.vertices[i];
      away += point.bearers.weights[i] * inverse_mass[vertex] * point.direction.dot(forces[vertex]);
    }
    room.lacking.push_back(-away);  // it is to stay where it is
  }
  solve(points, &ContactPoint::force, room);
}

}  // namespace tissue_sim
