#include "tissue_sim/study/stability_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/json_rows.h"
#include "tissue_sim/study/loading.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim {

namespace {

// All lengths below are in edges of the organ's mesh.
constexpr double ball = 1.0;   ///< radius
constexpr double depth = 1.0;  ///< of the press; the solid is three edges thick
constexpr double apart = 0.2;  ///< between the ball and the organ before and after
constexpr double wall_thickness = 0.4;
constexpr int fine = 2;  ///< times as many edges across with levels

constexpr double fastest_press = 0.5;  ///< m/s
constexpr int least_steps = 20;        ///< of the press
constexpr int steps_held = 10;
constexpr int steps_alone = 120;

/// Of the depth. What is pressed is thrown back and swings through without damping, a thin wall about as far as it was
/// pressed; several times that is no motion of the tissue any more.
constexpr double too_far = 4.0;

/// The energy of the symplectic step swings around one that it keeps; what grows on and on exceeds any factor.
constexpr double too_much_growth = 1.5;

/// Of the most energy in the run: less is rounding.
constexpr double no_energy = 1e-9;

/// Pressed from above, held from below.
struct Shape {
  std::string mesh;
  double top = 0.0;
  double bottom = 0.0;
};

void write_msh(const TetrahedralMesh& solid, const std::string& path) {
  std::string out = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(solid.vertices.size()) + "\n";
  int number = 0;
  for (const Vector3& p : solid.vertices) out += text("%d %.9g %.9g %.9g\n", ++number, p.x(), p.y(), p.z());
  out += "$EndNodes\n$Elements\n" + std::to_string(solid.tetrahedra.size()) + "\n";
  number = 0;
  for (const auto& [a, b, c, d] : solid.tetrahedra) {
    out += text("%d 4 2 1 1 %d %d %d %d\n", ++number, a + 1, b + 1, c + 1, d + 1);
  }
  write_text(out + "$EndElements\n", path);
}

/// The organs, in edges, and scene files of them.
class Scenes {
 public:
  Scenes() {
    for (const bool with_levels : {false, true}) {
      const int times = with_levels ? fine : 1;
      const std::string number = std::to_string(times);
      const Vector3 size(4.0 * times, 4.0 * times, 3.0 * times);
      write_msh(make_block(size, {4 * times, 4 * times, 3 * times}), file("block" + number + ".msh"));
      solid_[with_levels] = {"block" + number + ".msh", 0.0, -size.z()};

      TriangleMesh sphere = make_sphere(1.0, 10 * times);
      const MeshTopology topology = build_topology(static_cast<int>(sphere.vertices.size()), sphere.triangles);
      const double radius = 1.0 / mean_edge_length(sphere.vertices, topology.edges);
      for (Vector3& p : sphere.vertices) p *= radius;
      write_obj(sphere, file("sphere" + number + ".obj"));
      hollow_[with_levels] = {"sphere" + number + ".obj", radius, -radius};
    }
  }

  const Shape& shape(const StabilityCell& cell) const { return (is_solid(cell.model) ? solid_ : hollow_)[cell.levels]; }

  /// The file of a cell's scene with another time step.
  std::string write(const StabilityCell& cell, double time_step) const {
    const Shape& organ = shape(cell);
    const double e = cell.edge;
    write_text(text("<robot name=\"ball\"><link name=\"tip\"><collision><geometry><sphere radius=\"%.9g\"/></geometry>"
                    "</collision></link></robot>\n",
                    ball * e),
               file("ball.urdf"));
    std::string scene = text("frame: world\ntime_step: %.9g\norgans:\n  - name: organ\n    mesh: %s\n    scale: %.9g\n",
                             time_step, organ.mesh.c_str(), e);
    scene += text("    model: %s\n    integrator: %s\n", to_string(cell.model), to_string(cell.integrator));
    scene += text("    material: {young: %.9g, poisson: %.9g, density: 1060, damping: %.9g, drag: 0}\n", cell.young,
                  cell.poisson, cell.damping);
    const double held = e * (organ.bottom + 0.2 * (organ.top - organ.bottom));
    const double far = 100.0 * e;
    scene += text("    attachments:\n      - box: {min: [%.9g, %.9g, %.9g], max: [%.9g, %.9g, %.9g]}\n", -far, -far,
                  -far, far, far, held);
    if (cell.model == Model::surface) scene += text("    wall_thickness: %.9g\n", wall_thickness * e);
    if (cell.levels) scene += "    levels: {tolerance: 5%}\n";
    scene += "instruments:\n  - name: ball\n    urdf: ball.urdf\n    tip_link: tip\n    pose_topic: PSM1/measured_cp\n";
    write_text(scene, file("scene.yaml"));
    return file("scene.yaml");
  }

