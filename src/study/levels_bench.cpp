#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/resource_path.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "tissue_sim/simulation/levels.h"
#include "tissue_sim/simulation/step.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/measuring.h"
#include "tissue_sim/study/refinement.h"

namespace tissue_sim {

namespace {

constexpr double tolerance = 0.05;
constexpr double fine = 0.002;          // m, the mean edge where the probe presses
constexpr double longest_edge = 1.5;    // of the mean one, about, when refine() is done
constexpr double fine_within = 0.030;   // m, of the line that the probe slides along
constexpr double grading = 0.3;         // m of edge a metre farther out
constexpr double probe_radius = 0.003;  // m
constexpr double depth = 0.005;         // m
constexpr double slide = 0.020;         // m
constexpr double duration = 0.001;      // s, a step
constexpr int steps_down = 100;
constexpr int steps_at_rest = 400;
constexpr int steps_of_slide = 400;  // at 50 mm/s
constexpr int a_turn = 50;           // steps that one way goes before it is the other's turn: each finds its own cache
constexpr int starting = 20;         // steps of the slide that the force is not looked at in: it starts with a jerk

/// Where the recording first touches, and the way out of the organ there.
struct Place {
  Vector3 point;
  Vector3 outward;
};

struct Case {
  Scene scene;
  Place first;
  Place last;

  /// It leans as the surface does, without a turn about itself.
  Pose at(double along, double in) const {
    const Vector3 outward = ((1.0 - along) * first.outward + along * last.outward).normalized();
    const Vector3 point = (1.0 - along) * first.point + along * last.point;
    const auto upright = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), -first.outward);
    return {point - in * outward, Eigen::Quaterniond::FromTwoVectors(-first.outward, -outward) * upright};
  }
};

/// Where the tip has slid so far, 5 mm deep: over the bulge of the organ, on the surface, it is a longer way.
Place end_of_slide(const InstrumentSurface& surface, const Place& first) {
  const auto place = [&](double way) {
    const ClosestFeature closest = closest_feature(surface, first.point + way * Vector3(1.0, 0.0, 0.5));
    return Place{closest.point, closest.direction};
  };
  double enough = 2.0 * slide;
  double too_short = 0.0;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle = 0.5 * (too_short + enough);
    const Place last = place(middle);
    const Vector3 moved = last.point - depth * last.outward - (first.point - depth * first.outward);
    (moved.norm() < slide ? too_short : enough) = middle;
  }
  return place(enough);
}

