#include "tissue_sim/simulation/integrator.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// How much stiffer than the stiffest at rest an element may become, as squared frequency. 4 would do for one mode at
/// the safety of 0.4, but around a vertex many stretch at once: 4 let a sphere's poles run away when it was pressed
/// flat, 2 only just did not.
constexpr double covered_stiffening = 1.5;

}  // namespace

int substeps_for(const RestShape& rest, double duration) {
  if (!rest.elastic()) return 1;
  return std::max(1, static_cast<int>(std::ceil(duration / rest.stable_substep - 1e-9)));
}

double element_forces(const RestShape& rest, const OrganState& state, std::vector<Vector3>& forces,
                      std::vector<Vector3>& gradient) {
  std::fill(forces.begin(), forces.end(), Vector3::Zero());
  const StiffnessLimit limit = {rest.inverse_mass, covered_stiffening * rest.stiffest_element};
  double energy = 0.0;
  for (const DistanceElement& element : rest.distances) {
    energy += add_forces(element, limit, state.positions, state.velocities, forces);
  }
  for (const AreaElement& element : rest.areas) {
    energy += add_forces(element, limit, state.positions, state.velocities, forces);
  }
  for (const VolumeElement& element : rest.flaps) {
    energy += add_forces(element, limit, state.positions, state.velocities, forces);
  }
  if (!(rest.enclosed.stiffness > 0.0)) return energy;

  const double c = rest.enclosed.evaluate(state.positions, rest.triangles, gradient);
  double rate = 0.0;
  for (std::size_t v = 0; v < gradient.size(); ++v) rate += gradient[v].dot(state.velocities[v]);
  const double pull = rest.enclosed.stiffness * c + rest.enclosed.damping * rate;
  for (std::size_t v = 0; v < gradient.size(); ++v) forces[v] -= pull * gradient[v];
  return energy + 0.5 * rest.enclosed.stiffness * c * c;
}

double integrate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                 OrganState& state) {
  const double slowed = 1.0 / (1.0 + dt * organ.drag);
  const RestShape& rest = organ.rest;
  double fastest = 0.0;
  for (std::size_t v = 0; v < forces.size(); ++v) {
    if (rest.attached[v]) continue;
    if (state.held[v]) {
      state.velocities[v].setZero();
      continue;
    }
    const Vector3 change = dt * (rest.inverse_mass[v] * forces[v] + gravity);
    state.velocities[v] = slowed * (state.velocities[v] + change);
    state.positions[v] += dt * state.velocities[v];
    fastest = std::max(fastest, state.velocities[v].squaredNorm());
  }
  return std::sqrt(fastest);
}

}  // namespace tissue_sim
