#include <cstdio>

#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/loading.h"

namespace tissue_sim {

bool bench_load(BenchWords& words, JsonRows& json) {
  if (!words.words.empty()) return false;
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
  return true;
}

}  // namespace tissue_sim