/// The bundled liver as a solid, held at its underside as in config/scenes/demo.yaml, under the bundled probe. `mesh`:
/// its tetrahedra, fine where it is pressed; empty: the bundled ones, cut there until they are.
Case liver_under_probe(const std::string& config, const std::string& mesh) {
  std::vector<std::string> warnings;
  Case made;
  Organ liver;
  liver.name = "liver";
  liver.model = Model::fem;
  liver.integrator = Integrator::explicit_substeps;
  liver.material = {5400.0, 0.45, 1060.0, 0.1, 20.0};
  liver.solid = read_tetrahedral_mesh(config + "/organs/liver_12.msh", 0.001, warnings);
  const InstrumentSurface surface = build_instrument_surface(take_surface(liver.solid), true);
  const ClosestFeature first = closest_feature(surface, {-0.045, -0.005, 0.05});
  made.first = {first.point, first.direction};
  made.last = end_of_slide(surface, made.first);
  if (!mesh.empty()) liver.solid = read_tetrahedral_mesh(mesh, 0.001, warnings);
  const auto longest = [&](const Vector3& p) {
    const Vector3 along = made.last.point - made.first.point;
    const double part = std::clamp((p - made.first.point).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const double away = (p - made.first.point - part * along).norm();
    return longest_edge * fine + grading * std::max(0.0, away - fine_within);
  };
  if (mesh.empty()) refine(liver.solid, longest);
  sort_vertices_for_locality(liver.solid);
  liver.mesh = take_surface(liver.solid);
  sort_for_locality(liver.solid);
  for (int v = 0; v < static_cast<int>(liver.solid.vertices.size()); ++v) {
    const Vector3& p = liver.solid.vertices[v];
    const double top = p.x() < -0.03 ? -0.032 : p.x() < 0.03 ? -0.022 : -0.014;
    if (p.z() < top) liver.attached.push_back(v);
  }
  Instrument probe;
  probe.name = "probe";
  probe.parts = load_instrument(config + "/instruments/probe.urdf", "tip", warnings);
  made.scene.frame = "world";
  made.scene.time_step = duration;
  made.scene.max_substeps = 10'000;
  made.scene.organs.push_back(std::move(liver));
  made.scene.instruments.push_back(std::move(probe));
  return made;
}

/// Of the organ's own; none where there are no levels.
int awake_tetrahedra(const Workspace& workspace) {
  const std::vector<AwakeSolid>& awake = workspace.organs.front().levels.awake;
  return awake.empty() ? 0 : static_cast<int>(awake.front().packed.tetrahedra);
}

/// One of the two ways to simulate the case, step by step.
struct Way {
  World world;
  State state;
  Workspace workspace;
  StepReport report;
  std::vector<double> forces;        ///< N, a step
  std::vector<double> milliseconds;  ///< of the processor, a step
  StepProfile sum;
  int recoveries = 0;
  int tetrahedra = 0;  ///< of the organ's own, awake at once

  explicit Way(const Scene& scene)
      : world(build_world(scene)), state(rest_state(world)), workspace(build_workspace(world)) {}

  void go(const Pose& from, const Pose& to) {
    const Motion motion = {duration, {{true, from, to}}};
    ++report.step;
    const double start = processor_seconds();
    step(world, motion, state, workspace, report);
    milliseconds.push_back(1e3 * (processor_seconds() - start));
    forces.push_back(report.wrenches.front().force.norm());
    recoveries += report.recovered ? 1 : 0;
    add(report.profile, 1.0, sum);
    tetrahedra = std::max(tetrahedra, awake_tetrahedra(workspace));
  }

  std::vector<Vector3> displacements() {
    const RestShape& rest = world.organs.front().rest;
    place_surface(world.organs.front(), state.organs.front());
    std::vector<Vector3> moved;
    moved.reserve(static_cast<std::size_t>(rest.surface_vertices));
    for (int v = 0; v < rest.surface_vertices; ++v) {
      moved.push_back(state.organs.front().positions[v] - rest.positions[v]);
    }
    return moved;
  }
};

/// Both go along the path from `from` on.
void go_in_turns(const std::vector<Pose>& path, const Pose& from, Way& awake, Way& levels) {
  for (std::size_t first = 0; first < path.size(); first += a_turn) {
    const std::size_t last = std::min(path.size(), first + a_turn);
    for (Way* way : {&awake, &levels}) {
      for (std::size_t i = first; i < last; ++i) way->go(i == 0 ? from : path[i - 1], path[i]);
    }
  }
}

double largest_jump(const std::vector<double>& forces) {
  double largest = 0.0;
  for (std::size_t i = 1; i < forces.size(); ++i) {
    largest = std::max(largest, std::abs(forces[i] - forces[i - 1]) / forces[i - 1]);
  }
  return largest;
}

/// rms of the difference over rms of what is right, of the surface within `reach` of `place`.
double displacement_error(const RestShape& rest, const std::vector<Vector3>& ours, const std::vector<Vector3>& right,
                          const Vector3& place, double reach) {
  double difference = 0.0;
  double whole = 0.0;
  for (std::size_t v = 0; v < ours.size(); ++v) {
    if (!((rest.positions[v] - place).norm() < reach)) continue;
    difference += (ours[v] - right[v]).squaredNorm();
    whole += right[v].squaredNorm();
  }
  return std::sqrt(difference / whole);
}

void print_levels(const OrganModel& model) {
  std::printf("level       edge mm  tetrahedra  radius mm\n");
  for (std::size_t level = 0; level <= model.levels.size(); ++level) {
    const bool own = level == 0;
    std::printf("%-10s  %7.2f  %10zu  %9.1f\n", own ? "the organ" : "coarser",
                1e3 * (own ? model.fine_edge : model.levels[level - 1].edge),
                own ? model.rest.tetrahedra.size() : model.levels[level - 1].shape.tetrahedra.size(),
                level < model.regions.size() ? 1e3 * model.regions[level].radius : 0.0);
  }
}

}  // namespace

