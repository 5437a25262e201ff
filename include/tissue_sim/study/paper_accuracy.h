#pragma once

#include <vector>

#include "tissue_sim/study/paper_protocol.h"

namespace tissue_sim {

/// Eq. 1-6 against the exact closest point, over the colliding vertices of the undeformed organ along the paper's path.
struct DepthError {
  int vertices = 0;
  double depth_mean = 0.0;      ///< of the exact depth, 1
  double depth_max = 0.0;       ///< of the exact depth, 1
  double depth_max_m = 0.0;     ///< m
  double direction_mean = 0.0;  ///< rad
  double direction_max = 0.0;   ///< rad
};

struct DepthAccuracy {
  DepthError border;
  DepthError inner;
};
DepthAccuracy measure_depths(const PaperTest& test);

/// A way of the instrument through the undeformed organ and what the two colliding sets make of it, against an exact
/// inside test of every vertex. Vertices within a nanometre of the instrument's surface count on neither side.
struct SetMotion {
  const char* name = "";
  std::vector<Vector3> centres;
};
std::vector<SetMotion> set_motions();

struct SetError {
  int colliding = 0;  ///< vertices inside, summed over the steps
  int falsely = 0;    ///< found, but outside
  int missed = 0;     ///< inside, but not found
};
SetError measure_set(const PaperTest& test, CollidingSet set, const SetMotion& motion);

}  // namespace tissue_sim
