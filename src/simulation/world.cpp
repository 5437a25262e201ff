#include "tissue_sim/simulation/world.h"

#include <algorithm>
#include <sstream>

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/geometry/elementary.h"
#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/vertex_block_descent.h"
#include "tissue_sim/tissue/coarse_shell.h"

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

/// Of a wall: in an organ of which a region is more, what is pressed out of the region shows elsewhere. With 0.24 of
/// the bundled liver awake the force was right and the displacement over the whole surface 40 % off.
constexpr double largest_wall_part = 0.2;

/// Bending lengths: radius of a wall's region. On a tube of 30 mm radius, held from behind, with a wall of 4 mm, a ball
/// of 5 mm pressed 4 mm in met a force that was larger by 28-35, 10-13, 2-4 and 0-2 % than that of the same coarse
/// shell all awake, with a radius of 6, 8, 10 and 12 bending lengths: the push goes around the tube, and a dome would
/// do with
/// 4. That shell all awake is too soft there by 9-12 % at a tolerance of 5 %, and by 7-8 % at 3 %. With the two
/// together the force was within 5 % of that of the organ's own mesh all awake: 8 lengths at 5 %, 9 at 3 %, 10 at 2 %.
double wall_region_lengths(double tolerance) {
  return 8.0 + 2.0 * natural_logarithm(0.05 / tolerance);
}

/// To two digits, downwards: what an error says would do must do.
double rounded_down(double x) {
  const double digit = std::pow(10.0, std::floor(std::log10(x)) - 1.0);
  return std::floor(x / digit) * digit;
}

void refuse_if_too_stiff(const Scene& scene, const Organ& organ, const RestShape& rest) {
  const int substeps = substeps_for(rest, scene.time_step);
  if (substeps <= scene.max_substeps) return;
  const double time_step = rest.stable_substep * scene.max_substeps;
  const double softer = square(time_step / scene.time_step);
  std::ostringstream line;
  line.precision(2);
  line << "organ " << organ.name << ": a step of " << scene.time_step << " s needs " << substeps << " substeps of "
       << rest.stable_substep << " s, more than max_substeps: " << scene.max_substeps
       << "; time_step: " << rounded_down(0.999 * time_step)
       << " or material young: " << rounded_down(0.998 * softer * organ.material.young)
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
  if (organ.levels_tolerance && organ.model == Model::fem) {
    model.integrator = Integrator::explicit_substeps;
    model.integrator_reason = "levels move explicitly";
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
  model.fine_edge = fine_edge(model.rest);
  model.shear_modulus = lame_moduli(organ.material.young, organ.material.poisson).mu;
  const RegionSize size = region_size(*organ.levels_tolerance);
  for (std::size_t level = 0; level < model.levels.size(); ++level) {
    const RestShape& shape = level == 0 ? model.rest : model.levels[level - 1].shape;
    const double edge = level == 0 ? model.fine_edge : model.levels[level - 1].edge;
    model.regions.push_back(build_region_model(shape, size.edges * edge, edge));
  }
}

/// Whether every part of the wall is near something that holds it. Else the organ goes aside as a whole when it is
/// pressed, and no part of it has an answer of its own.
bool is_supported(const RestShape& rest, double reach) {
  std::vector<Box> held;
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    if (!rest.attached[v]) continue;
    held.emplace_back();
    held.back().add(rest.positions[v]);
  }
  if (held.empty()) return false;
  AabbTree tree;
  tree.build(held);
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < rest.positions.size(); ++v) {
    Box place;
    place.add(rest.positions[v]);
    bool near = false;
    tree.for_each_near(place.grown(reach), [&](int) { near = true; });
    if (!near) return false;
  }
  return true;
}

/// A part of a wall awake, where the rest of it can be left at rest. What is pushed out of the region pushes the
/// sleeping wall outwards too, so that less of it comes to bear than on a stiff wall.
void add_wall_region(const Organ& organ, OrganModel& model) {
  RestShape& rest = model.rest;
  const double radius = wall_region_lengths(*organ.levels_tolerance) * bending_length(organ);
  double area = 0.0;
  double held = 0.0;
  for (const auto& [a, b, c] : rest.wall_triangles()) {
    const double of_triangle = 0.5 * area_normal(rest.positions[a], rest.positions[b], rest.positions[c]).norm();
    area += of_triangle;
    if (rest.attached[a] && rest.attached[b] && rest.attached[c]) held += of_triangle;
  }
  const double part = 3.14159265358979 * radius * radius / area;
  if (!organ.restoration || part > largest_wall_part || !is_supported(rest, radius)) return;
  model.regions.push_back(build_wall_region_model(rest, radius));
  model.fine_edge = mean_edge_length(rest.positions, rest.wall_topology().edges);
  const double softer = 1.0 / (1.0 + rest.enclosed.stiffness / rest.enclosed.wall * (1.0 - held / area - part));
  rest.enclosed.stiffness *= softer;
  rest.enclosed.damping *= softer;
}

/// Of vertices of a piece those that may poke into a triangle of an organ: not inside another piece of the same
/// instrument, which keeps the organ away from there.
std::vector<int> outside_others(const std::vector<InstrumentPiece>& pieces, const InstrumentPiece& piece,
                                std::vector<int> vertices) {
  for (const InstrumentPiece& other : pieces) {
    if (&other == &piece || other.instrument != piece.instrument || !other.surface.closed) continue;
    const auto inside = [&](int v) {
      return closest_feature(other.surface, piece.surface.vertices[v]).depth > poke_reach;
    };
    vertices.erase(std::remove_if(vertices.begin(), vertices.end(), inside), vertices.end());
  }
  return vertices;
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
      const std::vector<int> vertices = sharper_than(piece.surface, sharp * model.rest.mean_edge);
      model.sharp.push_back(vertices.empty() ? 0 : 1);
      model.poking.push_back(outside_others(world.pieces, piece, vertices));
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
      if (organ.levels_tolerance && organ.model == Model::surface && scene.gravity.isZero())
        add_wall_region(organ, model);
      if (model.regions.empty()) cut_elements(model.rest);
    }
    world.organs.push_back(std::move(model));
  }
  return world;
}

}  // namespace tissue_sim
