#include "tissue_sim/study/soak.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <vector>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/json_rows.h"
#include "tissue_sim/study/measuring.h"

namespace tissue_sim {

namespace {

constexpr double radius = 0.05;  // m, of the organ
constexpr double tip = 0.005;    // m
constexpr double depth = 0.003;  // m, of the press
constexpr double above = 0.004;  // m, over the surface, between two presses
constexpr double pi = 3.14159265358979323846;
constexpr double golden_ratio = 0.61803398874989485;  // places that go on by it never repeat
constexpr double most_growth = 1e6;                   // bytes
constexpr double most_slowing = 1.1;
constexpr std::int64_t step_nanoseconds = 1'000'000;

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0;
  double resident = 0.0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// From 0 to 1 where x does, without a jerk; 0 before and 1 after.
double smooth(double x) {
  const double part = std::clamp(x, 0.0, 1.0);
  return part * part * (3.0 - 2.0 * part);
}

/// Unit, from the middle of the organ: where the probe of a cycle is when it has slid so far, 0 to 1. In the upper
/// half.
Vector3 place(std::int64_t cycle, double slid) {
  const auto number = static_cast<double>(cycle);
  const double polar = 0.2 + 0.9 * std::fmod(golden_ratio * number, 1.0) + 0.15 * slid;
  const double around = 2.0 * pi * std::fmod(golden_ratio * number, 1.0) * 5.0 + 0.5 * slid;
  return {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar)};
}

/// Times of the steps of a tenth. Its room is there, and in memory, before the first of them.
struct Times {
  explicit Times(std::int64_t steps) : all(static_cast<std::size_t>(steps), 1.0), in_contact(all) {
    all.clear();
    in_contact.clear();
  }
  void add(double seconds, bool contact) {
    all.push_back(seconds);
    if (contact) in_contact.push_back(seconds);
  }
  std::vector<double> all, in_contact;
};

}  // namespace

Scene soak_scene() {
  Organ organ;
  organ.name = "ball";
  organ.mesh = make_sphere(radius, 20);
  organ.model = Model::surface;
  organ.wall_thickness = 0.004;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 20.0};
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    if (organ.mesh.vertices[v].z() < -0.6 * radius) organ.attached.push_back(static_cast<int>(v));
  }
  Instrument probe;
  probe.name = "probe";
  probe.parts.push_back({"tip", make_sphere(tip, 12), true});
  Scene scene;
  scene.frame = "world";
  scene.time_step = 1e-9 * step_nanoseconds;
  scene.organs.push_back(std::move(organ));
  scene.instruments.push_back(std::move(probe));
  return scene;
}

Pose soak_pose(std::int64_t step) {
  const std::int64_t cycle = step / soak_cycle;
  const double t = static_cast<double>(step % soak_cycle) / soak_cycle;  // 0 to 1
  // Down in the first quarter, at the bottom to the middle, up to the third, then over to the next place.
  const double down = smooth(std::min(4.0 * t, 3.0 - 4.0 * t));
  const double height = radius + tip + above - (above + depth) * down;
  const double over = smooth(4.0 * t - 3.0);
  const Vector3 here = place(cycle, smooth(4.0 * t - 1.0));
  Pose pose;
  pose.position = height * (here + over * (place(cycle + 1, 0.0) - here)).normalized();
  pose.orientation = turn(pi * t, Vector3(0.36, 0.48, 0.8));
  return pose;
}

SoakFigures run_soak(std::int64_t steps, std::size_t (*allocations)()) {
  Timeline timeline(soak_scene());
  const std::int64_t warm_up = std::max<std::int64_t>(10 * soak_cycle, steps / 100);
  const std::int64_t tenth = steps / 10;
  Times start(tenth);
  Times end(tenth);
  SoakFigures figures;
  std::chrono::steady_clock::time_point began;
  bool touched = false;
  for (std::int64_t i = 0; i < warm_up + steps; ++i) {
    const std::int64_t counted = i - warm_up;
    if (counted == 0) {
      figures.memory = resident_bytes();
      began = std::chrono::steady_clock::now();
    }
    const StampedPose pose = {(i + 1) * step_nanoseconds, soak_pose(i)};
    const std::size_t allocated = allocations();
    const double before = processor_seconds();
    timeline.add_pose(0, pose);
    while (timeline.step()) {
    }
    const double seconds = processor_seconds() - before;
    if (counted < 0) continue;
    const bool contact = !timeline.report().contacts.empty();
    figures.allocations += allocations() - allocated;
    ++figures.steps;
    figures.contact_steps += contact;
    figures.touches += contact && !touched;
    touched = contact;
    if (counted < tenth) start.add(seconds, contact);
    if (counted >= steps - tenth) end.add(seconds, contact);
  }
  figures.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  figures.memory_end = resident_bytes();
  figures.simulated = 1e-9 * static_cast<double>(steps * step_nanoseconds);
  figures.start_median = percentile(start.in_contact, 0.5);
  figures.start_slowest = percentile(start.all, 0.9999);
  figures.end_median = percentile(end.in_contact, 0.5);
  figures.end_slowest = percentile(end.all, 0.9999);
  figures.recoveries = static_cast<int>(timeline.counters().recoveries);
  figures.hash = timeline.hash();
  return figures;
}

std::string fault(const SoakFigures& f) {
  std::string faults;
  const auto unless = [&faults](bool holds, const std::string& what) {
    if (!holds) faults += (faults.empty() ? "" : "; ") + what;
  };
  unless(f.seconds < f.simulated, text("slower than time: %.1f s for %.1f s", f.seconds, f.simulated));
  unless(f.recoveries == 0, text("%d states went bad", f.recoveries));
  unless(3 * f.contact_steps >= f.steps, text("contact in only %lld steps", static_cast<long long>(f.contact_steps)));
  unless(f.allocations == 0, text("%zu heap allocations in warm steps", f.allocations));
  const double growth = f.memory_end - f.memory;
  unless(growth < most_growth, text("resident memory grew by %.2f MB", 1e-6 * growth));
  unless(f.end_slowest <= most_slowing * f.start_slowest,
         text("the slowest steps went from %.1f to %.1f us", 1e6 * f.start_slowest, 1e6 * f.end_slowest));
  return faults;
}

}  // namespace tissue_sim
