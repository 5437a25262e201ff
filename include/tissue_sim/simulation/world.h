#pragma once

#include <vector>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// An organ as the step sees it. Never changes after the load.
struct OrganModel {
  RestShape rest;
  bool restoration = true;
  CollidingSet colliding_set = CollidingSet::flood;
  DepthScheme depth = DepthScheme::exact;
  double drag = 0.0;                     ///< 1/s
  std::vector<std::vector<int>> poking;  ///< per piece: its vertices that may poke into a triangle of this organ
  double motion_limit = 0.0;             ///< m, the farthest an instrument may move between two contact passes
};

/// One rigid piece of an instrument.
struct InstrumentPiece {
  int instrument = 0;
  int part = 0;  ///< of the instrument
  InstrumentSurface surface;
};

/// Everything that a scene fixes. Shared by all steps, changed by none.
struct World {
  Vector3 gravity = Vector3::Zero();
  double time_step = 0.0;  ///< s, the longest step
  std::vector<OrganModel> organs;
  std::vector<InstrumentPiece> pieces;
  int instruments = 0;
};

/// Throws SceneError when a step of the scene's time step would need more than its max_substeps.
World build_world(const Scene& scene);

}  // namespace tissue_sim