 private:
  std::string file(const std::string& name) const { return (folder_.path / name).string(); }

  TemporaryFolder folder_;
  Shape solid_[2];
  Shape hollow_[2];
};

/// A run of one cell: where the ball goes, and what the organ does.
class Press {
 public:
  Press(const StabilityCell& cell, const Scene& scene, double top, StabilityRow& row)
      : cell_(cell), top_(top), row_(row), timeline_(scene), period_(std::llround(1e9 * scene.time_step)) {
    const OrganView organ = timeline_.organ(0);
    rest_.assign(organ.positions.begin(), organ.positions.end());
    row.simulated = timeline_.summary(0).simulated_vertices;
  }

  /// What went wrong; empty: nothing.
  std::string run() {
    const double seconds = (depth + apart) * cell_.edge / fastest_press;
    const int steps = std::max(least_steps, static_cast<int>(std::ceil(1e9 * seconds / static_cast<double>(period_))));
    for (int i = 0; i <= steps; ++i) step_to(depth * i / steps - apart * (steps - i) / steps);
    for (int i = 0; i < steps_held; ++i) step_to(depth);
    for (int i = steps; i >= 0; --i) step_to(depth * i / steps - apart * (steps - i) / steps);
    step_to(-2.0 * depth);
    std::vector<double> alone;
    for (int i = 0; i < steps_alone && wrong_.empty(); ++i) {
      step_to(-2.0 * depth);
      alone.push_back(energy());
    }
    if (wrong_.empty()) judge(alone);
    return wrong_;
  }

 private:
  void step_to(double deep) {
    if (!wrong_.empty()) return;
    StampedPose pose;
    pose.stamp = stamp_ += period_;
    pose.pose.position = {0.03 * cell_.edge, 0.02 * cell_.edge, (top_ + ball - deep) * cell_.edge};
    timeline_.add_pose(0, pose);
    while (wrong_.empty() && timeline_.step()) look();
  }

  void look() {
    const StepReport& report = timeline_.report();
    row_.substeps = std::max(row_.substeps, report.substeps);
    row_.contacts = std::max(row_.contacts, static_cast<int>(report.contacts.size()));
    if (report.recovered) wrong_ = "the health check put the last good state back";
    const Wrench& wrench = report.wrenches[0];
    bool finite = wrench.force.allFinite() && wrench.torque.allFinite();
    const OrganView organ = timeline_.organ(0);
    for (std::size_t v = 0; v < rest_.size(); ++v) {
      finite = finite && organ.positions[v].allFinite();
      row_.farthest = std::max(row_.farthest, (organ.positions[v] - rest_[v]).norm() / (depth * cell_.edge));
    }
    if (!finite) wrong_ = "not a number";
    if (row_.farthest > too_far) wrong_ = text("a vertex went %.3g times as far as was pressed", row_.farthest);
    most_ = std::max(most_, energy());
  }

  double energy() const { return timeline_.elastic_energy() + timeline_.kinetic_energy(); }

  void judge(const std::vector<double>& alone) {
    const auto quarter = static_cast<std::ptrdiff_t>(alone.size() / 4);
    const double early = *std::max_element(alone.begin(), alone.begin() + quarter);
    const double late = *std::max_element(alone.end() - quarter, alone.end());
    row_.energy = early;
    const double floor = no_energy * most_;
    row_.energy_growth = early + floor > 0.0 ? (late + floor) / (early + floor) : 1.0;
    if (!(row_.energy_growth < too_much_growth)) wrong_ = text("energy grew %.3g times", row_.energy_growth);
    if (row_.contacts == 0) wrong_ = "the ball was not felt";
  }

