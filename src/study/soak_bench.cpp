#include <cstdio>

#include "benchmark/counted_heap.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/soak.h"

namespace tissue_sim {

bool bench_soak(BenchWords& words, JsonRows& json) {
  int thousands = 3600;
  if (!words.take_number("--thousands", 20, 1'000'000, thousands) || !words.words.empty()) return false;
  const SoakFigures f = run_soak(1000LL * thousands, counted_allocations);
  const auto whole = [](std::int64_t number) { return static_cast<long long>(number); };
  std::printf("A probe presses, slides, turns, leaves and comes again\n\n");
  std::printf("steps                     %lld, %lld of them in contact, %lld touches\n", whole(f.steps),
              whole(f.contact_steps), whole(f.touches));
  std::printf("time                      %.1f s for %.1f s, %.1f times faster\n", f.seconds, f.simulated,
              f.simulated / f.seconds);
  std::printf("resident after warm-up    %.3f MB, at the end %+.3f MB\n", 1e-6 * f.memory,
              1e-6 * (f.memory_end - f.memory));
  std::printf("heap allocations          %zu in warm steps\n", f.allocations);
  std::printf("recoveries                %d\n\n", f.recoveries);
  std::printf("us of processor time  median in contact  99.99th percentile\n");
  std::printf("first tenth           %17.1f  %18.1f\n", 1e6 * f.start_median, 1e6 * f.start_slowest);
  std::printf("last tenth            %17.1f  %18.1f\n\n", 1e6 * f.end_median, 1e6 * f.end_slowest);
  std::printf("hash                      %016llx\n", static_cast<unsigned long long>(f.hash));
  json.add(
      text("\"steps\": %lld, \"contact_steps\": %lld, \"touches\": %lld, \"seconds\": %.6g, \"simulated_seconds\": "
           "%.6g, \"resident_mb\": %.6g, \"resident_growth_mb\": %.6g, \"allocations\": %zu, \"recoveries\": %d, "
           "\"us_start_median\": %.6g, \"us_start_9999\": %.6g, \"us_end_median\": %.6g, \"us_end_9999\": %.6g",
           whole(f.steps), whole(f.contact_steps), whole(f.touches), f.seconds, f.simulated, 1e-6 * f.memory,
           1e-6 * (f.memory_end - f.memory), f.allocations, f.recoveries, 1e6 * f.start_median, 1e6 * f.start_slowest,
           1e6 * f.end_median, 1e6 * f.end_slowest));
  json.fault = fault(f);
  return true;
}

}  // namespace tissue_sim
