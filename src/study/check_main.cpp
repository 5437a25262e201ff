#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/simulation/accuracy.h"
#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/press_cost.h"
#include "tissue_sim/tissue/coarse_shell.h"

namespace {

using namespace tissue_sim;

constexpr const char* usage =
    "usage: tissue_sim_check SCENE\n"
    "  Loads a scene file and says what will be modelled, what is off and what it costs.\n"
    "  Answers 0; 1 with the error on one line if the scene cannot be used; 2 if the arguments are wrong.\n";

constexpr double timed_seconds = 0.25;  // of wall time, for each cost of a step
constexpr int timed_passes = 15;        // over the elements of one kind

void row(const char* name, const std::string& value) {
  std::printf("  %-22s %s\n", name, value.c_str());
}

template <typename... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

std::string size_text(const TriangleMesh& mesh) {
  const Vector3 size = bounds_of(mesh.vertices).size();
  return text("%.4g x %.4g x %.4g m", size.x(), size.y(), size.z());
}

std::string size_of(std::size_t bytes) {
  return text("%.4g kB", 1e-3 * static_cast<double>(bytes));
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The median of a few passes, s.
template <class Pass>
double time_passes(Pass pass) {
  std::vector<double> spent;
  for (int i = 0; i < timed_passes; ++i) {
    const auto start = std::chrono::steady_clock::now();
    pass();
    spent.push_back(seconds_since(start));
  }
  std::nth_element(spent.begin(), spent.begin() + timed_passes / 2, spent.end());
  return spent[timed_passes / 2];
}

/// The elements of one kind alone, as the explicit integrator has them: s a substep.
double time_elements(RestShape& rest) {
  pack_elements(rest);
  OrganState state;
  state.positions = rest.positions;
  state.velocities.assign(rest.positions.size(), Vector3::Zero());
  state.forces = state.velocities;
  ElementRoom room;
  prepare(room, rest);
  return time_passes([&] { element_forces(rest, state, state.forces, room); });
}

/// `off`, or how many there are and what they cost.
std::string elements_text(std::size_t count, std::size_t bytes, const OrganSummary& summary, RestShape& alone) {
  if (count == 0) return "off";
  const std::string stored = text("on: %zu, ", count) + size_of(bytes);
  if (summary.integrator != Integrator::explicit_substeps) return stored + ", their time is the integrator's";
  return stored + text(", %.3g ms a step", 1e3 * summary.substeps * time_elements(alone));
}

template <class Item>
std::size_t bytes(const std::vector<Item>& items) {
  return items.size() * sizeof(Item);
}

/// What the organ's model stores and steps, each as off, or on with its cost on this machine.
void print_features(const Organ& organ, const OrganSummary& summary) {
  // Each kind is put back alone, for its time. Moved, not copied: an organ of a million triangles has half a gigabyte.
  RestShape alone = build_rest_shape(organ);
  auto tetrahedra = std::move(alone.tetrahedra);
  auto distances = std::move(alone.distances);
  auto areas = std::move(alone.areas);
  auto volumes = std::move(alone.volumes);
  const EnclosedVolume enclosed = std::exchange(alone.enclosed, {});
  alone.tetrahedra.clear();
  alone.distances.clear();
  alone.areas.clear();
  alone.volumes.clear();

  alone.tetrahedra.swap(tetrahedra);
  const std::size_t packed = sizeof(NeoHookeanBatch) / NeoHookeanBatch::lanes * alone.tetrahedra.size();
  row("tetrahedra", organ.model == Model::volume
                        ? text("on: %d, as distance and volume elements", summary.tetrahedra)
                        : elements_text(alone.tetrahedra.size(), bytes(alone.tetrahedra) + packed, summary, alone));
  alone.tetrahedra.swap(tetrahedra);
  alone.distances.swap(distances);
  row("distance elements", elements_text(alone.distances.size(), bytes(alone.distances), summary, alone));
  alone.distances.swap(distances);
  alone.areas.swap(areas);
  row("area elements", elements_text(alone.areas.size(), bytes(alone.areas), summary, alone));
  alone.areas.swap(areas);
  alone.volumes.swap(volumes);
  row("volume elements", elements_text(alone.volumes.size(), bytes(alone.volumes), summary, alone));
  alone.volumes.swap(volumes);
  alone.enclosed = enclosed;
  row("enclosed volume", elements_text(summary.enclosed_volume ? 1 : 0, sizeof enclosed, summary, alone));
  row("plastic state", summary.plastic ? "on: " + size_of(alone.positions.size()) : "off");
  std::vector<Vector3> positions = alone.positions;
  row("embedded surface", !summary.embedded
                              ? "off"
                              : text("on: %d vertices carried, %.3g ms where all are shown", alone.first_simulated,
                                     1e3 * time_passes([&] { carry_surface(alone, positions); })));
}

/// The level that is simulated in place of a hollow organ's mesh, or why there is none.
std::string shell_text(const Organ& organ, const OrganSummary& summary) {
  if (!organ.levels_tolerance) return "off";
  const double tolerance = 100.0 * *organ.levels_tolerance;
  if (summary.shell_triangles > 0) {
    return text("on: %d triangles of %.1f mm, tolerance %.3g %%", summary.shell_triangles, 1e3 * summary.shell_edge,
                tolerance);
  }
  return text("off: a tolerance of %.3g %% allows edges of %.1f mm, hardly longer than those of the mesh", tolerance,
              1e3 * shell_edge(organ));
}

/// The levels of a solid, a row each, or why there are none.
void print_levels(const Organ& organ, const OrganSummary& summary) {
  if (!organ.levels_tolerance) return row("levels", "off");
  const double tolerance = 100.0 * *organ.levels_tolerance;
  if (summary.levels.empty()) {
    return row(
        "levels",
        text("off: for a tolerance of %.3g %% the tetrahedra around a contact would be most of the organ", tolerance));
  }
  row("levels", text("on: %zu, tolerance %.3g %%", summary.levels.size(), tolerance));
  for (const LevelSummary& level : summary.levels) {
    const std::string awake =
        level.radius > 0.0 ? text("awake within %.1f mm of a contact", 1e3 * level.radius) : "all awake";
    row("", text("%d tetrahedra of %.1f mm, ", level.tetrahedra, 1e3 * level.edge) + awake);
  }
}

void print_organ(const Organ& organ, const OrganSummary& summary) {
  const bool stepped = organ.model != Model::contact_only;
  std::printf("organ %s\n", organ.name.c_str());
  row("model", to_string(organ.model));
  row("restoration", !stepped ? "off (no deformation)" : organ.restoration ? "on (elastic)" : "off (plastic)");
  row("colliding set", to_string(organ.colliding_set));
  row("depth", to_string(organ.depth));
  row("mesh", text("%d vertices, %d triangles, %d surface(s)", summary.vertices, summary.triangles,
                   inspect(organ.mesh).components));
  if (organ.model == Model::surface) row("coarse shell", shell_text(organ, summary));
  if (organ.model == Model::fem) print_levels(organ, summary);
  row("size", size_text(organ.mesh));
  row("volume", text("%.4g litres", 1000.0 * enclosed_volume(organ.mesh)));
  row("memory", size_of(summary.memory));
  row("attachments", summary.attached > 0 ? text("on: %d vertices", summary.attached) : "off, the organ can drift");
  print_features(organ, summary);
  row("integrator", stepped ? std::string(to_string(summary.integrator)) + ": " + summary.integrator_reason : "off");
  if (!stepped) return;
  row("simulated vertices", std::to_string(summary.simulated_vertices));
  row("substeps", text("%d a step, the stable one is %.3g s", summary.substeps, summary.stable_substep));
  row("material", text("young %.4g Pa, poisson %.4g, density %.4g kg/m^3, wall %.4g m", organ.material.young,
                       organ.material.poisson, organ.material.density, organ.wall_thickness));
  row("damping, drag", text("%.4g of critical, %.4g 1/s", organ.material.damping, organ.material.drag));
  row("mass", text("%.4g kg", summary.mass));
  row("mass floor", summary.added_mass > 0.0 ? text("on: %.3g kg added, %.2f %%", summary.added_mass,
                                                    100.0 * summary.added_mass / summary.mass)
                                             : "off");
}

void print_instrument(const Instrument& instrument) {
  std::printf("instrument %s\n", instrument.name.c_str());
  row("pose", "link " + instrument.tip_link + " by topic " + instrument.pose_topic);
  for (const InstrumentPart& part : instrument.parts) {
    row(("part " + part.link).c_str(),
        text("%zu triangles, %s, ", part.mesh.triangles.size(), part.closed ? "closed" : "open or non-manifold") +
            size_text(part.mesh));
  }
}

/// What is made for those who listen only.
void print_outputs(const Scene& scene) {
  std::size_t vertices = 0, triangles = 0;
  for (const Organ& organ : scene.organs) {
    vertices += organ.mesh.vertices.size();
    triangles += organ.mesh.triangles.size();
  }
  std::printf("outputs\n");
  row("states", size_of(4 * sizeof(float) * vertices) + " a state period, built only while somebody subscribes");
  row("markers", size_of(3 * (3 * sizeof(double) + 4 * sizeof(float)) * triangles) +
                     " a state period, built only while somebody subscribes");
  row("force", "part of the response below, computed only while somebody subscribes");
  row("tf transforms", "asked for only when a pose's frame is not " + scene.frame);
}

void print_cost(const Scene& scene) {
  std::printf("cost on this machine, median of the steps of %.4g s in %.2g s\n", scene.time_step, timed_seconds);
  const auto cost = [&](double seconds) {
    return text("%.3f ms a step, %.2f of real time", 1e3 * seconds, seconds / scene.time_step);
  };
  {
    Timeline apart(scene);
    row("instrument away", cost(time_apart(scene, timed_seconds, apart)));
  }
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    Timeline timeline(scene);
    const PressCost press = time_press(scene, static_cast<int>(o), timed_seconds, timeline);
    const StepProfile& p = press.profile;
    row("instrument pressing", cost(press.step) + " (" + scene.instruments[0].name + ", up to " +
                                   text("%.0f mm into the free side of ", 1e3 * timed_press) + scene.organs[o].name +
                                   text(", %d steps in contact)", press.steps));
    row("  of it", text("contact %.3f, response and force %.3f, deformation %.3f, health %.3f ms in the mean",
                        1e3 * (p.refit + p.detection + p.penetration + p.propagation), 1e3 * p.response,
                        1e3 * p.deformation, 1e3 * p.health));
  }
}

void print_choices(const Accuracy& accuracy, const std::vector<ModelChoice>& choices) {
  if (accuracy.goal == Accuracy::Goal::none) {
    row("accuracy", "off, every organ names its model");
  } else if (accuracy.goal == Accuracy::Goal::budget) {
    row("accuracy", text("at most %.4g ms a step", 1e3 * accuracy.value));
  } else {
    row("accuracy", text("an error of at most %.4g %%", 100.0 * accuracy.value));
  }
  for (const ModelChoice& choice : choices) {
    row("chosen", to_text(choice));
    for (const std::string& rejected : choice.rejected) row("  not", rejected);
  }
}

void check(const std::string& path) {
  std::vector<std::string> warnings;
  std::vector<ModelChoice> choices;
  const Scene scene = load_chosen_scene(path, warnings, choices);
  for (const std::string& warning : warnings) std::printf("warning: %s\n", warning.c_str());
  const std::vector<OrganSummary> summaries = [&] {
    try {
      const Timeline timeline(scene);
      std::vector<OrganSummary> all;
      for (std::size_t o = 0; o < scene.organs.size(); ++o) all.push_back(timeline.summary(static_cast<int>(o)));
      return all;
    } catch (const SceneError& error) {
      throw SceneError(path + ": " + error.what());
    }
  }();
  std::printf("scene %s\n", path.c_str());
  row("frame", scene.frame);
  row("gravity", scene.gravity.isZero()
                     ? "off"
                     : text("%.4g %.4g %.4g m/s^2", scene.gravity.x(), scene.gravity.y(), scene.gravity.z()));
  row("time step", text("%.4g s, at most %d substeps", scene.time_step, scene.max_substeps));
  print_choices(scene.accuracy, choices);
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    print_organ(scene.organs[o], summaries[o]);
  }
  for (const Instrument& instrument : scene.instruments) print_instrument(instrument);
  print_outputs(scene);
  print_cost(scene);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string argument = argc == 2 ? argv[1] : "";
  if (argument == "--help" || argument == "-h") {
    std::fputs(usage, stdout);
    return 0;
  }
  if (argument.empty() || argument[0] == '-') {
    std::fputs(usage, stderr);
    return 2;
  }
  try {
    check(argument);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
