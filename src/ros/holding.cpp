#include "tissue_sim/ros/holding.h"

namespace tissue_sim {

void Holding::pose(std::int64_t stamp, std::int64_t clock) {
  stamp_ = stamp;
  clock_ = clock;
  since_ = 0;
}

std::int64_t Holding::until(std::int64_t clock, std::int64_t behind) {
  const std::int64_t gone = clock - clock_;
  if (gone > 0 && gone <= longest_jump) since_ += gone;
  clock_ = clock;
  return stamp_ + since_ - behind;
}

}  // namespace tissue_sim
