#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "tissue_sim/replay/replay.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/accuracy.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::golden_test {
namespace {

const std::string source = TISSUE_SIM_SOURCE_DIR;
const std::string golden_file = "test/replay/golden_hashes.txt";

/// Costs as they are on the machines that the scenes were made for, not as they are here: what the dial chooses must
/// not depend on the clock.
SceneCost cost_elsewhere(const Scene& scene) {
  SceneCost cost;
  cost.step = scene.organs.front().model == Model::volume ? 0.01 : 0.001;
  cost.integrator = scene.organs.front().integrator;
  return cost;
}

struct Golden {
  std::string scene;
  std::uint64_t steps = 0;
  std::string hash;
};

std::vector<Golden> read_golden() {
  std::ifstream file(source + "/" + golden_file);
  std::vector<Golden> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    Golden row;
    std::istringstream words(line);
    words >> row.scene >> row.steps >> row.hash;
    EXPECT_TRUE(words && row.hash.size() == 16) << golden_file << ": " << line;
    rows.push_back(row);
  }
  return rows;
}

TEST(GoldenHashes, HoldForEveryShippedScene) {
  std::set<std::string> shipped;
  for (const auto& entry : std::filesystem::directory_iterator(source + "/config/scenes")) {
    shipped.insert(entry.path().filename().string());
  }
  for (const Golden& golden : read_golden()) {
    EXPECT_EQ(shipped.erase(golden.scene), 1u) << golden_file << ": " << golden.scene << " is no scene, or twice there";
    const std::string path = source + "/config/scenes/" + golden.scene;
    std::vector<std::string> warnings;
    std::vector<ModelChoice> choices;
    const Scene scene = choose_models(load_scene(path, warnings), load_accuracy_table(path), cost_elsewhere, choices);
    const TemporaryFolder folder;
    ReplayOptions options;
    options.input = source + "/config/demo.bag";
    options.output = (folder.path / "out.bag").string();
    const ReplaySummary summary = replay(scene, options);
    EXPECT_EQ(summary.steps, golden.steps) << golden.scene;
    EXPECT_EQ(hash_text(summary.hash), golden.hash)
        << golden.scene << " has other states than before. scripts/same_bits finds the first step that differs between "
        << "two builds. If the change is meant, say so in the commit, with why, and write the new hash into "
        << golden_file;
  }
  EXPECT_TRUE(shipped.empty()) << *shipped.begin() << " has no line in " << golden_file;
}

}  // namespace
}  // namespace tissue_sim::golden_test
