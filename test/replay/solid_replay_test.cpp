#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tissue_sim/replay/replay.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::solid_replay_test {
namespace {

namespace fs = std::filesystem;

const fs::path source = TISSUE_SIM_SOURCE_DIR;
const fs::path shared_data = source / ".." / "shared" / "data";

std::string read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

void replace(std::string& text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << what;
  text.replace(at, what.size(), by);
}

/// The solid that scripts/make_solid makes, in the folder; empty where it failed.
std::string make_solid(const fs::path& surface, const TemporaryFolder& folder, const std::string& options) {
  const std::string out = (folder.path / "organ.msh").string();
  const std::string command =
      "'" + (source / "scripts" / "make_solid").string() + "' '" + surface.string() + "' '" + out + "' " + options;
  return std::system(command.c_str()) == 0 ? out : "";
}

ReplaySummary replay_with_solid(std::string yaml, const fs::path& scenes, const std::string& solid, const fs::path& bag,
                                const TemporaryFolder& folder) {
  replace(yaml, "model: surface", "model: fem\n    solid: " + solid);
  yaml.erase(yaml.find("    wall_thickness"),
             yaml.find('\n', yaml.find("    wall_thickness")) + 1 - yaml.find("    wall_thickness"));
  replace(yaml, "mesh: ../", "mesh: " + (scenes / "..").string() + "/");
  replace(yaml, "urdf: ../", "urdf: " + (scenes / "..").string() + "/");
  std::vector<std::string> warnings;
  const Scene scene = load_scene(folder.write("solid.yaml", yaml), warnings);
  ReplayOptions options;
  options.input = bag.string();
  options.output = (folder.path / "out.bag").string();
  return replay(scene, options);
}

/// The bundled liver as a solid under the bundled recording.
TEST(SolidReplay, TheBundledLiverFromMakeSolid) {
  if (std::system("command -v gmsh >/dev/null") != 0) GTEST_SKIP() << "gmsh is not installed";
  const TemporaryFolder folder;
  const std::string solid = make_solid(source / "config/organs/liver.obj", folder, "--edge 12");
  ASSERT_FALSE(solid.empty());
  const fs::path scenes = source / "config/scenes";
  const ReplaySummary summary =
      replay_with_solid(read(scenes / "demo.yaml"), scenes, solid, source / "config/demo.bag", folder);
  EXPECT_EQ(summary.poses_used, 881u);
  EXPECT_EQ(summary.non_finite, 0u);
  EXPECT_EQ(summary.counters.recoveries, 0u);
  EXPECT_GT(summary.depth_max, 0.0095);
  // Hertz with the probe's radius of 3 mm would be 0.5 N at 10 mm; edges of 12 mm are far coarser than its tip.
  EXPECT_GT(summary.force_max, 0.3);
  EXPECT_LT(summary.force_max, 3.0);
}

/// The real organ as a solid under the real recording, whole. The lattice needs no mesher.
TEST(SolidReplay, TheRealStomachUnderTheRealRecording) {
  const fs::path bag = shared_data / "dvrk/psm2_measured.bag";
  if (!fs::exists(bag)) GTEST_SKIP() << "no ../shared/data beside the repository";
  const TemporaryFolder folder;
  const std::string solid =
      make_solid(shared_data / "organs/gca_stomach_small_intestine.obj", folder, "--edge 8 --fitted");
  ASSERT_FALSE(solid.empty());
  const fs::path scenes = source / "test/scenes";
  const ReplaySummary summary = replay_with_solid(read(scenes / "dvrk_stomach.yaml"), scenes, solid, bag, folder);
  EXPECT_EQ(summary.poses_used, 3420u);
  EXPECT_EQ(summary.non_finite, 0u);
  EXPECT_EQ(summary.counters.recoveries, 0u);
  EXPECT_GT(summary.contact_steps, 1000u);
  EXPECT_GT(summary.depth_max, 0.010);
  EXPECT_GT(summary.force_max, 0.1);
}

}  // namespace
}  // namespace tissue_sim::solid_replay_test
