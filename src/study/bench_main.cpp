#include <algorithm>
#include <cstdio>
#include <string>

#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/element_bench.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"

namespace {

using namespace tissue_sim;

bool bench_elements(BenchWords words, JsonRows& json) {
  if (!words.words.empty()) return false;
  std::printf("A block of cut cubes, one core, registers: %s\n\n", name(instruction_set()));
  std::printf("model   integrator            tetrahedra  ns a tetrahedron\n");
  for (const ElementCost& cost : time_elements()) {
    const double ns = 1e9 * cost.seconds / cost.tetrahedra;
    std::printf("%-6s  %-20s  %10d  %16.1f\n", to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns);
    json.add(text("\"model\": \"%s\", \"integrator\": \"%s\", \"tetrahedra\": %d, \"ns_per_tetrahedron\": %.6g",
                  to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns));
  }
  return true;
}

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
     "  elements                     ns a tetrahedron: the forces of a substep, or a sweep of vertex block descent\n"},
};

void print_usage(std::FILE* file) {
  std::fputs("usage: tissue_sim_bench COMMAND [--json FILE]\n", file);
  for (const Command& command : commands) std::fputs(command.about, file);
  std::fputs("  --json FILE                  write the rows to FILE\n", file);
}

bool write_json(const std::string& path, const char* bench, const JsonRows& json) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (!file) return false;
  std::fprintf(file, "{\n  \"bench\": \"%s\",\n  \"rows\": [%s\n  ]\n}\n", bench, json.rows.c_str());
  return std::fclose(file) == 0;
}

}  // namespace

int main(int argc, char** argv) {
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
  return 0;
}
