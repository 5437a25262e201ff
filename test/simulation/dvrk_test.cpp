#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "simulation/test_scenes.h"

namespace tissue_sim::dvrk_test {
namespace {

int naming(const std::vector<std::string>& warnings, const std::string& word) {
  return static_cast<int>(std::count_if(warnings.begin(), warnings.end(),
                                        [&](const std::string& line) { return line.find(word) != std::string::npos; }));
}

TEST(Dvrk, TheRealOrganAndForcepsLoadWithWarnings) {
  if (!std::ifstream(source_file("../shared/data/README.md"))) GTEST_SKIP() << "../shared/data is not there";
  std::vector<std::string> warnings;
  const Scene scene = load_scene(source_file("test/scenes/dvrk_stomach.yaml"), warnings);
  ASSERT_EQ(scene.organs.size(), 1u);
  ASSERT_EQ(scene.instruments.size(), 1u);
  EXPECT_TRUE(inspect(scene.organs[0].mesh).closed_manifold());
  EXPECT_FALSE(scene.organs[0].attached.empty());
  const std::vector<InstrumentPart>& parts = scene.instruments[0].parts;
  EXPECT_GT(parts.size(), 1u);
  EXPECT_GT(naming(warnings, "link_2"), 0) << "the half-open jaw";
  EXPECT_GT(naming(warnings, "zero"), 0) << "the link of no size";
  EXPECT_NO_THROW(build_world(scene));
}

}  // namespace
}  // namespace tissue_sim::dvrk_test
