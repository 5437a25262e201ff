#include <cstdio>

#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/element_cost.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"

namespace tissue_sim {

namespace {

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

/// The same by two threads; on a machine that is busy the second may find no core.
void bench_threads(JsonRows& json) {
  std::printf("\nOne explicit substep of a large organ, ms\n\nmodel    elements  one thread  two threads  ratio\n");
  for (const ThreadsCost& cost : time_threads()) {
    std::printf("%-7s  %8d  %10.3f  %11.3f  %5.2f\n", cost.organ, cost.elements, 1e3 * cost.seconds,
                1e3 * cost.two_seconds, cost.seconds / cost.two_seconds);
    json.add(
        text("\"measure\": \"threads\", \"model\": \"%s\", \"elements\": %d, \"ms\": %.6g, \"two_threads_ms\": "
             "%.6g, \"ratio\": %.6g",
             cost.organ, cost.elements, 1e3 * cost.seconds, 1e3 * cost.two_seconds, cost.seconds / cost.two_seconds));
  }
}

}  // namespace

bool bench_elements(BenchWords& words, JsonRows& json) {
  if (!words.words.empty()) return false;
  std::printf("A block of cut cubes, one core, registers: %s\n\n", name(instruction_set()));
  std::printf("model   integrator            tetrahedra  ns a tetrahedron\n");
  for (const ElementCost& cost : time_elements()) {
    const double ns = 1e9 * cost.seconds / cost.tetrahedra;
    std::printf("%-6s  %-20s  %10d  %16.1f\n", to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns);
    json.add(text("\"model\": \"%s\", \"integrator\": \"%s\", \"tetrahedra\": %d, \"ns_per_tetrahedron\": %.6g",
                  to_string(cost.model), to_string(cost.integrator), cost.tetrahedra, ns));
  }
  bench_substeps(json);
  bench_threads(json);
  return true;
}

}  // namespace tissue_sim
