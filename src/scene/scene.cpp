#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

const char* to_string(Model model) {
  switch (model) {
    case Model::contact_only:
      return "contact_only";
    case Model::surface:
      return "surface";
    case Model::volume:
      return "volume";
    case Model::fem:
      return "fem";
  }
  return "?";
}

const char* to_string(CollidingSet set) {
  return set == CollidingSet::flood ? "flood" : "paper";
}

const char* to_string(DepthScheme depth) {
  return depth == DepthScheme::exact ? "exact" : "paper";
}

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::automatic:
      return "auto";
    case Integrator::explicit_substeps:
      return "explicit";
    case Integrator::vertex_block_descent:
      return "vertex_block_descent";
  }
  return "?";
}

}  // namespace tissue_sim
