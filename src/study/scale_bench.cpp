#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <sstream>

#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/bench.h"
#include "tissue_sim/study/growing_organ.h"
#include "tissue_sim/study/measuring.h"

namespace tissue_sim {

namespace {

/// The last steps of the press, whose force is shown.
constexpr int steps_of_force = 20;

/// Triangles: up to here the organ's own mesh is also run with everything awake.
constexpr int most_awake = 35'000;

/// Plain numbers only: it goes through a pipe.
struct ScaleFigures {
  int triangles = 0;
  int vertices = 0;
  int active_vertices = 0;  ///< the most in a step with contact
  int substeps = 0;
  int contacts = 0;  ///< in the last step
  int recoveries = 0;
  double milliseconds = 0.0;     ///< median of the steps with contact
  double milliseconds_99 = 0.0;  ///< 99th percentile
  double ms_detection = 0.0;     ///< median
  double ms_deformation = 0.0;   ///< median
  double force = 0.0;            ///< N, mean of the last steps
  double force_awake = 0.0;      ///< N, the same with everything awake; 0: not run
  double load_seconds = 0.0;     ///< of everything that is built once
  double memory = 0.0;           ///< MB, the most that was resident
};

ScaleFigures run_press(int triangles, bool levels) {
  ScaleFigures figures;
  Scene scene = growing_scene(triangles);
  if (!levels) scene.organs.front().levels_tolerance.reset();
  const auto start = std::chrono::steady_clock::now();
  Timeline timeline(scene);
  figures.load_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  figures.triangles = timeline.summary(0).triangles;
  figures.vertices = timeline.summary(0).vertices;

  std::vector<double> total;
  std::vector<double> detection;
  std::vector<double> deformation;
  for (int i = 0; i <= press_steps; ++i) {
    timeline.add_pose(0, {1'000'000'000 + i * 1'000'000, press_pose(i)});
    while (timeline.step()) {
      const StepReport& report = timeline.report();
      figures.substeps = std::max(figures.substeps, report.substeps);
      if (report.contacts.empty()) continue;
      total.push_back(1e3 * report.profile.total);
      detection.push_back(1e3 * (report.profile.refit + report.profile.detection));
      deformation.push_back(1e3 * report.profile.deformation);
      figures.active_vertices = std::max(figures.active_vertices, timeline.active_vertices());
      figures.contacts = static_cast<int>(report.contacts.size());
      if (i > press_steps - steps_of_force) figures.force += report.wrenches.front().force.norm() / steps_of_force;
    }
  }
  figures.recoveries = static_cast<int>(timeline.counters().recoveries);
  figures.milliseconds = percentile(total, 0.5);
  figures.milliseconds_99 = percentile(total, 0.99);
  figures.ms_detection = percentile(detection, 0.5);
  figures.ms_deformation = percentile(deformation, 0.5);
  figures.memory = most_resident() / (1024.0 * 1024.0);
  return figures;
}

/// In a process of its own, so that its memory is its own. False: it ended before it was done.
bool run_apart(int triangles, bool levels, ScaleFigures& figures) {
  int ends[2];
  if (pipe(ends) != 0) return false;
  std::fflush(stdout);
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) {
    close(ends[0]);
    const ScaleFigures own = run_press(triangles, levels);
    const bool written = write(ends[1], &own, sizeof own) == static_cast<ssize_t>(sizeof own);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  const bool read_all = read(ends[0], &figures, sizeof figures) == static_cast<ssize_t>(sizeof figures);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return read_all && status == 0;
}

bool read_sizes(const std::string& list, std::vector<int>& sizes) {
  if (list.empty()) return true;
  sizes.clear();
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ',');) {
    char* end = nullptr;
    const long size = std::strtol(word.c_str(), &end, 10);
    if (*end != 0 || size < 8000 || size > 4'000'000) return false;
    sizes.push_back(static_cast<int>(size));
  }
  return !sizes.empty();
}

}  // namespace

bool bench_scale(BenchWords& words, JsonRows& json) {
  std::vector<int> sizes = {10'000, 30'000, 100'000, 300'000, 1'000'000};
  if (!read_sizes(words.take_value("--sizes"), sizes) || !words.words.empty()) return false;
  std::printf(
      "A hollow tube of 30 mm radius, edges of 2 mm, wall of 4 mm, held from behind, that grows in length; a ball of "
      "5 mm, 4 mm deep.\nOne core, medians over the steps with contact\n\n"
      "organ_triangles  active_vertices  ms_per_step  ms_99th  ms_detection  ms_deformation  substeps  contacts   "
      "force_N  all_awake_N  load_s  memory_mb\n");
  for (const int size : sizes) {
    ScaleFigures f;
    if (!run_apart(size, true, f)) {
      std::printf("%15d  was not finished: out of memory?\n", size);
      continue;
    }
    ScaleFigures awake;
    if (size <= most_awake && run_apart(size, false, awake)) f.force_awake = awake.force;
    std::printf("%15d  %15d  %11.4f  %7.3f  %12.4f  %14.4f  %8d  %8d  %8.5f  %11s  %6.2f  %9.1f\n", f.triangles,
                f.active_vertices, f.milliseconds, f.milliseconds_99, f.ms_detection, f.ms_deformation, f.substeps,
                f.contacts, f.force, f.force_awake > 0.0 ? text("%.5f", f.force_awake).c_str() : "-", f.load_seconds,
                f.memory);
    std::fflush(stdout);
    json.add(text(
        "\"organ_triangles\": %d, \"organ_vertices\": %d, \"active_vertices\": %d, \"ms_per_step\": %.6g, "
        "\"ms_99th\": %.6g, \"ms_detection\": %.6g, \"ms_deformation\": %.6g, \"substeps\": %d, "
        "\"contacts\": %d, \"recoveries\": %d, \"force_n\": %.6g, \"force_all_awake_n\": %.6g, \"load_seconds\": %.6g, "
        "\"memory_mb\": %.6g",
        f.triangles, f.vertices, f.active_vertices, f.milliseconds, f.milliseconds_99, f.ms_detection, f.ms_deformation,
        f.substeps, f.contacts, f.recoveries, f.force, f.force_awake, f.load_seconds, f.memory));
  }
  return true;
}

}  // namespace tissue_sim
