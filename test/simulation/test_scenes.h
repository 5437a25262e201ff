#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/step.h"

namespace tissue_sim {

inline std::string source_file(const std::string& path) {
  return std::string(TISSUE_SIM_SOURCE_DIR) + "/" + path;
}

/// The bundled liver, as the demonstration has it.
inline Organ demo_liver() {
  std::vector<std::string> warnings;
  return load_scene(source_file("config/scenes/demo.yaml"), warnings).organs.front();
}

/// One of the paper's spheres as the wall of a hollow organ, attached where x < -0.8 R. Drag of 5 1/s: the soft bending
/// of 480 triangles is overdamped by more, and creeps back (0.013 mm left after 2 s with 10, 0.006 mm with 5).
inline Organ wall_sphere(int slices, double radius = 0.05) {
  Organ organ;
  organ.name = "sphere";
  organ.mesh = make_sphere(radius, slices);
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.wall_thickness = 0.004;
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
    if (organ.mesh.vertices[v].x() < -0.8 * radius) organ.attached.push_back(v);
  }
  return organ;
}

inline Instrument ball(double radius, const std::string& name = "ball") {
  Instrument instrument;
  instrument.name = name;
  instrument.parts.push_back({"ball", make_sphere(radius, 12), true});
  return instrument;
}

inline Scene scene_of(Organ organ, std::vector<Instrument> instruments) {
  Scene scene;
  scene.frame = "world";
  scene.organs.push_back(std::move(organ));
  scene.instruments = std::move(instruments);
  return scene;
}

/// A world, its state, and the steps that take its first instrument from place to place.
struct Simulation {
  explicit Simulation(const Scene& scene)
      : world(build_world(scene)), state(rest_state(world)), workspace(build_workspace(world)) {
    poses.resize(static_cast<std::size_t>(world.instruments));
  }

  void go_to(const Pose& pose, double duration = 0.001) {
    Motion motion;
    motion.duration = duration;
    for (std::size_t i = 0; i < poses.size(); ++i)
      motion.instruments.push_back({i == 0, poses[i], i == 0 ? pose : poses[i]});
    ++report.step;
    step(world, motion, state, workspace, report);
    poses[0] = pose;
  }

  /// In a line, in equal steps of a millisecond.
  void slide_to(const Pose& to, int steps) {
    const Pose from = poses[0];
    for (int i = 1; i <= steps; ++i) go_to(interpolate(from, to, static_cast<double>(i) / steps));
  }

  void start_at(const Pose& pose) {
    for (std::size_t organ = 0; organ < world.organs.size(); ++organ) {
      state.organs[organ] = rest_state(world, static_cast<int>(organ));
      workspace.organs[organ].last_good = state.organs[organ];
      forget(workspace.organs[organ]);
    }
    poses[0] = pose;
  }

  /// With its whole surface in place.
  const OrganState& organ() {
    place_surface(world.organs.front(), state.organs.front());
    return state.organs.front();
  }
  std::uint64_t hash() const { return hash_state(world.organs.front(), state.organs.front(), 1); }
  const RestShape& rest() const { return world.organs.front().rest; }

  World world;
  State state;
  Workspace workspace;
  StepReport report;
  std::vector<Pose> poses;
};

inline double rms_from_rest(const RestShape& rest, const std::vector<Vector3>& positions) {
  double sum = 0.0;
  for (std::size_t v = 0; v < positions.size(); ++v) sum += (positions[v] - rest.positions[v]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(positions.size()));
}

}  // namespace tissue_sim
