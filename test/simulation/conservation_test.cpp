#include <gtest/gtest.h>

#include <cstdlib>

#include "simulation/solid_scenes.h"
#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/vertex_block_descent.h"
#include "tissue_sim/tissue/energy.h"

/// What no contact gives, no substep makes.
namespace tissue_sim::conservation_test {
namespace {

int random_starts() {
  return std::getenv("TISSUE_SIM_LONG") != nullptr ? 10'000 : 1'000;
}

/// A small organ with any material, as the step sees it, without drag.
OrganModel random_organ(Random& random, Model model, Integrator integrator) {
  Organ organ = model == Model::surface
                    ? wall_sphere(6, 0.01)
                    : solid_organ(make_block({0.01, 0.01, 0.005}, {2, 2, 1}), {0.01, 0.01, 0.005}, model);
  organ.model = model;
  organ.integrator = integrator;
  const double least = model == Model::surface ? 0.34 : 0.25;
  const double dampings[] = {0.0, 0.1, 1.0};
  organ.material.young = 500.0 * std::pow(2000.0, random_in(random, 0.0, 1.0));
  organ.material.poisson = random_in(random, least, 0.499);
  organ.material.damping = dampings[random() % 3];
  organ.material.drag = 0.0;
  organ.wall_thickness = 0.001;
  Scene scene = scene_of(organ, {ball(0.01)});
  scene.time_step = 1e-5;
  scene.max_substeps = 10'000;
  return build_world(scene).organs.front();
}

/// Anywhere within `part` of an edge, at any speed that goes as far in a tenth of the fastest vibration.
OrganState random_state(Random& random, const OrganModel& model, double part) {
  OrganState state;
  const RestShape& rest = model.rest;
  const double reach = part * rest.mean_edge;
  state.positions = rest.positions;
  state.velocities.assign(rest.positions.size(), Vector3::Zero());
  state.forces = state.velocities;
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    if (rest.attached[v]) continue;
    state.positions[v] += random_point(random, reach);
    state.velocities[v] = random_point(random, 0.1 * reach * rest.fastest_frequency);
  }
  return state;
}

double kinetic(const RestShape& rest, const std::vector<Vector3>& v, const std::vector<Vector3>& w) {
  double energy = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) energy += 0.5 * rest.mass[i] * v[i].dot(w[i]);
  return energy;
}

/// Of the explicit substep, which keeps the energy with the motion before and after it: v(n) v(n+1) for v^2.
double explicit_growth(const OrganModel& model, OrganState& state, int substeps) {
  const double dt = model.rest.stable_substep;
  ElementRoom room;
  prepare(room, model.rest);
  double first = 0.0;
  double last = 0.0;
  for (int i = 0; i < substeps; ++i) {
    const std::vector<Vector3> before = state.velocities;
    const double elastic = elastic_energy(model.rest, state.positions);
    element_forces(model.rest, state, state.forces, room);
    accelerate(model, Vector3::Zero(), dt, state.forces, state);
    const double energy = elastic + kinetic(model.rest, before, state.velocities);
    advance(model, dt, state);
    if (i < substeps / 4) first = std::max(first, energy);
    if (i >= substeps - substeps / 4) last = std::max(last, energy);
  }
  return last / first;
}

/// Of vertex block descent with steps of dt: the most energy after any step over that at the start.
double descent_growth(const OrganModel& model, OrganState& state, double dt, int steps) {
  DescentRoom room;
  prepare(room, model.rest);
  std::vector<ContactPoint> none;
  const auto energy = [&] {
    return elastic_energy(model.rest, state.positions) + kinetic(model.rest, state.velocities, state.velocities);
  };
  const double first = energy();
  double most = 0.0;
  for (int i = 0; i < steps; ++i) {
    descend(model, Vector3::Zero(), dt, none, state, room);
    most = std::max(most, energy());
  }
  return most / first;
}

/// Of an undamped organ that swings far the energy swings too, by some hundredths; after 4,000 substeps it is no higher
/// than after 100.
constexpr double swing = 1.1;

/// Calls start(organ) for every random start, ten with each random organ.
template <class Start>
void with_random_starts(Model model, Integrator integrator, Start&& start) {
  Random random(21);
  OrganModel organ;
  for (int i = 0; i < random_starts() && !testing::Test::HasFatalFailure(); ++i) {
    if (i % 10 == 0) organ = random_organ(random, model, integrator);
    SCOPED_TRACE(std::string(to_string(model)) + ", start " + std::to_string(i));
    start(organ, random);
  }
}

TEST(Conservation, OfEnergyAtTheComputedSubstep) {
  for (const Model model : {Model::surface, Model::volume, Model::fem}) {
    double worst = 0.0;
    with_random_starts(model, Integrator::explicit_substeps, [&](const OrganModel& organ, Random& random) {
      OrganState state = random_state(random, organ, random_in(random, 0.0, 0.02));
      const double growth = explicit_growth(organ, state, 100);
      worst = std::max(worst, growth);
      ASSERT_LT(growth, organ.rest.damping_time > 0.0 ? 1.0 : swing);
    });
    testing::Test::RecordProperty(to_string(model), static_cast<int>(1e6 * worst));
  }
}

/// From a tenth of the fastest vibration's angle a step to a thousand times it.
TEST(Conservation, OfEnergyByDescentWithAnyStep) {
  for (const Model model : {Model::surface, Model::volume, Model::fem}) {
    double worst = 0.0;
    with_random_starts(model, Integrator::vertex_block_descent, [&](const OrganModel& organ, Random& random) {
      OrganState state = random_state(random, organ, random_in(random, 0.0, 0.1));
      const double dt = std::pow(10.0, random_in(random, -1.0, 3.0)) / organ.rest.fastest_frequency;
      const double growth = descent_growth(organ, state, std::min(dt, 0.004), 40);
      worst = std::max(worst, growth);
      ASSERT_LT(growth, 1.02) << "steps of " << dt * organ.rest.fastest_frequency << " over the fastest frequency";
    });
    testing::Test::RecordProperty(to_string(model), static_cast<int>(1e6 * worst));
  }
}

TEST(Conservation, AnElasticOrganComesBackToAMillionthOfItsSize) {
  for (const Model model : {Model::surface, Model::volume, Model::fem}) {
    for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
      Organ organ = model == Model::surface ? wall_sphere(10, 0.015) : soft_block(model, 3, integrator);
      organ.integrator = integrator;
      if (model == Model::surface) organ.wall_thickness = 0.003;
      const double top = model == Model::surface ? 0.015 : 0.0;
      Simulation simulation(scene_of(organ, {ball(0.005)}));
      const auto over = [&](double depth) {
        Pose pose = ball_over_block(0.005, depth);
        pose.position.z() += top;
        return pose;
      };
      simulation.start_at(over(-0.001));
      simulation.slide_to(over(0.003), 50);
      ASSERT_FALSE(simulation.report.contacts.empty());
      simulation.slide_to(over(-0.01), 50);
      for (int i = 0; i < 20'000 && !simulation.organ().asleep; ++i) simulation.go_to(simulation.poses[0]);
      double farthest = 0.0;
      const OrganState& state = simulation.organ();
      for (std::size_t v = 0; v < state.positions.size(); ++v) {
        farthest = std::max(farthest, (state.positions[v] - simulation.rest().positions[v]).norm());
      }
      EXPECT_TRUE(state.asleep) << to_string(model) << ", " << to_string(integrator);
      EXPECT_LT(farthest, 1e-6 * simulation.rest().size) << to_string(model) << ", " << to_string(integrator);
    }
  }
}

}  // namespace
}  // namespace tissue_sim::conservation_test
