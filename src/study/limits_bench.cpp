#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>

#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/paper_protocol.h"

namespace tissue_sim {

namespace {

constexpr int repetitions = 15;

template <class Work>
double least_seconds(Work work) {
  double least = 1e300;
  for (int i = 0; i < repetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    least = std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return least;
}

/// a = b + s c over three arrays of `bytes` in all: bytes a second, two read for one written.
__attribute__((target_clones("avx512f", "avx2", "default"))) void triad(double* a, const double* b, const double* c,
                                                                        std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) a[i] = b[i] + 0.5 * c[i];
}

double measure_bandwidth(std::size_t bytes) {
  const std::size_t n = bytes / (3 * sizeof(double));
  std::vector<double> a(n, 0.0);
  const std::vector<double> b(n, 1.0);
  const std::vector<double> c(n, 2.0);
  const std::size_t rounds = std::max<std::size_t>(1, 50'000'000 / bytes);
  const double seconds = least_seconds([&] {
    for (std::size_t round = 0; round < rounds; ++round) triad(a.data(), b.data(), c.data(), n);
  });
  return static_cast<double>(rounds * 3 * n * sizeof(double)) / seconds;
}

/// Multiplications and additions in registers, as many chains as hide their latency.
constexpr std::size_t chains = 40;
constexpr int chain_rounds = 200'000;
__attribute__((target_clones("avx512f", "avx2", "default"))) void multiply_add(std::array<double, chains>& x) {
  std::array<double, chains> own = x;
  for (int round = 0; round < chain_rounds; ++round) {
    for (std::size_t i = 0; i < chains; ++i) own[i] = own[i] * 0.999 + 0.001;
  }
  x = own;
}

double measure_arithmetic() {
  std::array<double, chains> x{};
  const double seconds = least_seconds([&] { multiply_add(x); });
  return x[0] < 0.0 ? 0.0 : 2.0 * chains * chain_rounds / seconds;  // x is looked at, or nothing would be computed
}

/// What elements and integration need of a step however they are written: the constants of each element read once, and
/// what is known of each vertex read and written once; additions, multiplications, divisions and roots of the formulas.
struct Need {
  double bytes = 0.0;
  double operations = 0.0;
};

Need need_of(const OrganSummary& organ) {
  constexpr double constants = 4 * sizeof(double);                        // at rest, scale, stiffness, damping
  constexpr double vertex = 6 * 3 * sizeof(double) + 2 * sizeof(double);  // x, v, f in and out; mass, attachment
  const double edges = organ.distance_elements;
  const double areas = organ.area_elements;
  const double flaps = organ.volume_elements;
  const double triangles = organ.triangles;
  Need need;
  need.bytes = edges * (2 * sizeof(int) + constants) + areas * (3 * sizeof(int) + constants) +
               flaps * (4 * sizeof(int) + constants) + triangles * 3 * sizeof(int) + organ.vertices * vertex;
  // C with its gradient, and then rate, slope and force of each vertex: 16 + 44, 65 + 63, 59 + 82; the enclosed volume;
  // the integration of a vertex.
  need.operations = edges * 60 + areas * 128 + flaps * 141 + triangles * 59 + organ.vertices * 40;
  return need;
}

}  // namespace

bool bench_limits(BenchWords& words, JsonRows& json) {
  if (!words.words.empty()) return false;
  const double arithmetic = measure_arithmetic();
  const double memory = measure_bandwidth(256'000'000);
  std::printf(
      "One core: %.1f Gop/s in registers (double), %.1f GB/s from memory (triad over 256 MB)\n\n"
      "Elements and integration of a step with restoration, against what the machine could do\n\n"
      "deformable      MB    Mop  GB/s there  ms of bytes  ms of operations  ms measured  times the limit\n",
      1e-9 * arithmetic, 1e-9 * memory);
  for (const std::size_t test : {6u, 7u, 8u}) {
    const Timeline timeline(paper_scene(paper_tests[test], Approach::with_restoration));
    const OrganSummary organ = timeline.summary(0);
    const Need need = need_of(organ);
    const double bandwidth = measure_bandwidth(static_cast<std::size_t>(need.bytes));
    const double measured = 1e3 * run_paper_test(paper_tests[test], Approach::with_restoration).mean.deformation;
    const double of_bytes = 1e3 * need.bytes / bandwidth;
    const double of_operations = 1e3 * need.operations / arithmetic;
    const double times = measured / std::max(of_bytes, of_operations);
    std::printf("%10d  %6.2f  %5.2f  %10.1f  %11.4f  %16.4f  %11.4f  %15.1f\n", organ.triangles, 1e-6 * need.bytes,
                1e-6 * need.operations, 1e-9 * bandwidth, of_bytes, of_operations, measured, times);
    json.add(
        text("\"deformable_triangles\": %d, \"bytes\": %.6g, \"operations\": %.6g, \"bytes_per_second\": %.6g, "
             "\"bytes_per_second_of_memory\": %.6g, \"operations_per_second\": %.6g, \"ms_of_bytes\": %.6g, "
             "\"ms_of_operations\": %.6g, \"ms_deformation\": %.6g, \"times_the_limit\": %.6g",
             organ.triangles, need.bytes, need.operations, bandwidth, memory, arithmetic, of_bytes, of_operations,
             measured, times));
  }
  return true;
}

}  // namespace tissue_sim
