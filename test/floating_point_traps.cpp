#include "floating_point_traps.h"

#include <gtest/gtest.h>

#include <cstdlib>

/// Linked into every test program: with TISSUE_SIM_TRAPS=1 it runs with traps. Threads inherit them from the one that
/// starts them.
namespace tissue_sim {
namespace {

bool wanted() {
  return std::getenv("TISSUE_SIM_TRAPS") != nullptr;
}

class FloatingPointTraps : public testing::Environment {
 public:
  void SetUp() override {
    if (!wanted()) return;
    std::feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(trapped_exceptions);
  }
  void TearDown() override { fedisableexcept(trapped_exceptions); }
};

const testing::Environment* const traps = testing::AddGlobalTestEnvironment(new FloatingPointTraps);

TEST(FloatingPointTraps, AreOnWhereTheyAreWanted) {
  ASSERT_NE(traps, nullptr);
  const int expected = wanted() ? trapped_exceptions : 0;
  EXPECT_EQ(fegetexcept() & trapped_exceptions, expected);
  {
    const WithoutTraps off;
    volatile double zero = 0.0;
    EXPECT_FALSE(zero / zero == 0.0);
  }
  EXPECT_EQ(fegetexcept() & trapped_exceptions, expected);
}

}  // namespace
}  // namespace tissue_sim
