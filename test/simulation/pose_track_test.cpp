#include "tissue_sim/simulation/pose_track.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>

namespace tissue_sim::pose_track_test {
namespace {

TEST(PoseQueue, IsADeque) {
  std::mt19937 random(1);
  PoseQueue queue;
  std::deque<std::int64_t> plain;
  std::size_t longest = 0;
  for (std::int64_t i = 0; i < 100000; ++i) {
    // Grows for a while, then shrinks to nothing.
    const auto chance = random() % 10;
    if (chance == 0 && random() % 1000 == 0) {
      queue.clear();
      plain.clear();
    } else if (plain.empty() || chance < (i / 1000 % 2 == 0 ? 7U : 3U)) {
      StampedPose pose;
      pose.stamp = i;
      queue.push_back(pose);
      plain.push_back(i);
    } else {
      queue.pop_front();
      plain.pop_front();
    }
    ASSERT_EQ(queue.empty(), plain.empty());
    ASSERT_EQ(queue.size(), plain.size());
    if (!plain.empty()) {
      ASSERT_EQ(queue.front().stamp, plain.front());
    }
    longest = std::max(longest, plain.size());
  }
  EXPECT_GT(longest, 100u);
}

/// Diagnostics and logs count poses under these words.
TEST(PoseVerdict, HasAWordForEach) {
  const std::pair<PoseVerdict, const char*> words[] = {{PoseVerdict::used, "used"},
                                                       {PoseVerdict::zero_stamp, "zero stamp"},
                                                       {PoseVerdict::non_finite, "non-finite"},
                                                       {PoseVerdict::zero_quaternion, "zero quaternion"},
                                                       {PoseVerdict::stale, "stale"},
                                                       {PoseVerdict::new_run, "new run"},
                                                       {PoseVerdict::late_stamp, "late stamp"},
                                                       {PoseVerdict::too_far, "too far"}};
  EXPECT_EQ(std::size(words), static_cast<std::size_t>(pose_verdicts));
  for (const auto& [verdict, word] : words) EXPECT_STREQ(to_string(verdict), word);
}

}  // namespace
}  // namespace tissue_sim::pose_track_test
