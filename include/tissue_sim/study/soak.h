#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// A ball-tipped probe on the wall of a hollow ball: it presses, slides, turns, leaves, and comes again elsewhere.
Scene soak_scene();
Pose soak_pose(std::int64_t step);
constexpr int soak_cycle = 2000;  ///< steps of 1 ms from one coming to the next

struct SoakFigures {
  std::int64_t steps = 0;
  std::int64_t contact_steps = 0;
  std::int64_t touches = 0;  ///< how often contact began
  double seconds = 0.0;      ///< that they took
  double simulated = 0.0;    ///< s
  double memory = 0.0;       ///< bytes resident after warm-up
  double memory_end = 0.0;
  std::size_t allocations = 0;  ///< in the steps after warm-up
  double start_median = 0.0;    ///< s of processor time, of the steps in contact in the first tenth after warm-up
  double start_slowest = 0.0;   ///< s, the 99.99th percentile of all steps there
  double end_median = 0.0;      ///< of the last tenth
  double end_slowest = 0.0;
  int recoveries = 0;
  std::uint64_t hash = 0;
};

/// `steps` after a warm-up of ten cycles or a hundredth of them. `allocations` tells how many there were so far in this
/// program; it is asked before and after each step.
SoakFigures run_soak(std::int64_t steps, std::size_t (*allocations)());

/// What does not hold of: faster than time; no recovery; in contact a third of the time or more; no allocation;
/// resident memory grown by less than a megabyte; the slowest steps of the end no more than a tenth slower than those
/// of the start. Empty where all does.
std::string fault(const SoakFigures& figures);

}  // namespace tissue_sim
