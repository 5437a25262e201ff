#pragma once

#include <string>
#include <vector>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/active_region.h"
#include "tissue_sim/tissue/neo_hookean_corners.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// The elements at each vertex, by kind: an item is the element's index times the kind's size, plus the vertex's
/// corner. Kinds that the organ has none of have no lists.
struct Incidence {
  FlatLists distances;
  FlatLists areas;
  FlatLists volumes;
  CornerBatches tetrahedra;       ///< neo-Hookean
  std::vector<double> stiffness;  ///< N/m, per vertex, its own at rest
};

/// An organ as the step sees it. Never changes after the load.
struct OrganModel {
  RestShape rest;
  bool restoration = true;
  CollidingSet colliding_set = CollidingSet::flood;
  DepthScheme depth = DepthScheme::exact;
  double drag = 0.0;                                      ///< 1/s
  Integrator integrator = Integrator::explicit_substeps;  ///< never automatic
  std::string integrator_reason;
  FlatLists tetrahedra_at;           ///< per vertex, of an explicit `fem`, else empty
  Incidence incidence;               ///< for vertex block descent, else empty
  std::vector<Level> levels;         ///< coarser ones, the finest first; empty: all of the organ is simulated
  std::vector<RegionModel> regions;  ///< of the organ's own tetrahedra and of each level but the coarsest; of a wall
  double fine_edge = 0.0;            ///< m, of the organ's own tetrahedra
  double shear_modulus = 0.0;        ///< Pa
  std::vector<char> sharp;           ///< per piece: somewhere curved more sharply than this organ's mesh can feel
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
