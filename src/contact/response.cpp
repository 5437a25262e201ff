#include "tissue_sim/contact/response.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// Points that share vertices disturb each other; this many rounds leave less than the contact margin.
constexpr int rounds = 8;

/// sum w_i^2 / m_i: how easily the point moves. 0 where all its vertices are attached. Bounded from below so that no
/// vertex goes more than twice as far as the point is asked to: one free corner with a small weight beside two attached
/// ones would be thrown.
struct Mobility {
  double ease = 0.0;
  bool bounded = false;
};

Mobility mobility(const ContactPoint& point, const std::vector<double>& inverse_mass) {
  double sum = 0.0;
  double most = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double share = point.weights[i] * inverse_mass[point.vertices[i]];
    sum += point.weights[i] * share;
    most = std::max(most, share);
  }
  return {std::max(sum, 0.5 * most), sum < 0.5 * most};
}

}  // namespace

double push_out(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                std::vector<Vector3>& positions, std::vector<char>* held) {
  double farthest = 0.0;
  for (int round = 0; round < rounds; ++round) {
    double farthest_of_round = 0.0;
    for (const ContactPoint& point : points) {
      const double behind = point.target - point.direction.dot(at_point(point, positions));
      const auto [ease, bounded] = mobility(point, inverse_mass);
      if (!(behind > 0.0) || !(ease > 0.0)) continue;
      if (bounded && round > 0) continue;  // eight rounds would throw the vertex after all, 16 times as far
      for (int i = 0; i < 3; ++i) {
        const int vertex = point.vertices[i];
        const double way = behind * point.weights[i] * inverse_mass[vertex] / ease;
        if (!(way > 0.0)) continue;
        positions[vertex] += way * point.direction;
        if (held) (*held)[vertex] = 1;
        farthest_of_round = std::max(farthest_of_round, way);
      }
    }
    farthest += farthest_of_round;
    if (!(farthest_of_round > 0.01 * contact_margin)) break;
  }
  return farthest;
}

void stop_at_instrument(std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                        std::vector<Vector3>& velocities) {
  for (ContactPoint& point : points) point.impulse = 0.0;
  for (int round = 0; round < rounds; ++round) {
    for (ContactPoint& point : points) {
      const double ease = mobility(point, inverse_mass).ease;
      if (!(ease > 0.0)) continue;
      const double approach = point.direction.dot(point.instrument_velocity - at_point(point, velocities));
      const double impulse = std::max(0.0, point.impulse + approach / ease);
      const Vector3 change = (impulse - point.impulse) * point.direction;
      for (int i = 0; i < 3; ++i) {
        velocities[point.vertices[i]] += point.weights[i] * inverse_mass[point.vertices[i]] * change;
      }
      point.impulse = impulse;
    }
  }
}

}  // namespace tissue_sim
