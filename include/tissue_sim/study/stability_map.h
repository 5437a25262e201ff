#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// What happens at the extremes: a small organ is loaded from a scene file, pressed by a ball, left, and watched.

/// One organ and one scene. The instrument and the wall go with the edge, so that all cells have the same shape.
struct StabilityCell {
  Model model = Model::fem;
  Integrator integrator = Integrator::explicit_substeps;
  bool levels = false;     ///< a finer mesh, of which only a part is simulated
  double young = 0.0;      ///< Pa
  double poisson = 0.0;    ///< 1
  double time_step = 0.0;  ///< s
  double damping = 0.0;    ///< of the critical one; the drag is none
  double edge = 0.0;       ///< m, of the organ's mesh
};

enum class Outcome {
  stable,            ///< finite, bounded, not recovered, and its energy does not grow once it is left alone
  other_step,        ///< refused at load; with the time step that the refusal names it is stable
  other_material,    ///< refused at load: the model's energies do not reach the material, whatever the time step
  neither_of_these,  ///< what must not be
};
const char* to_string(Outcome outcome);

struct StabilityRow {
  StabilityCell cell;
  Outcome outcome = Outcome::neither_of_these;
  std::string reason;          ///< of a refusal, or what went wrong
  double time_step = 0.0;      ///< s, that it was stable with; 0: with none
  int substeps = 0;            ///< the most in a step
  int simulated = 0;           ///< vertices
  int contacts = 0;            ///< the most in a step
  double farthest = 0.0;       ///< way of a vertex from where it rests, over the depth of the press
  double energy = 0.0;         ///< J, the most after the organ was left
  double energy_growth = 0.0;  ///< most in the last quarter of the time alone, over that in the first
};

/// All models, both integrators, levels where there are any, and the five numbers from end to end. `quick`: about
/// sixty of them, spread over all.
std::vector<StabilityCell> stability_cells(bool quick);

/// Every cell, in order; the same rows every time. Writes its files into a folder of its own under the system's
/// temporary one, and removes it. `progress` may be null.
std::vector<StabilityRow> map_stability(const std::vector<StabilityCell>& cells, std::FILE* progress);

/// One object, a row a cell.
std::string stability_json(const std::vector<StabilityRow>& rows, const std::string& command);

/// How many of each outcome, a line a model and integrator, in Markdown; below it what must not be, cell by cell.
std::string stability_table(const std::vector<StabilityRow>& rows, const std::string& command);

}  // namespace tissue_sim
