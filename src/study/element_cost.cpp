#include "tissue_sim/study/element_cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/simulation/step.h"

namespace tissue_sim {

namespace {

constexpr int repetitions = 60;

// Floating point operations of a lane, counted in constraint_kernels.h and neo_hookean_batch.cpp, what it adds to its
// vertices included.
constexpr double pair_operations = 527.0;
constexpr double flap_operations = 205.0;
constexpr double triangle_operations = 205.0;
constexpr double distance_operations = 48.0;
constexpr double tetrahedron_operations = 198.0;

/// Of a vertex, in double: its displacement and its pulls, with the enclosed volume's.
constexpr double vertex_operations = 24.0;

/// Of a vertex: position, rest, velocity and force in double; what the batches read and write of it, once each way.
constexpr double vertex_bytes = 4.0 * sizeof(Vector3);

Scene block_scene(Model model, Integrator integrator, int cells = 10) {
  Organ block;
  block.name = "block";
  block.solid = make_block({0.03, 0.03, 0.015}, {2 * cells, 2 * cells, cells});
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

/// As a hollow organ of test 9's sphere.
Scene sphere_scene(int slices = 64) {
  Scene scene = block_scene(Model::fem, Integrator::explicit_substeps);
  Organ& sphere = scene.organs.front();
  sphere.name = "sphere";
  sphere.solid = TetrahedralMesh();
  sphere.mesh = make_sphere(0.05, slices);
  sphere.model = Model::surface;
  sphere.wall_thickness = 0.004;
  sphere.attached.assign(1, 0);
  return scene;
}

void deform_a_little(OrganState& state) {
  for (Vector3& p : state.positions) p += 1e-4 * Vector3(std::sin(400.0 * p.y()), 0.0, std::sin(300.0 * p.x()));
}

/// One element after another, as element.h has them, and no enclosed volume.
void plain_forces(const RestShape& rest, const OrganState& state, std::vector<Vector3>& forces) {
  std::fill(forces.begin(), forces.end(), Vector3::Zero());
  const StiffnessLimit limit = {rest.inverse_mass, rest.stiffest_element};
  for (const DistanceElement& e : rest.distances) add_forces(e, limit, state.positions, state.velocities, forces);
  for (const AreaElement& e : rest.areas) add_forces(e, limit, state.positions, state.velocities, forces);
  for (const VolumeElement& e : rest.volumes) add_forces(e, limit, state.positions, state.velocities, forces);
  NeoHookeanElement::Vectors gradient;
  for (const NeoHookeanElement& e : rest.tetrahedra) {
    e.evaluate(gather(e, state.positions), gradient);
    for (std::size_t i = 0; i < 4; ++i) forces[e.vertices[i]] -= gradient[i];
  }
}

template <class Batch>
void count(const std::vector<Batch>& batches, double operations_of_a_lane, SubstepCost& cost) {
  const auto n = static_cast<double>(batches.size());
  cost.bytes += n * sizeof(Batch);
  cost.operations += n * static_cast<double>(constraint_lanes) * operations_of_a_lane;
}

SubstepCost time_substep(const char* name, const Scene& scene) {
  const World world = build_world(scene);
  const RestShape& rest = world.organs.front().rest;
  OrganState state = rest_state(world, 0);
  deform_a_little(state);
  Workspace workspace = build_workspace(world);
  ElementRoom& room = workspace.organs.front().elements;
  SubstepCost cost;
  cost.organ = name;
  cost.elements =
      static_cast<int>(rest.distances.size() + rest.areas.size() + rest.volumes.size() + rest.tetrahedra.size());
  cost.seconds = least_seconds([&] { element_forces(rest, state, state.forces, room); });
  cost.plain_seconds = least_seconds([&] { plain_forces(rest, state, state.forces); });

  const auto vertices = static_cast<double>(rest.positions.size());
  const double of_room =
      rest.constraints.empty() ? 4.0 * sizeof(Eigen::Vector4f) : 2.0 * (sizeof(VertexMotion) + sizeof(VertexPull));
  cost.bytes =
      vertices * (vertex_bytes + of_room) + static_cast<double>(2 * sizeof(EnclosedShare) * room.shares.size());
  cost.operations = vertices * vertex_operations;
  count(rest.constraints.pairs, pair_operations, cost);
  count(rest.constraints.flaps, flap_operations, cost);
  count(rest.constraints.triangles, triangle_operations, cost);
  count(rest.constraints.distances, distance_operations, cost);
  count(rest.packed.batches, tetrahedron_operations, cost);
  return cost;
}

/// Bytes a second of a = b + s c, where a line that is written is not counted as read.
double triad(std::size_t bytes) {
  const std::size_t floats = bytes / (3 * sizeof(float));
  std::vector<float> a(floats, 0.0F);
  const std::vector<float> b(floats, 1.0F);
  const std::vector<float> c(floats, 2.0F);
  float s = 0.5F;
  const double seconds = least_seconds([&] {
    for (std::size_t i = 0; i < floats; ++i) a[i] = b[i] + s * c[i];
    s += a[floats / 2] * 1e-9F;  // so that no pass can be left out
  });
  return static_cast<double>(3 * sizeof(float) * floats) / seconds;
}

constexpr int chains = 6;  // of sums, and of products: enough that none waits for the one before
constexpr int links = 4096;

template <class Lane>
__attribute__((always_inline)) inline float add_and_multiply(float by) {
  const Lane factor = Lane{} + (1.0F + by);
  const Lane term = Lane{} + by;
  Lane sums[chains];
  Lane products[chains];
  for (int i = 0; i < chains; ++i) {
    sums[i] = Lane{} + static_cast<float>(i);
    products[i] = sums[i] + 1.0F;
  }
  for (int k = 0; k < links; ++k) {
    for (int i = 0; i < chains; ++i) {
      sums[i] += term;
      products[i] *= factor;
    }
  }
  Lane all{};
  for (int i = 0; i < chains; ++i) all += sums[i] + products[i];
  return all[0];
}

__attribute__((noinline)) float operate_baseline(float by) {
  return add_and_multiply<float __attribute__((vector_size(16)))>(by);
}
#ifdef __x86_64__
__attribute__((noinline, target("avx2"))) float operate_wide(float by) {
  return add_and_multiply<float __attribute__((vector_size(32)))>(by);
}
#endif

double operations_per_second() {
  volatile float by = 1e-7F;
  volatile float result = 0.0F;
#ifdef __x86_64__
  if (instruction_set() != InstructionSet::baseline) {
    return 8.0 * 2.0 * chains * links / least_seconds([&] { result = operate_wide(by); });
  }
#endif
  return 4.0 * 2.0 * chains * links / least_seconds([&] { result = operate_baseline(by); });
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
      deform_a_little(state);
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

std::vector<SubstepCost> time_substeps() {
  return {time_substep("surface", sphere_scene()),
          time_substep("volume", block_scene(Model::volume, Integrator::explicit_substeps)),
          time_substep("fem", block_scene(Model::fem, Integrator::explicit_substeps))};
}

std::vector<ThreadsCost> time_threads() {
  const auto time = [](const char* name, const Scene& scene) {
    const World world = build_world(scene);
    const RestShape& rest = world.organs.front().rest;
    OrganState state = rest_state(world, 0);
    deform_a_little(state);
    Workspace workspace = build_workspace(world, 2);
    ElementRoom& room = workspace.organs.front().elements;
    ThreadsCost cost;
    cost.organ = name;
    cost.elements =
        static_cast<int>(rest.distances.size() + rest.areas.size() + rest.volumes.size() + rest.tetrahedra.size());
    cost.seconds = cost.two_seconds = 1e300;
    for (int i = 0; i < repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      element_forces(rest, state, state.forces, room);
      const auto middle = std::chrono::steady_clock::now();
      element_forces(rest, state, state.forces, room, workspace.threads.get());
      const auto end = std::chrono::steady_clock::now();
      cost.seconds = std::min(cost.seconds, std::chrono::duration<double>(middle - start).count());
      cost.two_seconds = std::min(cost.two_seconds, std::chrono::duration<double>(end - middle).count());
    }
    return cost;
  };
  return {time("surface", sphere_scene(101)), time("fem", block_scene(Model::fem, Integrator::explicit_substeps, 15))};
}

MachineLimit measure_machine() {
  return {triad(std::size_t{192} << 20), triad(std::size_t{1} << 20), operations_per_second()};
}

double least_possible(const SubstepCost& cost, const MachineLimit& limit) {
  return std::max(cost.bytes / limit.cached_bytes_per_second, cost.operations / limit.operations_per_second);
}

}  // namespace tissue_sim
