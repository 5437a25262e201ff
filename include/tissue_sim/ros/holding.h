#pragma once

#include <cstdint>

namespace tissue_sim {

/// How far simulated time may go on from the newest pose where no more of them come: as far as the clock has gone
/// since. A clock that goes back, or that jumps by more than `longest_jump` between two looks, has not gone on: the
/// jump is left out. All in ns.
class Holding {
 public:
  static constexpr std::int64_t longest_jump = 10'000'000'000;  ///< as of poses: see TimelineOptions::longest_gap

  void pose(std::int64_t stamp, std::int64_t clock);

  bool begun() const { return stamp_ != 0; }

  /// The time to step to, when the clock shows `clock`; stays `behind` it, so that a pose that is late by less is still
  /// taken.
  std::int64_t until(std::int64_t clock, std::int64_t behind);

 private:
  std::int64_t stamp_ = 0;  ///< of the newest pose; 0: there was none
  std::int64_t clock_ = 0;  ///< at the last look
  std::int64_t since_ = 0;  ///< that the clock has gone since the pose
};

}  // namespace tissue_sim