  const StabilityCell& cell_;
  const double top_;
  StabilityRow& row_;
  Timeline timeline_;
  const std::int64_t period_;  ///< ns
  std::int64_t stamp_ = 1'000'000'000;
  std::vector<Vector3> rest_;
  double most_ = 0.0;  ///< J
  std::string wrong_;
};

/// What went wrong with the time step, a refusal included; empty: nothing. The refusal is also written to `refused`.
std::string press(const Scenes& scenes, const StabilityCell& cell, double time_step, StabilityRow& row,
                  std::string& refused) {
  const std::string file = scenes.write(cell, time_step);
  try {
    std::vector<std::string> warnings;
    const Scene scene = load_scene(file, warnings);
    return Press(cell, scene, scenes.shape(cell).top, row).run();
  } catch (const SceneError& error) {
    refused = error.what();
    if (refused.rfind(file, 0) == 0) refused = "scene" + refused.substr(file.size());  // not where it was for a moment
    return "refused: " + refused;
  }
}

/// s, that a refusal names; 0: it names none.
double step_that_would_do(const std::string& refused) {
  const std::size_t place = refused.find("; time_step: ");
  double step = 0.0;
  return place != std::string::npos && std::sscanf(refused.c_str() + place, "; time_step: %lf", &step) == 1 ? step
                                                                                                            : 0.0;
}

StabilityRow try_cell(const Scenes& scenes, const StabilityCell& cell) {
  StabilityRow row;
  row.cell = cell;
  row.time_step = cell.time_step;
  std::string refused;
  const std::string wrong = press(scenes, cell, cell.time_step, row, refused);
  row.outcome = wrong.empty() ? Outcome::stable : Outcome::neither_of_these;
  row.reason = wrong;
  if (refused.empty()) return row;

  row.reason = refused;
  row.time_step = step_that_would_do(refused);
  if (!(row.time_step > 0.0)) {
    const bool material = refused.find(".poisson: ") != std::string::npos;
    row.outcome = material ? Outcome::other_material : Outcome::neither_of_these;
    return row;
  }
  std::string again;
  const std::string with_other = press(scenes, cell, row.time_step, row, again);
  row.outcome = with_other.empty() ? Outcome::other_step : Outcome::neither_of_these;
  if (!with_other.empty()) row.reason += "; and with that time step: " + with_other;
  return row;
}

std::string name(const StabilityCell& cell) {
  return text("%s, %s%s", to_string(cell.model), to_string(cell.integrator), cell.levels ? ", levels" : "");
}

}  // namespace

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::stable:
      return "stable";
    case Outcome::other_step:
      return "other_step";
    case Outcome::other_material:
      return "other_material";
    case Outcome::neither_of_these:
      return "neither";
  }
  return "?";
}

std::vector<StabilityCell> stability_cells(bool quick) {
  std::vector<StabilityCell> kinds;
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    for (const Model model : {Model::contact_only, Model::surface, Model::volume, Model::fem}) {
      kinds.push_back({model, integrator});
    }
  }
  kinds.push_back({Model::surface, Integrator::explicit_substeps, true});
  kinds.push_back({Model::fem, Integrator::explicit_substeps, true});

  std::vector<StabilityCell> cells;
  for (StabilityCell cell : kinds) {
    const bool simulated = cell.model != Model::contact_only;
    // What simulates nothing has no use for a material, and levels take meshes eight times as large.
    const bool few = cell.levels;
    using Numbers = std::vector<double>;
    for (const double young : !simulated ? Numbers{500.0} : few ? Numbers{500.0, 1e6} : Numbers{500.0, 6e3, 8e4, 1e6}) {
      for (const double poisson : !simulated ? Numbers{0.4} : few ? Numbers{0.4, 0.499} : Numbers{0.25, 0.4, 0.499}) {
        for (const double damping : !simulated ? Numbers{0.0} : few ? Numbers{0.0, 1.0} : Numbers{0.0, 0.1, 1.0}) {
          for (const double edge : {0.0002, 0.002, 0.020}) {
            for (const double time_step : {0.0001, 0.001, 0.010, 0.050}) {
              cell.young = young;
              cell.poisson = poisson;
              cell.time_step = time_step;
              cell.damping = damping;
              cell.edge = edge;
              cells.push_back(cell);
            }
          }
        }
      }
    }
  }
  if (!quick) return cells;
  constexpr std::size_t stride = 47;  // a prime: no number of one list is met more often than another
  std::vector<StabilityCell> some;
  for (std::size_t i = 0; i < cells.size(); i += stride) some.push_back(cells[i]);
  return some;
}

