#pragma once

#include <array>
#include <cstddef>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

using Matrix3 = Eigen::Matrix3d;

/// A piece of tissue that stores energy: E = 1/2 k C^2 with a dimensionless constraint C of its vertices' positions.
/// Force on vertex i: -(k C + d dC/dt) grad_i C. The second part is the damping of Teschner et al. 2004: it acts along
/// the constraint only, so it never slows a rigid motion.
///
/// Each kind adds `evaluate(x, gradient)`, which returns C and writes its gradient (1/m) at every vertex, and
/// `block(x, corner)`, the second derivative of its energy by one vertex's position (N/m), positive semi-definite.
template <std::size_t size_>
struct Element {
  static constexpr std::size_t size = size_;
  std::array<int, size_> vertices{};
  double rest = 0.0;       ///< the measure at rest: m, m^2 or m^3
  double scale = 1.0;      ///< what the measure's change is divided by: rest, or a floor where rest is near zero
  double stiffness = 0.0;  ///< k, J
  double damping = 0.0;    ///< d, J s
};

template <class Kind>
using ElementVectors = std::array<Vector3, Kind::size>;

/// Positions, velocities or any other vectors of an element's vertices.
template <class Kind>
ElementVectors<Kind> gather(const Kind& element, const std::vector<Vector3>& of_all) {
  ElementVectors<Kind> of_element;
  for (std::size_t i = 0; i < Kind::size; ++i) of_element[i] = of_all[element.vertices[i]];
  return of_element;
}

/// The corners at each vertex, ascending: an item is the element's index times the kind's size, plus the corner.
template <class Kind>
FlatLists corners_of(const std::vector<Kind>& elements, std::size_t vertices) {
  FlatLists lists;
  if (elements.empty()) return lists;
  lists.first.assign(vertices + 1, 0);
  for (const Kind& element : elements) {
    for (const int vertex : element.vertices) ++lists.first[vertex + 1];
  }
  for (std::size_t v = 0; v < vertices; ++v) lists.first[v + 1] += lists.first[v];
  lists.items.resize(static_cast<std::size_t>(lists.first.back()));
  std::vector<int> next(lists.first.begin(), lists.first.end() - 1);
  int item = 0;
  for (const Kind& element : elements) {
    for (const int vertex : element.vertices) lists.items[next[vertex]++] = item++;
  }
  return lists;
}

/// What bounds the stiffness of stretched elements: areas and volumes stiffen with every stretch, and a substep that is
/// stable at rest is not for ever. k sum |grad_i C|^2 / m_i, the square of the frequency of the element alone, counts
/// up to `stiffest` only: an element beyond it is softened to it.
struct StiffnessLimit {
  const std::vector<double>& inverse_mass;  ///< 1/kg, one a vertex
  double stiffest;                          ///< 1/s^2
};

/// Adds the element's forces (N). Returns its energy (J).
template <class Kind>
double add_forces(const Kind& element, const StiffnessLimit& limit, const std::vector<Vector3>& positions,
                  const std::vector<Vector3>& velocities, std::vector<Vector3>& forces) {
  ElementVectors<Kind> gradient;
  const double c = element.evaluate(gather(element, positions), gradient);
  double rate = 0.0;
  double slope = 0.0;
  for (std::size_t i = 0; i < Kind::size; ++i) {
    rate += gradient[i].dot(velocities[element.vertices[i]]);
    slope += gradient[i].squaredNorm() * limit.inverse_mass[element.vertices[i]];
  }
  const double squared_frequency = element.stiffness * slope;
  const double softened = squared_frequency > limit.stiffest ? limit.stiffest / squared_frequency : 1.0;
  const double pull = softened * (element.stiffness * c + element.damping * rate);
  for (std::size_t i = 0; i < Kind::size; ++i) forces[element.vertices[i]] -= pull * gradient[i];
  return 0.5 * element.stiffness * c * c;
}

}  // namespace tissue_sim
