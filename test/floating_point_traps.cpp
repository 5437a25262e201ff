#include "floating_point_traps.h"

#include <gtest/gtest.h>

/// Linked into every test program: the whole suite runs with traps. Threads inherit them from the one that starts them.
namespace tissue_sim {
namespace {

class FloatingPointTraps : public testing::Environment {
 public:
  void SetUp() override {
    std::feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(trapped_exceptions);
  }
  void TearDown() override { fedisableexcept(trapped_exceptions); }
};

const testing::Environment* const traps = testing::AddGlobalTestEnvironment(new FloatingPointTraps);

TEST(FloatingPointTraps, AreOn) {
  ASSERT_NE(traps, nullptr);
  EXPECT_EQ(fegetexcept() & trapped_exceptions, trapped_exceptions);
  {
    const WithoutTraps off;
    volatile double zero = 0.0;
    EXPECT_FALSE(zero / zero == 0.0);
  }
  EXPECT_EQ(fegetexcept() & trapped_exceptions, trapped_exceptions);
}

}  // namespace
}  // namespace tissue_sim
