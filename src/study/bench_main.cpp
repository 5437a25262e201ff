#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

#include "tissue_sim/study/element_bench.h"
#include "tissue_sim/study/json_rows.h"
#include "tissue_sim/study/load_bench.h"
#include "tissue_sim/study/paper_accuracy.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"

namespace {

using namespace tissue_sim;

constexpr const char* usage =
    "usage: tissue_sim_bench paper|elements|load|frame [--accuracy] [--json FILE]\n"
    "  paper             Table 1 of the paper: 9 pairs of spheres, 3 approaches, milliseconds a collision step\n"
    "  paper --accuracy  its depths, directions and colliding vertices against exact ones\n"
    "  elements          ns a tetrahedron: the forces of a substep, or a sweep of vertex block descent; the\n"
    "                    elements of a substep against one by one and against what the machine can do\n"
    "  load              an organ of 100,000 and one of 1,000,000 triangles, from the file to the first step\n"
    "  frame             from pose to published state through ROS; frame --help for what it takes\n"
    "  --json FILE       write the rows to FILE\n";

struct Arguments {
  std::string bench;
  bool accuracy = false;
  std::string json;
};

bool read_arguments(int argc, char** argv, Arguments& arguments) {
  arguments.bench = argc > 1 ? argv[1] : "";
  const std::string& bench = arguments.bench;
  if (bench != "paper" && bench != "elements" && bench != "load") return false;
  for (int i = 2; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--accuracy" && arguments.bench == "paper") {
      arguments.accuracy = true;
    } else if (word == "--json" && i + 1 < argc) {
      arguments.json = argv[++i];
    } else {
      return false;
    }
  }
  return true;
}

int triangles(int slices) {
  return 2 * slices * (slices - 1);
}
double degrees(double radians) {
  return radians * 180.0 / 3.14159265358979323846;
}

JsonRows bench_table_1() {
  JsonRows json;
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
  return json;
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

JsonRows bench_accuracy() {
  JsonRows json;
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
  return json;
}

/// The elements of an explicit substep against one by one, and against the machine.
void bench_substeps(JsonRows& json) {
  const MachineLimit limit = measure_machine();
  std::printf("\nOne explicit substep. This core: %.1f GB/s from memory, %.1f from cache, %.1f Gflop/s\n\n",
              1e-9 * limit.bytes_per_second, 1e-9 * limit.cached_bytes_per_second, 1e-9 * limit.operations_per_second);
  std::printf("model    elements      ms  ns an element  one by one  ratio  kB moved  kflop  of the machine's limit\n");
  for (const SubstepCost& cost : time_substeps()) {
    const double ns = 1e9 * cost.seconds / cost.elements;
    const double plain_ns = 1e9 * cost.plain_seconds / cost.elements;
    const double of_limit = cost.seconds / least_possible(cost, limit);
    std::printf("%-7s  %8d  %6.3f  %13.2f  %10.1f  %5.1f  %8.0f  %5.0f  %.2f times\n", cost.organ, cost.elements,
                1e3 * cost.seconds, ns, plain_ns, plain_ns / ns, 1e-3 * cost.bytes, 1e-3 * cost.operations, of_limit);
    json.add(
        text("\"measure\": \"substep\", \"model\": \"%s\", \"elements\": %d, \"ms\": %.6g, \"ns_per_element\": "
             "%.6g, \"plain_ns_per_element\": %.6g, \"bytes\": %.6g, \"operations\": %.6g, \"memory_gb_s\": %.6g, "
             "\"cache_gb_s\": %.6g, \"gflop_s\": %.6g, \"times_the_limit\": %.6g",
             cost.organ, cost.elements, 1e3 * cost.seconds, ns, plain_ns, cost.bytes, cost.operations,
             1e-9 * limit.bytes_per_second, 1e-9 * limit.cached_bytes_per_second, 1e-9 * limit.operations_per_second,
             of_limit));
  }
}

JsonRows bench_elements() {
  JsonRows json;
  std::printf("A block of cut cubes, one core, registers: %s\n\n", name(instruction_set()));
  std::printf("model   integrator            tetrahedra  ns a tetrahedron\n");
  for (const ElementCost& cost : time_elements()) {
    const double ns = 1e9 * cost.seconds / cost.tetrahedra;
    std::printf("%-6s  %-20s  %10d  %16.1f\n", to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns);
    json.add(text("\"model\": \"%s\", \"integrator\": \"%s\", \"tetrahedra\": %d, \"ns_per_tetrahedron\": %.6g",
                  to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns));
  }
  bench_substeps(json);
  return json;
}

JsonRows bench_loading() {
  JsonRows json;
  std::printf("An ellipsoid from its mesh file to the first step, seconds on one core\n\n");
  std::printf(
      "triangles  file  model         seconds = read    weld+check  topology  rest shape      tree   resident [MB]\n");
  for (const int triangles : {100'000, 1'000'000}) {
    for (const LoadCost& cost : time_loading(triangles)) {
      std::printf("%9d  %-4s  %-12s  %7.3f  %6.3f  %12.3f  %8.3f  %10.3f  %8.3f  %14.0f\n", cost.triangles,
                  cost.file.c_str(), to_string(cost.model), cost.whole, cost.read, cost.mend, cost.topology,
                  cost.rest_shape, cost.tree, 1e-6 * cost.memory);
      std::fflush(stdout);
      json.add(
          text("\"triangles\": %d, \"file\": \"%s\", \"model\": \"%s\", \"seconds\": %.6g, \"seconds_read\": %.6g, "
               "\"seconds_weld_and_check\": %.6g, \"seconds_topology\": %.6g, \"seconds_rest_shape\": %.6g, "
               "\"seconds_tree\": %.6g, \"memory_mb\": %.6g",
               cost.triangles, cost.file.c_str(), to_string(cost.model), cost.whole, cost.read, cost.mend,
               cost.topology, cost.rest_shape, cost.tree, 1e-6 * cost.memory));
    }
  }
  return json;
}

bool write_json(const std::string& path, const Arguments& arguments, const JsonRows& json) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (!file) return false;
  std::fprintf(file, "{\n  \"bench\": \"%s\",\n  \"accuracy\": %s,\n  \"rows\": [%s\n  ]\n}\n", arguments.bench.c_str(),
               arguments.accuracy ? "true" : "false", json.rows.c_str());
  return std::fclose(file) == 0;
}

/// The part that speaks ROS is a program of its own beside this one.
int run_frame(char** argv) {
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "tissue_sim_bench_frame").string();
  execv(program.c_str(), argv + 1);
  std::fprintf(stderr, "%s: cannot be run, it belongs to the package: build and install all of it\n", program.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "frame") return run_frame(argv);
  if (argc == 2 && std::string(argv[1]) == "--help") {
    std::fputs(usage, stdout);
    return 0;
  }
  Arguments arguments;
  if (!read_arguments(argc, argv, arguments)) {
    std::fputs(usage, stderr);
    return 2;
  }
  const JsonRows json = arguments.bench == "elements" ? bench_elements()
                        : arguments.bench == "load"   ? bench_loading()
                        : arguments.accuracy          ? bench_accuracy()
                                                      : bench_table_1();
  if (!arguments.json.empty() && !write_json(arguments.json, arguments, json)) {
    std::fprintf(stderr, "tissue_sim_bench: %s cannot be written: check the folder and its rights\n",
                 arguments.json.c_str());
    return 1;
  }
  return 0;
}
