#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>

#include "tissue_sim/study/bench.h"

namespace {

using namespace tissue_sim;

struct Command {
  const char* name;
  BenchRun run;
  const char* about;
};

constexpr Command commands[] = {
    {"paper", bench_paper,
     "  paper [--test N] [--runs N]  Table 1 of the paper: 9 pairs of spheres, 3 approaches, milliseconds a collision\n"
     "                               step; beside the paper's and the plain version's; the fastest of 3 runs\n"
     "  paper --accuracy             its depths, directions and colliding vertices against exact ones\n"},
    {"peers", bench_peers,
     "  peers [--runs N] [--peer bullet|fcl]  its test 9 against Bullet's soft body and FCL's detection\n"},
    {"scale", bench_scale,
     "  scale [--sizes N,N,...]      an organ that grows from 10,000 to 1,000,000 triangles under the same press\n"},
    {"limits", bench_limits,
     "  limits                       bytes and operations of a step against what one core can do\n"},
    {"elements", bench_elements,
     "  elements                     ns a tetrahedron: the forces of a substep, or a sweep of vertex block descent; "
     "the\n"
     "                               elements of a substep against one by one and against what the machine can do\n"},
    {"levels", bench_levels,
     "  levels [--solid FILE.msh]    a solid under a probe with levels against everything awake: time, and error of "
     "force\n"
     "                               and displacement; of the bundled liver's tetrahedra cut finer, or of FILE\n"},
    {"load", bench_load,
     "  load                         an organ of 100,000 and one of 1,000,000 triangles, from file to first step\n"},
    {"soak", bench_soak,
     "  soak [--thousands N]         3,600 thousand steps with contact: memory, allocations and the slowest steps, "
     "which "
     "stay\n"
     "                               as they were, or the status is 1\n"},
};

void print_usage(std::FILE* file) {
  std::fputs("usage: tissue_sim_bench COMMAND [--json FILE]\n", file);
  for (const Command& command : commands) std::fputs(command.about, file);
  std::fputs("  frame                        from pose to published state through ROS; frame --help says more\n", file);
  std::fputs("  --json FILE                  write the rows to FILE\n", file);
}

bool write_json(const std::string& path, const char* bench, const JsonRows& json) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (!file) return false;
  std::fprintf(file, "{\n  \"bench\": \"%s\",\n  \"rows\": [%s\n  ]\n}\n", bench, json.rows.c_str());
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
  BenchWords words = {{argv + 1, argv + argc}};
  if (words.words.size() == 1 && words.words.front() == "--help") {
    print_usage(stdout);
    return 0;
  }
  const std::string name = words.words.empty() ? "" : words.words.front();
  const auto command =
      std::find_if(std::begin(commands), std::end(commands), [&](const Command& known) { return known.name == name; });
  words.take(name);
  const std::string path = words.take_value("--json");
  JsonRows json;
  if (command == std::end(commands) || !command->run(words, json)) {
    print_usage(stderr);
    return 2;
  }
  if (!path.empty() && !write_json(path, command->name, json)) {
    std::fprintf(stderr, "tissue_sim_bench: %s cannot be written: check the folder and its rights\n", path.c_str());
    return 1;
  }
  if (!json.fault.empty()) {
    std::fprintf(stderr, "tissue_sim_bench %s: %s\n", command->name, json.fault.c_str());
    return 1;
  }
  return 0;
}
