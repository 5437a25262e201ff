#include "tissue_sim/tissue/energy.h"

namespace tissue_sim {

namespace {

template <class Kind>
double energy_of(const std::vector<Kind>& elements, const std::vector<Vector3>& positions) {
  ElementVectors<Kind> gradient;
  double energy = 0.0;
  for (const Kind& element : elements) {
    const double c = element.evaluate(gather(element, positions), gradient);
    energy += 0.5 * element.stiffness * c * c;
  }
  return energy;
}

}  // namespace

double elastic_energy(const RestShape& rest, const std::vector<Vector3>& positions, std::vector<Vector3>& room) {
  double energy = energy_of(rest.distances, positions) + energy_of(rest.areas, positions);
  energy += energy_of(rest.volumes, positions);
  for (const NeoHookeanElement& element : rest.tetrahedra) energy += element.energy(gather(element, positions));
  if (rest.enclosed.stiffness > 0.0) {
    const double c = rest.enclosed.evaluate(positions, rest.wall_triangles(), room);
    energy += 0.5 * rest.enclosed.stiffness * c * c;
  }
  return energy;
}

double elastic_energy(const RestShape& rest, const std::vector<Vector3>& positions) {
  std::vector<Vector3> room(positions.size());
  return elastic_energy(rest, positions, room);
}

}  // namespace tissue_sim
