#pragma once

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// An organ that grows and is pressed alike at every size: a closed, hollow tube along x with round ends, 30 mm in
/// radius, of triangles with edges of 2 mm. It grows in length only, so what is around the press never changes.
TriangleMesh make_tube(int triangles);

/// The tube as a stomach's wall that is held from behind, and a ball of 5 mm radius.
Scene growing_scene(int triangles);

/// The ball's pose after `step` of `press_steps` steps of 1 ms: down to 4 mm below the top of the tube, then held.
Pose press_pose(int step);
constexpr int press_steps = 200;

}  // namespace tissue_sim
