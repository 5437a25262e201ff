#include "tissue_sim/contact/delassus_matrix.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tissue_sim {

namespace {

/// Impulses and forces start from those of the substep before, so that what a few rounds leave, the next ones take:
/// with 200 rounds in every substep a force differs by 0.03 %. Without that start, and with 8 rounds, ten pokes of a
/// ball into a block went on approaching it at 5 mm/s for ever, and were pushed out as far again.
constexpr int most_rounds = 16;
constexpr double tolerance = 1e-5;  ///< of the largest impulse

/// Points that share vertices with one point, in the mean: usually there are no more.
constexpr std::size_t usual_sharing = 64;

}  // namespace

void DelassusMatrix::reserve(std::size_t points, std::size_t vertices) {
  for (std::vector<double>* of_points : {&effective_mass_, &kept_, &shared_}) of_points->reserve(points);
  for (std::vector<int>* of_points : {&sharing_with_, &sharing_}) of_points->reserve(points);
  first_.reserve(points + 1);
  entries_.reserve(usual_sharing * points);
  bearings_.reserve(Bearers::most * points);
  first_of_vertex_.assign(vertices, -1);
}

void DelassusMatrix::build(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass) {
  effective_mass_.clear();
  kept_.clear();
  entries_.clear();
  first_.assign(1, 0);
  shared_.resize(points.size());
  sharing_with_.assign(points.size(), -1);
  list_bearings(points, inverse_mass.size());
  for (int row = 0; row < static_cast<int>(points.size()); ++row) add_row(points, inverse_mass, row);
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) first_of_vertex_[point.bearers.vertices[i]] = -1;
  }
}

void DelassusMatrix::list_bearings(const std::vector<ContactPoint>& points, std::size_t vertices) {
  bearings_.clear();
  first_of_vertex_.resize(vertices, -1);
  for (int p = static_cast<int>(points.size()); p-- > 0;) {  // so that the lists ascend
    const Bearers& bearers = points[p].bearers;
    for (int i = 0; i < bearers.count; ++i) {
      int& first = first_of_vertex_[bearers.vertices[i]];
      bearings_.push_back({p, first, bearers.weights[i]});
      first = static_cast<int>(bearings_.size()) - 1;
    }
  }
}

void DelassusMatrix::add_row(const std::vector<ContactPoint>& points, const std::vector<double>& inverse_mass,
                             int row) {
  const ContactPoint& point = points[row];
  const Mobility own = mobility(point.bearers, inverse_mass);
  effective_mass_.push_back(own.ease > 0.0 ? 1.0 / own.ease : 0.0);
  kept_.push_back(own.ease > own.unbounded ? 1.0 - own.unbounded / own.ease : 0.0);
  sharing_.clear();
  for (int i = 0; i < point.bearers.count; ++i) {
    const int vertex = point.bearers.vertices[i];
    const double way = point.bearers.weights[i] * inverse_mass[vertex];
    if (way == 0.0) continue;
    for (int b = first_of_vertex_[vertex]; b >= 0; b = bearings_[b].next) {
      const Bearing& bearing = bearings_[b];
      if (bearing.point == row) continue;
      if (std::exchange(sharing_with_[bearing.point], row) != row) {
        sharing_.push_back(bearing.point);
        shared_[bearing.point] = 0.0;
      }
      shared_[bearing.point] += way * bearing.weight;
    }
  }
  const auto add_entry = [&](int other) {
    const double share = shared_[other] * point.direction.dot(points[other].direction);
    entries_.push_back({other, effective_mass_.back() * share});
  };
  // What a round has only just solved for comes last: all else can be summed before it is known.
  for (const int other : sharing_) {
    if (other > row) add_entry(other);
  }
  for (const int other : sharing_) {
    if (other < row) add_entry(other);
  }
  first_.push_back(static_cast<int>(entries_.size()));
}

void DelassusMatrix::solve(const std::vector<double>& lacking, std::vector<double>& impulses) const {
  for (int round = 0; round < most_rounds; ++round) {
    double largest_change = 0.0;
    double largest = 0.0;
    for (std::size_t row = 0; row < size(); ++row) {
      const double before = impulses[row];
      double impulse = effective_mass_[row] * lacking[row] + kept_[row] * before;
      for (int e = first_[row]; e < first_[row + 1]; ++e) impulse -= entries_[e].share * impulses[entries_[e].point];
      impulse = std::max(0.0, impulse);
      impulses[row] = impulse;
      largest_change = std::max(largest_change, std::abs(impulse - before));
      largest = std::max(largest, impulse);
    }
    if (!(largest_change > tolerance * largest)) break;
  }
}

}  // namespace tissue_sim
