#include "tissue_sim/scene/instrument_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::instrument_file_test {
namespace {

Vector3 centre(const TriangleMesh& mesh) {
  Vector3 low = mesh.vertices.front(), high = low;
  for (const Vector3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return 0.5 * (low + high);
}

int count_with(const std::vector<std::string>& lines, const std::string& part) {
  int found = 0;
  for (const std::string& line : lines) found += line.find(part) != std::string::npos;
  return found;
}

TEST(InstrumentFile, PartsStandInTheTipFrame) {
  //  base --(0.1 along x, a quarter turn about z)--> arm --(0.2 along its x)--> tip
  const TemporaryFolder folder;
  const std::string path = folder.write("arm.urdf", R"(<robot name="arm">
  <link name="base"><collision><geometry><box size="0.02 0.02 0.02"/></geometry></collision></link>
  <link name="arm">
    <collision><origin xyz="0.1 0 0" rpy="0 1.5707963267948966 0"/>
      <geometry><cylinder radius="0.004" length="0.1"/></geometry></collision>
    <collision><geometry><sphere radius="0.006"/></geometry></collision>
  </link>
  <link name="tip"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><limit lower="0.5" upper="1" effort="1" velocity="1"/></joint>
  <joint name="b" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>
</robot>)");
  std::vector<std::string> warnings;
  const std::vector<InstrumentPart> parts = load_instrument(path, "tip", warnings);
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].link, "arm");
  EXPECT_EQ(parts[1].link, "arm");
  EXPECT_EQ(parts[2].link, "base");
  EXPECT_EQ(parts[0].mesh.triangles.size(), static_cast<std::size_t>(4 * cylinder_segments));
  EXPECT_EQ(parts[1].mesh.triangles.size(), static_cast<std::size_t>(2 * sphere_slices * (sphere_slices - 1)));
  EXPECT_NEAR((centre(parts[0].mesh) - Vector3(-0.1, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((centre(parts[1].mesh) - Vector3(-0.2, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((centre(parts[2].mesh) - Vector3(-0.2, 0.1, 0)).norm(), 0.0, 1e-12);
  for (const Vector3& p : parts[0].mesh.vertices) {
    EXPECT_LE(std::abs(p.x() + 0.1), 0.05 + 1e-12);  // the cylinder lies along x
    EXPECT_LE(std::hypot(p.y(), p.z()), 0.004 + 1e-12);
  }
  for (const InstrumentPart& part : parts) {
    EXPECT_TRUE(part.closed);
    EXPECT_TRUE(inspect(part.mesh).closed_manifold());
  }
}

TEST(InstrumentFile, VisualStandsInAndZeroSizesAreSkipped) {
  const TemporaryFolder folder;
  const std::string path = folder.write("v.urdf", R"(<robot name="v">
  <link name="tip">
    <visual><geometry><box size="0 0 0"/></geometry></visual>
    <visual><geometry><sphere radius="0.006"/></geometry></visual>
  </link>
</robot>)");
  std::vector<std::string> warnings;
  EXPECT_EQ(load_instrument(path, "tip", warnings).size(), 1u);
  EXPECT_EQ(count_with(warnings, "link 'tip': has no <collision>, its <visual> is used"), 1);
  EXPECT_EQ(count_with(warnings, "zero size is skipped"), 1);
}

TEST(InstrumentFile, MeshesAreScaledAndFoundBesideTheFile) {
  const TemporaryFolder folder;
  folder.write("meshes/t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string path = folder.write("m.urdf", R"(<robot name="m"><link name="tip"><collision>
    <geometry><mesh filename="meshes/t.obj" scale="0.001 0.002 0.003"/></geometry></collision></link></robot>)");
  std::vector<std::string> warnings;
  const std::vector<InstrumentPart> parts = load_instrument(path, "tip", warnings);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_NEAR(enclosed_volume(parts[0].mesh), 1e-9, 1e-15);
  EXPECT_TRUE(warnings.empty());
}

TEST(InstrumentFile, EveryTruncationIsASceneError) {
  const TemporaryFolder folder;
  const std::string text =
      "<?xml version=\"1.0\"?>\n<!-- a > b --><robot name=\"r\">\n<link name=\"tip\"><collision><geometry>"
      "<sphere radius=\"0.01\"/></geometry></collision></link>\n</robot>";
  std::vector<std::string> warnings;
  EXPECT_EQ(load_instrument(folder.write("r.urdf", text), "tip", warnings).size(), 1u);
  for (std::size_t length = 0; length < text.size(); ++length) {
    const std::string path = folder.write("r.urdf", text.substr(0, length));
    EXPECT_THROW(load_instrument(path, "tip", warnings), SceneError) << text.substr(0, length);
  }
}

TEST(InstrumentFile, RealForceps) {
  const std::string path = TISSUE_SIM_SOURCE_DIR "/../shared/data/dvrk/cadiere.urdf";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
  std::vector<std::string> warnings;
  std::map<std::string, std::size_t> triangles;
  for (const InstrumentPart& part : load_instrument(path, "tool_tip", warnings)) {
    EXPECT_TRUE(part.closed) << part.link;
    EXPECT_TRUE(inspect(part.mesh).closed_manifold()) << part.link;
    triangles[part.link] += part.mesh.triangles.size();
  }
  const std::map<std::string, std::size_t> expected{
      {"jaw_axle", 140}, {"jaw_left", 1156}, {"jaw_right", 1156}, {"tool_shaft", 96}, {"wrist", 4738}};
  EXPECT_EQ(triangles, expected);
  EXPECT_EQ(count_with(warnings, "its <visual> is used"), 3);
  EXPECT_EQ(count_with(warnings, "closed 586 boundary edges"), 2);
  EXPECT_EQ(count_with(warnings, "closed 20 boundary edges"), 1);
  EXPECT_EQ(count_with(warnings, "link 'jaw_virtual': a primitive of zero size is skipped"), 1);
}

}  // namespace
}  // namespace tissue_sim::instrument_file_test
