#include "tissue_sim/ros/holding.h"

#include <gtest/gtest.h>

namespace tissue_sim::holding_test {
namespace {

constexpr std::int64_t second = 1'000'000'000;
constexpr std::int64_t year = 31'557'600 * second;

TEST(Holding, GoesOnWithTheClock) {
  Holding holding;
  EXPECT_FALSE(holding.begun());
  holding.pose(100 * second, 5 * second);
  EXPECT_TRUE(holding.begun());
  EXPECT_EQ(holding.until(5 * second, 0), 100 * second);
  EXPECT_EQ(holding.until(7 * second, 0), 102 * second);
  EXPECT_EQ(holding.until(8 * second, second), 102 * second);
  EXPECT_EQ(holding.until(8 * second, 0), 103 * second) << "a clock that stands";
  holding.pose(200 * second, 9 * second);
  EXPECT_EQ(holding.until(10 * second, 0), 201 * second);
}

TEST(Holding, LeavesOutWhatTheClockJumps) {
  for (const std::int64_t jump : {-second, -year, Holding::longest_jump + 1, year, 130 * year}) {
    Holding holding;
    const std::int64_t start = 2 * year;
    holding.pose(50 * second, start);
    EXPECT_EQ(holding.until(start + second, 0), 51 * second);
    EXPECT_EQ(holding.until(start + second + jump, 0), 51 * second) << jump;
    EXPECT_EQ(holding.until(start + 2 * second + jump, 0), 52 * second) << "and goes on from there, " << jump;
  }
}

TEST(Holding, FollowsAClockThatTicksSeldom) {
  Holding holding;
  holding.pose(50 * second, 1 * second);
  EXPECT_EQ(holding.until(1 * second + Holding::longest_jump, 0), 50 * second + Holding::longest_jump);
}

}  // namespace
}  // namespace tissue_sim::holding_test
