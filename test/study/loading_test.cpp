#include "tissue_sim/study/loading.h"

#include <gtest/gtest.h>

#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::loading_test {
namespace {

TEST(LoadBench, ItsEllipsoidIsAClosedSurfaceOfTwentySquares) {
  const TriangleMesh mesh = make_ellipsoid({0.09, 0.06, 0.04}, 9);
  EXPECT_EQ(mesh.triangles.size(), 20U * 81U);
  EXPECT_EQ(mesh.vertices.size(), 10U * 81U + 2U);
  EXPECT_TRUE(inspect(mesh).closed_manifold());
  EXPECT_NEAR(enclosed_volume(mesh), 4.0 / 3.0 * 3.14159265 * 0.09 * 0.06 * 0.04, 0.02 * 9.05e-4);
}

TEST(LoadBench, BothFilesHoldTheSameSurface) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = make_ellipsoid({90.0, 60.0, 40.0}, 5);
  write_obj(mesh, (folder.path / "organ.obj").string());
  write_stl(mesh, (folder.path / "organ.stl").string());
  for (const char* file : {"organ.obj", "organ.stl"}) {
    std::vector<std::string> warnings;
    const TriangleMesh read = load_organ_mesh((folder.path / file).string(), 0.001, warnings);
    EXPECT_TRUE(warnings.empty()) << file << ": " << warnings.front();
    EXPECT_EQ(read.vertices.size(), mesh.vertices.size()) << file;
    EXPECT_EQ(read.triangles.size(), mesh.triangles.size()) << file;
    EXPECT_NEAR(enclosed_volume(read), 1e-9 * enclosed_volume(mesh), 1e-10) << file;
  }
}

TEST(LoadBench, SaysWhatItLoaded) {
  const std::vector<LoadCost> costs = time_loading(2000);
  ASSERT_EQ(costs.size(), 4U);
  for (const LoadCost& cost : costs) {
    EXPECT_EQ(cost.triangles, 2000);
    EXPECT_GT(cost.whole, 0.0);
    EXPECT_GT(cost.read, 0.0);
    EXPECT_GT(cost.mend, 0.0);
    EXPECT_GT(cost.tree, 0.0);
    EXPECT_GT(cost.memory, 1e6);
  }
}

}  // namespace
}  // namespace tissue_sim::loading_test