bool bench_levels(BenchWords& words, JsonRows& json) {
  const std::string mesh = words.take_value("--solid");
  if (!words.words.empty()) return false;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string scene = resolve_path("package://tissue_sim/config/scenes/demo.yaml", program);
  const std::string config = std::filesystem::path(scene).parent_path().parent_path().string();
  Case given = liver_under_probe(config, mesh);
  Way awake(given.scene);
  given.scene.organs.front().levels_tolerance = tolerance;
  Way levels(given.scene);
  const OrganModel& model = levels.world.organs.front();
  std::printf(
      "The bundled liver as a solid, edges of 2 mm near the contact; the bundled probe (3 mm) 5 mm deep, then 20 mm at "
      "50 mm/s, 1 kHz.\nWith levels, tolerance %g %%, and with everything awake, %d steps in turn; one core, time of "
      "the processor\n\n",
      100.0 * tolerance, a_turn);
  print_levels(model);
  if (model.levels.empty()) {
    std::printf("A region would be most of the organ: there are no levels\n");
    return true;
  }

  Pose at = given.at(0.0, -0.0002);
  std::vector<Pose> path;
  for (int i = 1; i <= steps_down; ++i) path.push_back(given.at(0.0, depth * i / steps_down));
  path.insert(path.end(), steps_at_rest, given.at(0.0, depth));
  go_in_turns(path, at, awake, levels);
  const double force_error = levels.forces.back() / awake.forces.back() - 1.0;
  const double force = awake.forces.back();
  const std::vector<Vector3> ours = levels.displacements();
  const std::vector<Vector3> right = awake.displacements();
  const double near = displacement_error(model.rest, ours, right, given.first.point, 2.0 * probe_radius);
  const double whole = displacement_error(model.rest, ours, right, given.first.point, 1e3);

  for (Way* way : {&awake, &levels}) {
    way->forces.clear();
    way->milliseconds.clear();
    way->sum = StepProfile();
  }
  at = path.back();
  path.clear();
  for (int i = 1; i <= steps_of_slide; ++i) {
    path.push_back(given.at(static_cast<double>(i) / steps_of_slide, depth));
  }
  go_in_turns(path, at, awake, levels);
  double mean = 0.0;
  double worst = 0.0;
  for (Way* way : {&awake, &levels}) way->forces.erase(way->forces.begin(), way->forces.begin() + starting);
  for (std::size_t i = 0; i < levels.forces.size(); ++i) {
    const double error = levels.forces[i] / awake.forces[i] - 1.0;
    mean += error / static_cast<double>(levels.forces.size());
    worst = std::max(worst, std::abs(error));
  }
  const double median = percentile(levels.milliseconds, 0.5);
  const double median_awake = percentile(awake.milliseconds, 0.5);

  std::printf("\ntetrahedra  awake    ms a step  99th   everything awake  99th   ratio  substeps  of all awake\n");
  std::printf("%10zu  %7d  %9.3f  %5.2f  %16.3f  %5.2f  %5.1f  %8d  %12d\n", model.rest.tetrahedra.size(),
              levels.tetrahedra, median, percentile(levels.milliseconds, 0.99), median_awake,
              percentile(awake.milliseconds, 0.99), median_awake / median, levels.report.substeps,
              awake.report.substeps);
  std::printf("\n                  refit  detection  response  deformation  health, mean ms of wall time\n");
  for (const Way* way : {&levels, &awake}) {
    const double a = 1e3 / steps_of_slide;
    std::printf("%-16s  %5.3f  %9.3f  %8.3f  %11.3f  %6.3f\n", way == &levels ? "levels" : "everything awake",
                a * way->sum.refit, a * way->sum.detection, a * way->sum.response, a * way->sum.deformation,
                a * way->sum.health);
  }
  std::printf("\nagainst everything awake                  error %%\n");
  std::printf("force at rest (%.4f N)                  %8.2f\n", force, 100.0 * force_error);
  std::printf("force in the slide, mean                  %8.2f\n", 100.0 * mean);
  std::printf("force in the slide, worst                 %8.2f\n", 100.0 * worst);
  std::printf("displacement within 2 radii               %8.2f\n", 100.0 * near);
  std::printf("displacement of the whole surface         %8.2f\n", 100.0 * whole);
  std::printf("largest jump of the force in a step       %8.2f, everything awake %.2f\n",
              100.0 * largest_jump(levels.forces), 100.0 * largest_jump(awake.forces));
  if (levels.recoveries + awake.recoveries > 0) {
    std::printf("steps undone by the health check: %d, everything awake %d\n", levels.recoveries, awake.recoveries);
  }
  json.add(
      text("\"tetrahedra\": %zu, \"awake_tetrahedra\": %d, \"ms_per_step\": %.6g, \"ms_99th\": %.6g, "
           "\"awake_ms_per_step\": %.6g, \"awake_ms_99th\": %.6g, \"ratio\": %.6g, \"substeps\": %d, "
           "\"force_n\": %.6g, \"force_error\": %.6g, \"slide_error_mean\": %.6g, \"slide_error_worst\": %.6g, "
           "\"near_error\": %.6g, \"surface_error\": %.6g, \"jump\": %.6g, \"awake_jump\": %.6g, "
           "\"recoveries\": %d",
           model.rest.tetrahedra.size(), levels.tetrahedra, median, percentile(levels.milliseconds, 0.99), median_awake,
           percentile(awake.milliseconds, 0.99), median_awake / median, levels.report.substeps, force, force_error,
           mean, worst, near, whole, largest_jump(levels.forces), largest_jump(awake.forces),
           levels.recoveries + awake.recoveries));
  return true;
}

}  // namespace tissue_sim
