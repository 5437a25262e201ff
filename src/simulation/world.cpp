#include "tissue_sim/simulation/world.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/vertex_block_descent.h"

namespace tissue_sim {

namespace {

/// An instrument moves at most this part of an organ edge between two contact passes: with 1 mm jumps on 5 mm edges the
/// response was seen to blow up once in six.
constexpr double edge_fraction = 0.25;

/// ... and this part of its own thickness, so that nothing is passed over and the nearest way out is the way it came.
constexpr double thickness_fraction = 0.25;

/// Of a mean organ edge: an instrument curved less sharply than this reaches at most a 24th of an edge below the
/// surface between two vertices that it touches.
constexpr double sharp = 3.0;

/// Explicit substeps of a solid beyond which `auto` takes vertex block descent. In time the two are even at three, but
/// in motion explicit is exact, where one sweep carries a push a few elements far.
constexpr int explicit_substeps_limit = 10;

void refuse_if_too_stiff(const Scene& scene, const Organ& organ, const RestShape& rest) {
  const int substeps = substeps_for(rest, scene.time_step);
  if (substeps <= scene.max_substeps) return;
  const double time_step = rest.stable_substep * scene.max_substeps;
  const double softer = std::pow(time_step / scene.time_step, 2);
  std::ostringstream line;
  line.precision(2);
  line << "organ " << organ.name << ": a step of " << scene.time_step << " s needs " << substeps << " substeps of "
       << rest.stable_substep << " s, more than max_substeps: " << scene.max_substeps
       << "; time_step: " << 0.99 * time_step << " or material young: " << 0.98 * softer * organ.material.young
       << " would do, or a higher max_substeps";
  throw SceneError(line.str());
}

/// `auto`: explicit where it is stable with few substeps, since that is cheapest and exact in motion too.
void choose_integrator(const Scene& scene, const Organ& organ, OrganModel& model) {
  const int substeps = substeps_for(model.rest, scene.time_step);
  model.integrator = organ.integrator;
  if (organ.integrator != Integrator::automatic) {
    model.integrator_reason = "the scene asks for it";
    return;
  }
  const bool many = is_solid(organ.model) && substeps > explicit_substeps_limit;
  model.integrator = many ? Integrator::vertex_block_descent : Integrator::explicit_substeps;
  if (!model.rest.elastic()) {
    model.integrator_reason = "nothing to integrate";
    return;
  }
  std::ostringstream reason;
  reason << "explicit " << (many ? "would need " : "needs ") << substeps << " substep(s) a step, "
         << (many ? "more than " : "solids may take up to ") << explicit_substeps_limit;
  model.integrator_reason = reason.str();
}

void add_levels(const Organ& organ, OrganModel& model) {
  model.levels = build_levels(organ, model.rest);
  model.fine_edge = median_edge(model.rest);
  model.shear_modulus = lame_moduli(organ.material.young, organ.material.poisson).mu;
  const RegionSize size = region_size(*organ.levels_tolerance);
  for (std::size_t level = 0; level < model.levels.size(); ++level) {
    const RestShape& shape = level == 0 ? model.rest : model.levels[level - 1].shape;
    const double edge = level == 0 ? model.fine_edge : model.levels[level - 1].edge;
    model.regions.push_back(build_region_model(shape, size.edges * edge, edge));
  }
}

}  // namespace

World build_world(const Scene& scene) {
  World world;
  world.gravity = scene.gravity;
  world.time_step = scene.time_step;
  world.instruments = static_cast<int>(scene.instruments.size());

  double thinnest = 1e300;
  for (int i = 0; i < world.instruments; ++i) {
    const Instrument& instrument = scene.instruments[i];
    for (std::size_t p = 0; p < instrument.parts.size(); ++p) {
      const InstrumentPart& part = instrument.parts[p];
      world.pieces.push_back({i, static_cast<int>(p), build_instrument_surface(part.mesh, part.closed)});
      thinnest = std::min(thinnest, world.pieces.back().surface.bounds.size().minCoeff());
    }
  }
  for (const Organ& organ : scene.organs) {
    OrganModel model;
    model.rest = build_rest_shape(organ);
    model.restoration = organ.restoration;
    model.colliding_set = organ.colliding_set;
    model.depth = organ.depth;
    model.drag = organ.material.drag;
    // A part flatter than a hundredth of an edge is a sheet: cutting the motion by its thickness would never end.
    model.motion_limit = std::max(std::min(edge_fraction * model.rest.mean_edge, thickness_fraction * thinnest),
                                  0.01 * model.rest.mean_edge);
    for (const InstrumentPiece& piece : world.pieces) {
      model.poking.push_back(sharper_than(piece.surface, sharp * model.rest.mean_edge));
    }
    choose_integrator(scene, organ, model);
    if (model.integrator == Integrator::vertex_block_descent) {
      model.incidence = build_incidence(model.rest);
    } else {
      refuse_if_too_stiff(scene, organ, model.rest);
      pack_elements(model.rest);
      if (!model.rest.tetrahedra.empty()) {
        model.tetrahedra_at = corners_of(model.rest.tetrahedra, model.rest.positions.size());
        for (int& corner : model.tetrahedra_at.items) corner /= 4;
      }
      if (organ.levels_tolerance && organ.model == Model::fem) add_levels(organ, model);
      if (model.levels.empty()) cut_elements(model.rest);
    }
    world.organs.push_back(std::move(model));
  }
  return world;
}

}  // namespace tissue_sim
