#include "tissue_sim/study/element_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/simulation/step.h"

namespace tissue_sim {

namespace {

constexpr int repetitions = 60;

Scene block_scene(Model model, Integrator integrator) {
  Organ block;
  block.name = "block";
  block.solid = make_block({0.03, 0.03, 0.015}, {20, 20, 10});
  block.mesh = take_surface(block.solid);
  block.model = model;
  block.integrator = integrator;
  block.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  for (std::size_t v = 0; v < block.solid.vertices.size(); ++v) {
    if (block.solid.vertices[v].z() < -0.015 + 1e-9) block.attached.push_back(static_cast<int>(v));
  }
  Scene scene;
  scene.frame = "world";
  scene.organs.push_back(std::move(block));
  scene.instruments.emplace_back();
  scene.instruments.back().parts.push_back({"ball", make_sphere(0.005, 8), true});
  return scene;
}

template <class Work>
double least_seconds(Work work) {
  double least = 1e300;
  for (int i = 0; i < repetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

}  // namespace

std::vector<ElementCost> time_elements() {
  std::vector<ElementCost> costs;
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    for (const Model model : {Model::fem, Model::volume}) {
      const Scene scene = block_scene(model, integrator);
      const World world = build_world(scene);
      const OrganModel& organ = world.organs.front();
      OrganState state = rest_state(world, 0);
      for (Vector3& p : state.positions) p += 1e-4 * Vector3(std::sin(400.0 * p.y()), 0.0, std::sin(300.0 * p.x()));
      Workspace workspace = build_workspace(world);
      OrganWorkspace& work = workspace.organs.front();
      ElementCost cost;
      cost.model = model;
      cost.integrator = integrator;
      cost.tetrahedra = static_cast<int>(scene.organs.front().solid.tetrahedra.size());
      cost.seconds = least_seconds([&] {
        if (integrator == Integrator::explicit_substeps) {
          element_forces(organ.rest, state, state.forces, work.elements);
        } else {
          descend(organ, Vector3::Zero(), 0.001, work.points, state, work.descent);
        }
      });
      costs.push_back(cost);
    }
  }
  return costs;
}

}  // namespace tissue_sim
