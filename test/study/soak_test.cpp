#include "tissue_sim/study/soak.h"

#include <gtest/gtest.h>

namespace tissue_sim::soak_test {
namespace {

TEST(Soak, PressesSlidesLeavesAndComesAgain) {
  static std::size_t asked;
  asked = 0;
  const SoakFigures figures = run_soak(2 * soak_cycle, [] { return asked++; });
  EXPECT_EQ(figures.allocations, std::size_t{2 * soak_cycle}) << "one between the two questions around each step";
  EXPECT_EQ(figures.steps, 2 * soak_cycle);
  EXPECT_EQ(figures.touches, 2);
  EXPECT_GT(3 * figures.contact_steps, figures.steps);
  EXPECT_LT(figures.contact_steps, figures.steps - figures.steps / 5);
  EXPECT_EQ(figures.recoveries, 0);
  EXPECT_GT(figures.memory, 1e6);
  EXPECT_GT(figures.start_slowest, 0.0);
  EXPECT_GT(figures.end_slowest, 0.0);
}

TEST(Soak, NamesWhatDoesNotHold) {
  SoakFigures good;
  good.steps = 1000;
  good.contact_steps = 500;
  good.seconds = 0.5;
  good.simulated = 1.0;
  good.memory = 1e7;
  good.memory_end = 1.05e7;
  good.start_slowest = 1e-4;
  good.end_slowest = 1.05e-4;
  EXPECT_EQ(fault(good), "");
  const auto says = [&good](const char* what, auto&& change) {
    SoakFigures bad = good;
    change(bad);
    EXPECT_NE(fault(bad).find(what), std::string::npos) << fault(bad);
  };
  says("slower than time", [](SoakFigures& f) { f.seconds = 1.5; });
  says("1 states went bad", [](SoakFigures& f) { f.recoveries = 1; });
  says("contact in only 100", [](SoakFigures& f) { f.contact_steps = 100; });
  says("1 heap allocations", [](SoakFigures& f) { f.allocations = 1; });
  says("grew by 1.20 MB", [](SoakFigures& f) { f.memory_end += 0.7e6; });
  says("from 100.0 to 111.0 us", [](SoakFigures& f) { f.end_slowest = 1.11e-4; });
}

}  // namespace
}  // namespace tissue_sim::soak_test
