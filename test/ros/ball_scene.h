#pragma once

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// A rigid ball of 30 mm at the origin and a probe of 5 mm, with so many slices and stacks each.
inline Scene ball_scene(int ball_slices, int probe_slices) {
  Organ ball;
  ball.name = "ball";
  ball.mesh = make_sphere(0.03, ball_slices);
  ball.model = Model::contact_only;
  Instrument probe;
  probe.name = "probe";
  probe.tip_link = "tip";
  probe.pose_topic = "test/measured_cp";
  probe.parts.push_back({"tip", make_sphere(0.005, probe_slices), true});
  Scene scene;
  scene.frame = "world";
  scene.organs.push_back(ball);
  scene.instruments.push_back(probe);
  return scene;
}

}  // namespace tissue_sim
