#include "tissue_sim/simulation/integrator.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

/// How much stiffer than the stiffest at rest an element may become, as squared frequency. 4 would do for one mode at
/// the safety of 0.4, but around a vertex many stretch at once: 4 let a sphere's poles run away when it was pressed
/// flat, 2 only just did not.
constexpr double covered_stiffening = 1.5;

/// The same for tetrahedra, which are not softened: beyond it their substeps get shorter. 1.4 would do for one
/// tetrahedron at the safety of 0.7. A probe of 3 mm pressed 10 mm into tetrahedra of 1 to 1.5 mm went bad in every
/// step with that, and in none with 1.0 or 0.7.
constexpr double solid_stiffening = 0.7;

/// Beyond four times the substeps it is a matter of the health check.
constexpr double most_stiffening = 16.0;

/// Forces of neo-Hookean tetrahedra, damped by evaluating them where the vertices will be after damping_time.
void tetrahedra_forces(const RestShape& rest, const OrganState& state, ElementRoom& room,
                       std::vector<Vector3>& forces) {
  for (std::size_t v = 0; v < forces.size(); ++v) {
    const Vector3 displacement = state.positions[v] - rest.positions[v] + rest.damping_time * state.velocities[v];
    room.displacements[v] << displacement.cast<float>(), 0.0F;
    room.forces[v].setZero();
  }
  add_neo_hookean_forces(rest.packed, room.displacements.front().data(), room.forces.front().data());
  for (std::size_t v = 0; v < forces.size(); ++v) forces[v] = room.forces[v].head<3>().cast<double>();
}

}  // namespace

void prepare(ElementRoom& room, const RestShape& rest) {
  if (rest.enclosed.stiffness > 0.0) room.gradient.assign(rest.positions.size(), Vector3::Zero());
  if (rest.packed.batches.empty()) return;
  room.displacements.assign(rest.positions.size(), Eigen::Vector4f::Zero());
  room.forces = room.displacements;
}

int substeps_for(const RestShape& rest, double duration, double stiffening) {
  if (!rest.elastic()) return 1;
  const double shorter = std::sqrt(std::clamp(stiffening / solid_stiffening, 1.0, most_stiffening));
  return std::max(1, static_cast<int>(std::ceil(shorter * duration / rest.stable_substep - 1e-9)));
}

double stiffening(const RestShape& rest, const FlatLists& tetrahedra_at, const std::vector<ContactPoint>& points,
                  const std::vector<Vector3>& positions) {
  if (rest.packed.batches.empty()) return 0.0;
  double stiffest = 0.0;
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      const int v = point.bearers.vertices[i];
      for (const int* t = tetrahedra_at.begin(v); t != tetrahedra_at.end(v); ++t) {
        const NeoHookeanElement& element = rest.tetrahedra[*t];
        const NeoHookeanElement::Vectors x = gather(element, positions);
        for (std::size_t corner = 0; corner < 4; ++corner) {
          stiffest = std::max(stiffest, element.stiffness(x, corner) * rest.inverse_mass[element.vertices[corner]]);
        }
      }
    }
  }
  return stiffest / rest.stiffest_element;
}

void element_forces(const RestShape& rest, const OrganState& state, std::vector<Vector3>& forces, ElementRoom& room) {
  if (!rest.packed.batches.empty()) {
    tetrahedra_forces(rest, state, room, forces);
    return;
  }
  std::fill(forces.begin(), forces.end(), Vector3::Zero());
  const StiffnessLimit limit = {rest.inverse_mass, covered_stiffening * rest.stiffest_element};
  for (const DistanceElement& element : rest.distances) {
    add_forces(element, limit, state.positions, state.velocities, forces);
  }
  for (const AreaElement& element : rest.areas) {
    add_forces(element, limit, state.positions, state.velocities, forces);
  }
  for (const VolumeElement& element : rest.volumes) {
    add_forces(element, limit, state.positions, state.velocities, forces);
  }
  if (!(rest.enclosed.stiffness > 0.0)) return;

  const double c = rest.enclosed.evaluate(state.positions, rest.wall_triangles(), room.gradient);
  double rate = 0.0;
  for (std::size_t v = 0; v < forces.size(); ++v) rate += room.gradient[v].dot(state.velocities[v]);
  const double pull = rest.enclosed.stiffness * c + rest.enclosed.damping * rate;
  for (std::size_t v = 0; v < forces.size(); ++v) forces[v] -= pull * room.gradient[v];
}

void accelerate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                OrganState& state) {
  const double slowed = 1.0 / (1.0 + dt * organ.drag);
  const RestShape& rest = organ.rest;
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < forces.size(); ++v) {
    if (rest.attached[v]) continue;
    if (state.holds(v)) {
      state.velocities[v].setZero();
      continue;
    }
    const Vector3 change = dt * (rest.inverse_mass[v] * forces[v] + gravity);
    state.velocities[v] = slowed * (state.velocities[v] + change);
  }
}

double advance(const OrganModel& organ, double dt, OrganState& state) {
  const RestShape& rest = organ.rest;
  double fastest = 0.0;
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < state.positions.size(); ++v) {
    if (rest.attached[v] || state.holds(v)) continue;
    state.positions[v] += dt * state.velocities[v];
    fastest = std::max(fastest, state.velocities[v].squaredNorm());
  }
  return std::sqrt(fastest);
}

}  // namespace tissue_sim