std::vector<StabilityRow> map_stability(const std::vector<StabilityCell>& cells, std::FILE* progress) {
  const Scenes scenes;
  std::vector<StabilityRow> rows;
  for (const StabilityCell& cell : cells) {
    rows.push_back(try_cell(scenes, cell));
    if (progress != nullptr && rows.size() % 100 == 0) {
      std::fprintf(progress, "%zu of %zu cells\n", rows.size(), cells.size());
    }
  }
  return rows;
}

std::string stability_json(const std::vector<StabilityRow>& rows, const std::string& command) {
  JsonRows json;
  for (const StabilityRow& row : rows) {
    const StabilityCell& cell = row.cell;
    std::string line = text("\"model\": \"%s\", \"integrator\": \"%s\", \"levels\": %s, ", to_string(cell.model),
                            to_string(cell.integrator), cell.levels ? "true" : "false");
    line += text("\"young\": %g, \"poisson\": %g, \"time_step\": %g, \"damping\": %g, \"edge\": %g, ", cell.young,
                 cell.poisson, cell.time_step, cell.damping, cell.edge);
    line += text("\"outcome\": \"%s\", \"stable_with\": %g, \"substeps\": %d, \"simulated\": %d, \"contacts\": %d, ",
                 to_string(row.outcome), row.time_step, row.substeps, row.simulated, row.contacts);
    line += text("\"farthest\": %.4g, \"energy\": %.4g, \"energy_growth\": %.4g, ", row.farthest, row.energy,
                 row.energy_growth);
    std::string reason;
    for (const char c : row.reason) reason += c == '"' || c == '\\' ? '\'' : c;
    json.add(line + "\"reason\": \"" + reason + "\"");
  }
  return text("{\n  \"command\": \"%s\",\n  \"rows\": [", command.c_str()) + json.rows + "\n  ]\n}\n";
}

std::string stability_table(const std::vector<StabilityRow>& rows, const std::string& command) {
  struct Count {
    int cells = 0;
    std::map<Outcome, int> of;
    double least_step = 1e300;  ///< s, of those that refusals named
    int substeps = 0;
    double farthest = 0.0;
    double growth = 0.0;
  };
  std::vector<std::string> names;
  std::map<std::string, Count> counts;
  for (const StabilityRow& row : rows) {
    const std::string kind = name(row.cell);
    if (counts.count(kind) == 0) names.push_back(kind);
    Count& count = counts[kind];
    ++count.cells;
    ++count.of[row.outcome];
    if (row.outcome == Outcome::other_step) count.least_step = std::min(count.least_step, row.time_step);
    count.substeps = std::max(count.substeps, row.substeps);
    count.farthest = std::max(count.farthest, row.farthest);
    count.growth = std::max(count.growth, row.energy_growth);
  }
  std::string table = "`" + command + "`\n\n" +
                      "| model | cells | stable | stable with the step that the refusal names | least of them, ms | "
                      "material refused | neither | most substeps | farthest, of the depth | growth of energy |\n"
                      "|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string& kind : names) {
    Count& count = counts[kind];
    table += text("| %s | %d | %d | %d | %s | %d | %d | %d | %.2f | %.3f |\n", kind.c_str(), count.cells,
                  count.of[Outcome::stable], count.of[Outcome::other_step],
                  count.of[Outcome::other_step] > 0 ? text("%.3g", 1e3 * count.least_step).c_str() : "",
                  count.of[Outcome::other_material], count.of[Outcome::neither_of_these], count.substeps,
                  count.farthest, count.growth);
  }
  for (const StabilityRow& row : rows) {
    if (row.outcome != Outcome::neither_of_these) continue;
    const StabilityCell& cell = row.cell;
    table += text("\nneither: %s, young %g Pa, poisson %g, damping %g, edge %g m, time_step %g s: ", name(cell).c_str(),
                  cell.young, cell.poisson, cell.damping, cell.edge, cell.time_step) +
             row.reason;
  }
  return table + "\n";
}

}  // namespace tissue_sim
