#include <algorithm>
#include <cstdio>

#include "benchmark/plain_step.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/paper_accuracy.h"

namespace tissue_sim {

namespace {

int triangles(int slices) {
  return 2 * slices * (slices - 1);
}
double degrees(double radians) {
  return radians * 180.0 / 3.14159265358979323846;
}

/// The same protocol by the plain version of the step.
PaperResult run_plain_test(const PaperTest& test, Approach approach) {
  PlainSimulation plain(paper_scene(test, approach));
  PaperResult result;
  StepProfile sum;
  const std::vector<Vector3> path = paper_path();
  for (std::size_t i = 1; i < path.size(); ++i) {
    plain.step(paper_pose(path[i - 1]), paper_pose(path[i]), 0.001);
    if (plain.contacts.empty()) continue;
    ++result.steps_with_contact;
    result.contacts += static_cast<std::int64_t>(plain.contacts.size());
    add(plain.profile, 1.0, sum);
  }
  result.mean = divided(sum, result.steps_with_contact);
  return result;
}

/// Of several runs that take turns, the fastest of each: what else the machine does slows single runs.
struct PaperCell {
  PaperResult ours;
  PaperResult plain;
};
PaperCell run_cell(const PaperTest& test, Approach approach, int runs) {
  PaperCell cell;
  for (int run = 0; run < runs; ++run) {
    const PaperResult ours = run_paper_test(test, approach);
    const PaperResult plain = run_plain_test(test, approach);
    if (run == 0 || ours.mean.total < cell.ours.mean.total) cell.ours = ours;
    if (run == 0 || plain.mean.total < cell.plain.mean.total) cell.plain = plain;
  }
  return cell;
}

double contacts_a_step(const PaperResult& result) {
  return static_cast<double>(result.contacts) / std::max(1, result.steps_with_contact);
}

void bench_table_1(int only, int runs, JsonRows& json) {
  std::printf(
      "Table 1: ms a collision step, mean over the steps with contact (one core, the fastest of %d run(s)), beside the "
      "paper's\n(1.7 GHz, about 2006) and the plain version's in the same run\n\n",
      runs);
  std::printf(
      "test  rigid  deformable  approach               ours     paper    ratio     plain  ratio   detect   border   "
      "inward response   deform   health  contacts  plain\n");
  for (std::size_t test = 0; test < paper_tests.size(); ++test) {
    if (only != 0 && static_cast<int>(test) + 1 != only) continue;
    for (int a = 0; a < approaches; ++a) {
      const Approach approach = static_cast<Approach>(a);
      const PaperCell cell = run_cell(paper_tests[test], approach, runs);
      const PaperResult& result = cell.ours;
      const StepProfile& mean = result.mean;
      const double total = 1e3 * mean.total;
      const double detection = 1e3 * (mean.refit + mean.detection);
      const double paper = 1e3 * paper_tests[test].seconds[static_cast<std::size_t>(a)];
      const double plain = 1e3 * cell.plain.mean.total;
      const int rigid = triangles(paper_tests[test].rigid);
      const int deformable = triangles(paper_tests[test].deformable);
      std::printf(
          "%4zu  %5d  %10d  %-19s %7.4f  %8.2f  %7.0f  %8.4f  %5.2f %8.4f %8.4f %8.4f %8.4f %8.4f %8.4f  %8.1f  "
          "%5.1f\n",
          test + 1, rigid, deformable, to_string(approach), total, paper, paper / total, plain, plain / total,
          detection, 1e3 * mean.penetration, 1e3 * mean.propagation, 1e3 * mean.response, 1e3 * mean.deformation,
          1e3 * mean.health, contacts_a_step(result), contacts_a_step(cell.plain));
      std::fflush(stdout);
      const StepProfile& plainly = cell.plain.mean;
      json.add(
          text("\"test\": %zu, \"rigid_triangles\": %d, \"deformable_triangles\": %d, \"approach\": \"%s\", "
               "\"ms_per_step\": %.6g, \"paper_ms\": %.6g, \"paper_ratio\": %.6g, \"plain_ms\": %.6g, "
               "\"plain_ratio\": %.6g, ",
               test + 1, rigid, deformable, to_string(approach), total, paper, paper / total, plain, plain / total) +
          text("\"ms_detection\": %.6g, \"ms_penetration\": %.6g, \"ms_propagation\": %.6g, \"ms_response\": %.6g, "
               "\"ms_deformation\": %.6g, \"ms_health\": %.6g, ",
               detection, 1e3 * mean.penetration, 1e3 * mean.propagation, 1e3 * mean.response, 1e3 * mean.deformation,
               1e3 * mean.health) +
          text("\"plain_ms_detection\": %.6g, \"plain_ms_penetration\": %.6g, \"plain_ms_propagation\": %.6g, "
               "\"plain_ms_response\": %.6g, \"plain_ms_deformation\": %.6g, \"plain_ms_health\": %.6g, ",
               1e3 * (plainly.refit + plainly.detection), 1e3 * plainly.penetration, 1e3 * plainly.propagation,
               1e3 * plainly.response, 1e3 * plainly.deformation, 1e3 * plainly.health) +
          text("\"steps_with_contact\": %d, \"contacts\": %.6g, \"plain_contacts\": %.6g, \"substeps\": %d, "
               "\"recoveries\": %d, \"runs\": %d, \"hash\": \"%016llx\"",
               result.steps_with_contact, contacts_a_step(result), contacts_a_step(cell.plain), result.substeps,
               result.recoveries, runs, static_cast<unsigned long long>(result.hash)));
    }
  }
}

void print_depth_error(JsonRows& json, const PaperTest& test, const char* where, const DepthError& error) {
  std::printf("%5d  %10d  %-6s  %8d  %9.1f  %8.0f  %8.2f  %10.1f  %9.1f\n", triangles(test.rigid),
              triangles(test.deformable), where, error.vertices, 100.0 * error.depth_mean, 100.0 * error.depth_max,
              1e3 * error.depth_max_m, degrees(error.direction_mean), degrees(error.direction_max));
  json.add(
      text("\"measure\": \"depth\", \"rigid_triangles\": %d, \"deformable_triangles\": %d, \"where\": \"%s\", "
           "\"vertices\": %d, \"depth_error_mean\": %.6g, \"depth_error_max\": %.6g, \"depth_error_max_m\": %.6g, "
           "\"direction_error_mean_rad\": %.6g, \"direction_error_max_rad\": %.6g",
           triangles(test.rigid), triangles(test.deformable), where, error.vertices, error.depth_mean, error.depth_max,
           error.depth_max_m, error.direction_mean, error.direction_max));
}

void bench_accuracy(JsonRows& json) {
  std::printf(
      "Depth and direction by Eq. 1-6 against the closest point of the instrument, undeformed organ, paper's path\n\n");
  std::printf("rigid  deformable  where   vertices  depth mean  max  [%%]  max [mm]  angle mean   max [deg]\n");
  for (const PaperTest& test : paper_tests) {
    const DepthAccuracy accuracy = measure_depths(test);
    print_depth_error(json, test, "border", accuracy.border);
    print_depth_error(json, test, "inner", accuracy.inner);
  }
  std::printf("\nColliding vertices against an exact inside test, %% of those inside\n\n");
  std::printf("rigid  deformable  set    motion          inside    false   missed\n");
  for (const PaperTest& test : {paper_tests.front(), paper_tests[4], paper_tests.back()}) {
    for (const CollidingSet set : {CollidingSet::paper, CollidingSet::flood}) {
      for (const SetMotion& motion : set_motions()) {
        const SetError error = measure_set(test, set, motion);
        const double all = std::max(1, error.colliding);
        std::printf("%5d  %10d  %-5s  %-14s %7d  %6.2f%%  %6.2f%%\n", triangles(test.rigid), triangles(test.deformable),
                    to_string(set), motion.name, error.colliding, 100.0 * error.falsely / all,
                    100.0 * error.missed / all);
        json.add(text(
            "\"measure\": \"colliding_set\", \"rigid_triangles\": %d, \"deformable_triangles\": %d, \"set\": \"%s\", "
            "\"motion\": \"%s\", \"inside\": %d, \"false\": %d, \"missed\": %d",
            triangles(test.rigid), triangles(test.deformable), to_string(set), motion.name, error.colliding,
            error.falsely, error.missed));
      }
    }
  }
}

}  // namespace

bool bench_paper(BenchWords& words, JsonRows& json) {
  const bool accuracy = words.take("--accuracy");
  int test = 0;
  int runs = 3;
  const bool numbers = words.take_number("--test", 1, 9, test) && words.take_number("--runs", 1, 1000, runs);
  if (!numbers || !words.words.empty()) return false;
  accuracy ? bench_accuracy(json) : bench_table_1(test, runs, json);
  return true;
}

}  // namespace tissue_sim
