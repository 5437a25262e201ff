#include <algorithm>
#include <cstdio>

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

void bench_table_1(JsonRows& json) {
  std::printf(
      "Table 1: ms a collision step, mean over the steps with contact (one core), beside the paper's (1.7 GHz, about "
      "2006)\n\n");
  std::printf(
      "test  rigid  deformable  approach               ours       paper     ratio   detect   border   inward  response "
      "  deform\n");
  for (std::size_t test = 0; test < paper_tests.size(); ++test) {
    for (int a = 0; a < approaches; ++a) {
      const Approach approach = static_cast<Approach>(a);
      const PaperResult result = run_paper_test(paper_tests[test], approach);
      const StepProfile& mean = result.mean;
      const double detection = 1e3 * (mean.refit + mean.detection);
      const double paper = 1e3 * paper_tests[test].seconds[static_cast<std::size_t>(a)];
      const int rigid = triangles(paper_tests[test].rigid);
      const int deformable = triangles(paper_tests[test].deformable);
      std::printf("%4zu  %5d  %10d  %-19s %8.4f  %9.2f  %8.0f %8.4f %8.4f %8.4f  %8.4f %8.4f\n", test + 1, rigid,
                  deformable, to_string(approach), 1e3 * mean.total, paper, paper / (1e3 * mean.total), detection,
                  1e3 * mean.penetration, 1e3 * mean.propagation, 1e3 * mean.response, 1e3 * mean.deformation);
      std::fflush(stdout);
      json.add(
          text("\"test\": %zu, \"rigid_triangles\": %d, \"deformable_triangles\": %d, \"approach\": \"%s\", "
               "\"ms_per_step\": %.6g, \"ms_detection\": %.6g, \"ms_penetration\": %.6g, \"ms_propagation\": %.6g, "
               "\"ms_response\": %.6g, \"ms_deformation\": %.6g, \"steps_with_contact\": %d, \"substeps\": %d, "
               "\"recoveries\": %d, \"paper_ms\": %.6g, \"hash\": \"%016llx\"",
               test + 1, rigid, deformable, to_string(approach), 1e3 * mean.total, detection, 1e3 * mean.penetration,
               1e3 * mean.propagation, 1e3 * mean.response, 1e3 * mean.deformation, result.steps_with_contact,
               result.substeps, result.recoveries, paper, static_cast<unsigned long long>(result.hash)));
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

bool bench_paper(BenchWords words, JsonRows& json) {
  const bool accuracy = words.take("--accuracy");
  if (!words.words.empty()) return false;
  accuracy ? bench_accuracy(json) : bench_table_1(json);
  return true;
}

}  // namespace tissue_sim
