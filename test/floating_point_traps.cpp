#include "floating_point_traps.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

/// Linked into every test program, which runs with traps unless TISSUE_SIM_TRAPS=0 says otherwise. Threads inherit them
/// from the one that starts them.
namespace tissue_sim {
namespace {

/// clang takes it that nobody looks at exceptions, and computes lanes that are not asked for; some processors have no
/// traps.
bool possible() {
#ifdef __clang__
  return false;
#else
  const int before = fegetexcept();
  const bool accepted = feenableexcept(trapped_exceptions) != -1 &&
                        (fegetexcept() & trapped_exceptions) == trapped_exceptions;
  fedisableexcept(trapped_exceptions & ~before);
  return accepted;
#endif
}

bool wanted() {
  const char* set = std::getenv("TISSUE_SIM_TRAPS");
  return (set == nullptr || std::string(set) != "0") && possible();
}

class FloatingPointTraps : public testing::Environment {
 public:
  void SetUp() override {
    std::feclearexcept(FE_ALL_EXCEPT);  // one from before would be noticed now
    if (!wanted()) return;
    feenableexcept(trapped_exceptions);
  }
  void TearDown() override { fedisableexcept(trapped_exceptions); }
};

const testing::Environment* const traps = testing::AddGlobalTestEnvironment(new FloatingPointTraps);

TEST(FloatingPointTraps, AreOn) {
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

TEST(FloatingPointTraps, EndTheProgram) {
  if (!wanted()) GTEST_SKIP() << "none here";
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  volatile double zero = 0.0;
  volatile double large = 1e300;
  volatile double result = 0.0;
  EXPECT_DEATH(result = zero / zero, "");
  EXPECT_DEATH(result = large / zero, "");
  EXPECT_DEATH(result = large * large, "");
  EXPECT_EQ(result, 0.0);
}

}  // namespace
}  // namespace tissue_sim
