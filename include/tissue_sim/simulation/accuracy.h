#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// One measured error, relative, of a model on a mesh of one fineness: a row of config/accuracy.yaml.
struct AccuracyRow {
  Model model = Model::fem;
  Integrator integrator = Integrator::automatic;  ///< automatic: whichever
  double edges = 0.0;  ///< mean edge of the simulated mesh over the contact radius of the instrument
  double error = 0.0;  ///< the larger of that of the displacements and that of the force
};

struct AccuracyTable {
  std::vector<AccuracyRow> rows;
};

/// The table that the package ships, found from the file of a scene or from the running program. Throws SceneError.
AccuracyTable load_accuracy_table(const std::string& scene_file);

/// Between the rows of the model and the integrator (where there are none, of the model) linear over `edges`; outside
/// their range that of the nearest row. Infinite where the model was never measured.
double expected_error(const AccuracyTable& table, Model model, Integrator integrator, double edges);

/// Mean edge of what is integrated (the solid, else the surface) where it is finest, over the contact radius: half of
/// the thinnest extent of a piece of the scene's instruments. A mesh is fine where its contact is expected.
double relative_edges(const Organ& organ, const std::vector<Instrument>& instruments);

/// What is known of an alternative when one of them is to be chosen.
struct Candidate {
  double expected_error = 0.0;  ///< relative
  double cost = 0.0;            ///< s a step
  bool possible = true;         ///< false: it cannot be stepped in this scene
};

/// Of the measured costs: what may come on top in use, where caches are shared with others and presses are other ones.
constexpr double cost_margin = 0.1;

/// Does it keep to the goal? A cost counts with its margin.
bool fits(const Candidate& candidate, Accuracy::Goal goal, double limit);

/// Of those that fit: for a budget (s) the one with the smallest expected error, and of equal ones the cheapest; for an
/// error the cheapest. -1 where none fits.
int choose(const std::vector<Candidate>& candidates, Accuracy::Goal goal, double limit);

/// What was chosen for an organ that names no model, and why.
struct ModelChoice {
  std::string organ;
  Model model = Model::contact_only;
  std::string solid;  ///< file, as the scene names it; empty without
  Integrator integrator = Integrator::automatic;
  double expected_error = 0.0;  ///< relative
  double measured = 0.0;        ///< s a step, in contact, on this machine
  std::string why;
  std::vector<std::string> rejected;  ///< one line each
};

/// `organ liver: fem on liver_fine.msh, explicit: expected error 4.1 %, 0.62 ms a step: why`
std::string to_text(const ModelChoice& choice);

/// What a scene with one organ costs a step.
struct SceneCost {
  double step = 0.0;  ///< s
  Integrator integrator = Integrator::automatic;
  std::string refused;  ///< why it cannot be stepped; empty where it can
};
using MeasureCost = std::function<SceneCost(const Scene&)>;

/// The scene with the alternatives chosen that its accuracy asks for. A budget is shared equally among all organs of
/// the scene, those that name their model included: each organ that names none may cost the part that falls to it.
/// Throws SceneError, which names the best there is and the cure, where nothing keeps to the goal.
Scene choose_models(const Scene& scene, const AccuracyTable& table, const MeasureCost& measure,
                    std::vector<ModelChoice>& choices);

/// The same, the costs timed on this machine, for about a quarter of a second each.
Scene choose_models(const Scene& scene, const AccuracyTable& table, std::vector<ModelChoice>& choices);

/// load_scene(), and its models chosen where it leaves them open: a scene that can be stepped.
Scene load_chosen_scene(const std::string& path, std::vector<std::string>& warnings, std::vector<ModelChoice>& choices);

}  // namespace tissue_sim
