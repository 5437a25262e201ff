#include "tissue_sim/study/stability_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "floating_point_traps.h"

namespace tissue_sim::stability_map_test {
namespace {

StabilityCell liver(double time_step) {
  StabilityCell cell;
  cell.young = 5400.0;
  cell.poisson = 0.45;
  cell.damping = 0.1;
  cell.edge = 0.004;
  cell.time_step = time_step;
  return cell;
}

TEST(StabilityMap, IsThereFromEndToEnd) {
  const std::vector<StabilityCell> cells = stability_cells(false);
  EXPECT_GE(cells.size(), 1000u);
  const auto range = [&](double StabilityCell::*number) {
    const auto less = [number](const StabilityCell& a, const StabilityCell& b) { return a.*number < b.*number; };
    const auto [low, high] = std::minmax_element(cells.begin(), cells.end(), less);
    return std::make_pair((*low).*number, (*high).*number);
  };
  EXPECT_EQ(range(&StabilityCell::young), std::make_pair(500.0, 1e6));
  EXPECT_EQ(range(&StabilityCell::poisson), std::make_pair(0.25, 0.499));
  EXPECT_EQ(range(&StabilityCell::time_step), std::make_pair(0.0001, 0.050));
  EXPECT_EQ(range(&StabilityCell::damping), std::make_pair(0.0, 1.0));
  EXPECT_EQ(range(&StabilityCell::edge), std::make_pair(0.0002, 0.020));
  std::set<std::pair<Model, Integrator>> kinds;
  for (const StabilityCell& cell : cells) kinds.insert({cell.model, cell.integrator});
  EXPECT_EQ(kinds.size(), 8u) << "four models, two integrators";
}

TEST(StabilityMap, SomeOfAllOfItIsStableOrRefusedWithACure) {
  const std::vector<StabilityCell> cells = stability_cells(true);
  EXPECT_GE(cells.size(), 55u);
  const std::vector<StabilityRow> rows = map_stability(cells, nullptr);
  ASSERT_EQ(rows.size(), cells.size());
  std::set<Outcome> outcomes;
  for (const StabilityRow& row : rows) {
    outcomes.insert(row.outcome);
    EXPECT_EQ(row.reason.empty(), row.outcome == Outcome::stable) << row.reason;
  }
  EXPECT_EQ(outcomes, (std::set<Outcome>{Outcome::stable, Outcome::other_step, Outcome::other_material}))
      << stability_table(rows, "");
}

TEST(StabilityMap, ARefusalNamesTheStepThatIsStable) {
  const std::vector<StabilityRow> rows = map_stability({liver(0.001), liver(0.05)}, nullptr);
  EXPECT_EQ(rows[0].outcome, Outcome::stable) << rows[0].reason;
  EXPECT_GT(rows[0].contacts, 0);
  EXPECT_GT(rows[0].simulated, 50);
  EXPECT_EQ(rows[1].outcome, Outcome::other_step) << rows[1].reason;
  EXPECT_LT(rows[1].time_step, 0.05);
  EXPECT_NE(rows[1].reason.find("max_substeps"), std::string::npos) << rows[1].reason;
}

/// What the whole map found: descent whose sweeps gave energy to an organ alone, and one that swung freely until its
/// substeps were too long for it.
TEST(StabilityMap, OrgansOfTwentyMillimetreEdgesThatHardlyYieldAreStable) {
  StabilityCell soft = liver(0.001);
  soft.integrator = Integrator::vertex_block_descent;
  soft.young = 6e3;
  soft.poisson = 0.499;
  soft.edge = 0.02;
  soft.damping = 0.0;
  StabilityCell stiff = soft;
  stiff.model = Model::volume;
  stiff.young = 1e6;
  stiff.damping = 0.1;
  stiff.time_step = 0.0001;
  StabilityCell swinging = soft;
  swinging.integrator = Integrator::explicit_substeps;
  swinging.time_step = 0.05;
  const std::vector<StabilityRow> rows = map_stability({soft, stiff, swinging}, nullptr);
  EXPECT_EQ(rows[0].outcome, Outcome::stable) << rows[0].reason;
  EXPECT_LT(rows[0].energy_growth, 1.0);
  EXPECT_EQ(rows[1].outcome, Outcome::stable) << rows[1].reason;
  EXPECT_LT(rows[1].energy_growth, 1.0);
  EXPECT_EQ(rows[2].outcome, Outcome::other_step) << rows[2].reason;
}

/// It must not call everything good: a step beyond what a scene file may ask for is refused without one that would do.
TEST(StabilityMap, NamesWhatIsNeither) {
  const std::vector<StabilityRow> rows = map_stability({liver(0.2)}, nullptr);
  EXPECT_EQ(rows[0].outcome, Outcome::neither_of_these);
  const std::string table = stability_table(rows, "the command");
  EXPECT_NE(table.find("neither: fem, explicit, young 5400 Pa"), std::string::npos) << table;
  EXPECT_NE(stability_json(rows, "the command").find("\"outcome\": \"neither\""), std::string::npos);
}

}  // namespace
}  // namespace tissue_sim::stability_map_test
