#include "tissue_sim/study/study_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "tissue_sim/study/json_rows.h"

namespace tissue_sim {

namespace {

/// Six digits are the same on every run; the last bits are no result.
std::string number(double value) {
  return std::isfinite(value) ? text("%.6g", value) : "null";
}

std::string percent(double value) {
  return std::isfinite(value) ? text("%.3g", 100.0 * value) : "–";
}

const char* truth(bool value) {
  return value ? "true" : "false";
}

std::string json_row(const StudyRow& row) {
  std::string line = text("\"case\": \"%s\", \"mesh\": \"%s\", ", row.case_name.c_str(), row.mesh.c_str());
  line += text("\"model\": \"%s\", \"integrator\": \"%s\", \"time_step\": %g, \"substeps\": %d, ",
               to_string(row.run.model), to_string(row.run.integrator), row.run.time_step, row.substeps);
  line += text("\"depth\": \"%s\", \"restoration\": %s, \"active_vertices\": %d, \"vertices\": %d, ",
               to_string(row.run.depth), truth(row.run.restoration), row.active_vertices, row.vertices);
  line += text("\"tetrahedra\": %d, \"embedded\": %s, \"edge\": %s, \"contact_radius\": %s, ", row.tetrahedra,
               truth(row.embedded), number(row.edge).c_str(), number(row.contact_radius).c_str());
  line += text("\"ms_per_ms\": %s, \"reference\": \"%s\", ", number(row.ms_per_ms).c_str(),
               std::isfinite(row.displacement_error) ? "fine mesh" : "same mesh");
  line +=
      text("\"displacement_error\": %s, \"force_error\": %s, \"depth_error_m\": %s, ",
           number(row.displacement_error).c_str(), number(row.force_error).c_str(), number(row.depth_error).c_str());
  line += text("\"transient_error\": %s, \"displacement_error_same_mesh\": %s, \"force_error_same_mesh\": %s, ",
               number(row.transient_error).c_str(), number(row.displacement_error_same_mesh).c_str(),
               number(row.force_error_same_mesh).c_str());
  line += text("\"force_n\": %s, \"stable\": %s", number(row.force).c_str(), truth(row.stable));
  return line;
}

std::string table_row(const StudyRow& row) {
  const bool descends = row.run.integrator == Integrator::vertex_block_descent;
  std::string line = text("| %s | %s | %s | %g | %d | %s | %s ", row.mesh.c_str(), to_string(row.run.model),
                          descends ? "vertex block descent" : "explicit", 1e3 * row.run.time_step, row.substeps,
                          to_string(row.run.depth), row.run.restoration ? "on" : "off");
  line += text("| %d | %d | %d | %.3g ", row.vertices, row.active_vertices, row.tetrahedra, row.ms_per_ms);
  line += "| " + percent(row.displacement_error) + " | " + percent(row.force_error) + " | " +
          (std::isfinite(row.depth_error) ? text("%.3f", 1e3 * row.depth_error) : "–") + " | " +
          percent(row.transient_error) + " | " + percent(row.displacement_error_same_mesh) + " | " +
          percent(row.force_error_same_mesh) + (row.stable ? " |\n" : " (recovered) |\n");
  return line;
}

constexpr const char* table_head =
    "| mesh | model | integrator | step, ms | substeps | depth | restoration | vertices | active | tetrahedra | ms a "
    "ms "
    "| displacement, % | force, % | depth, mm | transient, % | displacement, same mesh, % | force, same mesh, % |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

}  // namespace

std::string study_json(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine) {
  JsonRows json;
  for (const StudyRow& row : rows) json.add(json_row(row));
  return text("{\n  \"command\": \"%s\",\n  \"machine\": \"%s\",\n  \"rows\": [", command.c_str(), machine.c_str()) +
         json.rows + "\n  ]\n}\n";
}

std::string study_tables(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine) {
  std::string result =
      text("`%s` on one core of %s. Errors beside the finest mesh's solution.\n", command.c_str(), machine.c_str());
  const std::string* current = nullptr;
  for (const StudyRow& row : rows) {
    if (current == nullptr || *current != row.case_name) {
      current = &row.case_name;
      result += "\n## " + row.case_name + "\n\n" + table_head;
    }
    result += table_row(row);
  }
  return result;
}

std::string accuracy_table(const std::vector<StudyRow>& rows, const std::string& command, const std::string& machine) {
  std::string result = text(
      "# What error to expect. Written by `%s` on %s; do not edit.\n"
      "# edges: of the simulated mesh at the contact, mean, over the radius of the instrument. Errors at rest, "
      "relative: "
      "displacement\n# over the surface, force along the press.\n",
      command.c_str(), machine.c_str());
  result += "rows:\n";
  // Of what has the same edges, as an own surface and an embedded one have, the worse counts.
  std::map<std::tuple<Model, Integrator, std::string>, std::array<double, 2>> errors;
  for (const StudyRow& row : rows) {
    const StudyRun& run = row.run;
    const bool usual = run.depth == DepthScheme::exact && run.restoration && run.finer == 1 && run.time_step == 0.001;
    if (!usual || !row.at_rest || !row.stable || !std::isfinite(row.displacement_error)) continue;
    const std::string edges = text("%8.3f", row.edge / row.contact_radius);  // sorts as the number does
    std::array<double, 2>& worst = errors[{run.model, run.integrator, edges}];
    worst = {std::max(worst[0], row.displacement_error), std::max(worst[1], row.force_error)};
  }
  for (const auto& [key, worst] : errors) {
    const auto& [model, integrator, edges] = key;
    result +=
        text("  - {model: %s, integrator: %s, edges: %s, displacement_error: %.3g, force_error: %.3g}\n",
             to_string(model), to_string(integrator), edges.c_str() + edges.find_first_not_of(' '), worst[0], worst[1]);
  }
  return result;
}

}  // namespace tissue_sim
