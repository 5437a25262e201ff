#include "tissue_sim/simulation/accuracy.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>

#include "../scene/yaml_mapping.h"
#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/scene/resource_path.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/press_cost.h"

namespace tissue_sim {

namespace {

constexpr const char* table_file = "package://tissue_sim/config/accuracy.yaml";

constexpr double timed_seconds = 0.25;  ///< of wall time, for each candidate

bool not_negative(double x) {
  return x >= 0.0;
}

std::string percent(double part) {
  std::ostringstream text;
  if (std::isfinite(part)) {
    text << std::fixed << std::setprecision(part < 0.0995 ? 1 : 0) << 100.0 * part << " %";
  } else {
    text << "unknown";
  }
  return text.str();
}

std::string milliseconds(double seconds) {
  std::ostringstream text;
  text.precision(3);
  text << 1e3 * seconds << " ms";
  return text.str();
}

/// An alternative with all that was found out about it.
struct Assessed {
  Candidate candidate;
  SceneCost cost;
  std::string name;  ///< `fem on liver_fine.msh, explicit`
};

std::string name_of(const Alternative& alternative, Integrator integrator) {
  std::string name = to_string(alternative.organ.model);
  if (!alternative.solid.empty()) name += " on " + alternative.solid;
  if (alternative.organ.model != Model::contact_only) name += std::string(", ") + to_string(integrator);
  return name;
}

std::string figures(const Candidate& candidate) {
  return "expected error " + percent(candidate.expected_error) + ", " + milliseconds(candidate.cost) + " a step";
}

Assessed assess(const Scene& scene, const Alternative& alternative, const AccuracyTable& table,
                const MeasureCost& measure) {
  Scene alone = scene;
  alone.organs = {alternative.organ};
  alone.alternatives.clear();
  Assessed assessed;
  assessed.cost = measure(alone);
  assessed.name = name_of(alternative, assessed.cost.integrator);
  assessed.candidate.cost = assessed.cost.step;
  assessed.candidate.possible = assessed.cost.refused.empty();
  assessed.candidate.expected_error = expected_error(table, alternative.organ.model, assessed.cost.integrator,
                                                     relative_edges(alternative.organ, scene.instruments));
  return assessed;
}

/// `0.8 ms a step` or `5 %`
std::string limit_text(Accuracy::Goal goal, double limit) {
  return goal == Accuracy::Goal::budget ? milliseconds(limit) + " a step" : percent(limit);
}

[[noreturn]] void refuse(const Scene& scene, const std::string& organ, const std::vector<Assessed>& all, double limit) {
  const Accuracy& accuracy = scene.accuracy;
  const bool budget = accuracy.goal == Accuracy::Goal::budget;
  const Assessed* best = nullptr;
  bool solid = false;
  for (const Assessed& each : all) {
    solid = solid || each.name.find(" on ") != std::string::npos;
    if (!each.candidate.possible) continue;
    const bool better = best == nullptr || (budget ? each.candidate.cost < best->candidate.cost
                                                   : each.candidate.expected_error < best->candidate.expected_error);
    if (better) best = &each;
  }
  if (best == nullptr)
    throw SceneError(accuracy.place + "no model of organ " + organ + " works: " + all[0].cost.refused);
  std::ostringstream line;
  line.precision(3);
  line << accuracy.place << "no model of organ " << organ << " keeps to " << limit_text(accuracy.goal, limit);
  const std::size_t organs = scene.organs.size();
  if (budget && organs > 1) line << " (a part of " << organs << " equal ones)";
  line << ": the " << (budget ? "cheapest" : "best") << " there is, " << best->name << ", has "
       << figures(best->candidate) << "; ";
  if (budget) {
    const double enough = 1e3 * best->candidate.cost * (1.0 + cost_margin) * static_cast<double>(organs);
    line << "give budget_ms: " << 1.05 * enough << " or more, or a coarser mesh";
  } else if (std::isfinite(best->candidate.expected_error)) {
    const double error = best->candidate.expected_error;
    const double tenths = error < 0.0995 ? 1.0 : 10.0;  // rounded up, as many digits as percent() shows
    line << "allow error: " << 0.1 * tenths * std::ceil(1e3 * error / tenths) << "%, or give the organ a "
         << (solid ? "finer solid" : "solid") << " (scripts/make_solid)";
  } else {
    line << "config/accuracy.yaml has no error for it, name a model";
  }
  throw SceneError(line.str());
}

std::string why_not(const Assessed& assessed, Accuracy::Goal goal, double limit) {
  if (!assessed.candidate.possible) return assessed.name + ": " + assessed.cost.refused;
  const std::string start = assessed.name + ": " + figures(assessed.candidate);
  if (fits(assessed.candidate, goal, limit)) {
    return start + (goal == Accuracy::Goal::budget ? ", less exact" : ", more costly");
  }
  return start + ", does not keep to " + limit_text(goal, limit);
}

SceneCost time_on_this_machine(const Scene& scene) {
  SceneCost cost;
  try {
    Timeline timeline(scene);
    cost.integrator = timeline.summary(0).integrator;
    cost.step = time_press(scene, 0, timed_seconds, timeline).step;
  } catch (const SceneError& error) {
    cost.refused = error.what();
  }
  return cost;
}

}  // namespace

AccuracyTable load_accuracy_table(const std::string& scene_file) {
  std::string path;
  try {
    path = resolve_path(table_file, scene_file);
  } catch (const SceneError&) {
    // A scene outside the package and no environment: the program lies inside.
    std::error_code error;
    path = resolve_path(table_file, std::filesystem::read_symlink("/proc/self/exe", error).string());
  }
  AccuracyTable table;
  const YamlMapping yaml(path, {"rows"});
  for (const YamlMapping& row :
       yaml.list("rows", {"model", "integrator", "edges", "displacement_error", "force_error"})) {
    AccuracyRow read;
    read.model = row.choice<Model>("model", {{"contact_only", Model::contact_only},
                                             {"surface", Model::surface},
                                             {"volume", Model::volume},
                                             {"fem", Model::fem}});
    read.integrator = row.choice<Integrator>("integrator",
                                             {{"auto", Integrator::automatic},
                                              {"explicit", Integrator::explicit_substeps},
                                              {"vertex_block_descent", Integrator::vertex_block_descent}},
                                             Integrator::automatic);
    read.edges = row.number("edges", not_negative, "a number from 0");
    read.error = std::max(row.number("displacement_error", not_negative, "a number from 0"),
                          row.number("force_error", not_negative, "a number from 0"));
    table.rows.push_back(read);
  }
  if (table.rows.empty()) yaml.fail("rows", "is missing or empty, tissue_sim_study writes them");
  return table;
}

double expected_error(const AccuracyTable& table, Model model, Integrator integrator, double edges) {
  std::vector<AccuracyRow> rows;
  for (const bool any : {false, true}) {
    for (const AccuracyRow& row : table.rows) {
      const bool same = row.integrator == integrator || row.integrator == Integrator::automatic;
      if (row.model == model && (any || same)) rows.push_back(row);
    }
    if (!rows.empty()) break;
  }
  if (rows.empty()) return std::numeric_limits<double>::infinity();
  std::stable_sort(rows.begin(), rows.end(), [](const AccuracyRow& a, const AccuracyRow& b) {
    return a.edges < b.edges || (a.edges == b.edges && a.error < b.error);
  });
  const auto above =
      std::upper_bound(rows.begin(), rows.end(), edges, [](double x, const AccuracyRow& row) { return x < row.edges; });
  if (above == rows.begin()) return above->error;
  const auto below = above - 1;
  if (above == rows.end()) return below->error;
  const double part = (edges - below->edges) / (above->edges - below->edges);
  return below->error + part * (above->error - below->error);
}

namespace {

/// Places that are looked at for where a mesh is finest.
constexpr std::size_t most_places = 2000;

/// Mean edge (m) where the mesh is finest: within three contact radii, or two mean edges if those are longer, of one of
/// its vertices.
double finest_edge(const std::vector<Vector3>& vertices, const std::vector<Edge>& edges, double contact_radius) {
  const double mean = mean_edge_length(vertices, edges);
  const double reach = std::max(3.0 * contact_radius, 2.0 * mean);
  const std::size_t stride = 1 + vertices.size() / most_places;
  double finest = mean;
  for (std::size_t v = 0; v < vertices.size(); v += stride) {
    double sum = 0.0;
    int count = 0;
    for (const auto& [a, b] : edges) {
      if (!((0.5 * (vertices[a] + vertices[b]) - vertices[v]).squaredNorm() < reach * reach)) continue;
      sum += (vertices[b] - vertices[a]).norm();
      ++count;
    }
    if (count > 0) finest = std::min(finest, sum / count);
  }
  return finest;
}

}  // namespace

double relative_edges(const Organ& organ, const std::vector<Instrument>& instruments) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Instrument& instrument : instruments) {
    for (const InstrumentPart& part : instrument.parts) {
      thinnest = std::min(thinnest, bounds_of(part.mesh.vertices).size().minCoeff());
    }
  }
  std::vector<Edge> edges;
  for (const Tetrahedron& t : organ.solid.tetrahedra) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < i; ++j) edges.push_back({std::min(t[i], t[j]), std::max(t[i], t[j])});
    }
  }
  for (const Triangle& t : organ.mesh.triangles) {
    if (!organ.solid.empty()) break;
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = t[i], b = t[(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  const double radius = 0.5 * thinnest;
  return finest_edge(organ.solid.empty() ? organ.mesh.vertices : organ.solid.vertices, edges, radius) / radius;
}

bool fits(const Candidate& candidate, Accuracy::Goal goal, double limit) {
  if (!candidate.possible) return false;
  if (goal == Accuracy::Goal::budget) return candidate.cost * (1.0 + cost_margin) <= limit;
  return candidate.expected_error <= limit;
}

int choose(const std::vector<Candidate>& candidates, Accuracy::Goal goal, double limit) {
  int best = -1;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& candidate = candidates[i];
    if (!fits(candidate, goal, limit)) continue;
    if (best >= 0) {
      const Candidate& other = candidates[static_cast<std::size_t>(best)];
      const bool exact = candidate.expected_error < other.expected_error;
      const bool as_exact = candidate.expected_error == other.expected_error;
      const bool cheap = candidate.cost < other.cost;
      const bool as_cheap = candidate.cost == other.cost;
      if (goal == Accuracy::Goal::budget ? !(exact || (as_exact && cheap)) : !(cheap || (as_cheap && exact))) continue;
    }
    best = static_cast<int>(i);
  }
  return best;
}

std::string to_text(const ModelChoice& choice) {
  std::string text = "organ " + choice.organ + ": " + to_string(choice.model);
  if (!choice.solid.empty()) text += " on " + choice.solid;
  if (choice.model != Model::contact_only) text += std::string(", ") + to_string(choice.integrator);
  return text + ": expected error " + percent(choice.expected_error) + ", " + milliseconds(choice.measured) +
         " a step: " + choice.why;
}

Scene choose_models(const Scene& scene, const AccuracyTable& table, const MeasureCost& measure,
                    std::vector<ModelChoice>& choices) {
  Scene chosen = scene;
  chosen.alternatives.clear();
  const Accuracy::Goal goal = scene.accuracy.goal;
  const bool budget = goal == Accuracy::Goal::budget;
  const double limit = scene.accuracy.value / (budget ? static_cast<double>(scene.organs.size()) : 1.0);
  for (std::size_t o = 0; o < scene.alternatives.size(); ++o) {
    const std::vector<Alternative>& alternatives = scene.alternatives[o];
    if (alternatives.empty()) continue;
    std::vector<Assessed> all;
    std::vector<Candidate> candidates;
    for (const Alternative& alternative : alternatives) {
      all.push_back(assess(scene, alternative, table, measure));
      candidates.push_back(all.back().candidate);
    }
    const int best = choose(candidates, goal, limit);
    if (best < 0) refuse(scene, scene.organs[o].name, all, limit);

    const auto picked = static_cast<std::size_t>(best);
    chosen.organs[o] = alternatives[picked].organ;
    ModelChoice choice;
    choice.organ = chosen.organs[o].name;
    choice.model = chosen.organs[o].model;
    choice.solid = alternatives[picked].solid;
    choice.integrator = all[picked].cost.integrator;
    choice.expected_error = candidates[picked].expected_error;
    choice.measured = candidates[picked].cost;
    choice.why =
        std::string("the ") + (budget ? "most exact" : "cheapest") + " that keeps to " + limit_text(goal, limit);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i != picked) choice.rejected.push_back(why_not(all[i], goal, limit));
    }
    choices.push_back(std::move(choice));
  }
  return chosen;
}

Scene choose_models(const Scene& scene, const AccuracyTable& table, std::vector<ModelChoice>& choices) {
  return choose_models(scene, table, time_on_this_machine, choices);
}

Scene load_chosen_scene(const std::string& path, std::vector<std::string>& warnings,
                        std::vector<ModelChoice>& choices) {
  Scene scene = load_scene(path, warnings);
  const bool open = std::any_of(scene.alternatives.begin(), scene.alternatives.end(),
                                [](const std::vector<Alternative>& each) { return !each.empty(); });
  if (!open) return scene;
  AccuracyTable table;
  try {
    table = load_accuracy_table(path);
  } catch (const SceneError& error) {
    throw SceneError(scene.accuracy.place + "needs the table of measured errors: " + error.what());
  }
  return choose_models(scene, table, choices);
}

}  // namespace tissue_sim
