#pragma once

#include "simulation/test_scenes.h"
#include "tissue/test_solids.h"

/// Solid organs under a ball.
namespace tissue_sim {

const Vector3 soft_block_size(0.03, 0.03, 0.015);  // m

/// 30 x 30 x 15 mm of liver on a table, its top at z = 0, cut into cells of 15 mm / `cells`. The drag of 60 1/s lets it
/// come to rest soon.
inline Organ soft_block(Model model, int cells, Integrator integrator = Integrator::explicit_substeps) {
  Organ organ = solid_organ(make_block(soft_block_size, {2 * cells, 2 * cells, cells}), soft_block_size, model);
  organ.integrator = integrator;
  organ.material.drag = 60.0;
  return organ;
}

/// Its lowest point `depth` below z = 0, a little off the middle and turned, so that no grid lines fall together.
inline Pose ball_over_block(double radius, double depth) {
  return {{0.0003, 0.0002, radius - depth}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3(1, 2, 3).normalized()))};
}

inline Instrument round_ball(double radius, int slices) {
  Instrument instrument = ball(radius);
  instrument.parts[0].mesh = make_sphere(radius, slices);
  return instrument;
}

/// In 50 ms to `depth`, then `settle` ms there.
inline void press(Simulation& simulation, double radius, double depth, int settle, double duration = 0.001) {
  simulation.start_at(ball_over_block(radius, -0.0002));
  const Pose from = simulation.poses[0];
  const int steps = static_cast<int>(std::ceil(0.05 / duration));
  for (int i = 1; i <= steps; ++i) {
    simulation.go_to(interpolate(from, ball_over_block(radius, depth), static_cast<double>(i) / steps), duration);
  }
  for (int i = 0; i < settle; ++i) simulation.go_to(simulation.poses[0], duration);
}

inline double fastest_vertex(const OrganState& state) {
  double fastest = 0.0;
  for (const Vector3& v : state.velocities) fastest = std::max(fastest, v.norm());
  return fastest;
}

}  // namespace tissue_sim
