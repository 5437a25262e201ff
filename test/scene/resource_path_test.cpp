#include "tissue_sim/scene/resource_path.h"

#include <gtest/gtest.h>

#include "environment.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::resource_path_test {
namespace {

TEST(ResourcePath, PlainPathsStartWhereTheyAreNamed) {
  const TemporaryFolder folder;
  const std::string mesh = folder.write("meshes/a.obj", "x");
  const std::string scene = folder.write("scenes/s.yaml", "x");
  EXPECT_EQ(resolve_path("../meshes/a.obj", scene), mesh);
  EXPECT_EQ(resolve_path(mesh, scene), mesh);
  EXPECT_EQ(resolve_path("file://" + mesh, scene), mesh);
  EXPECT_THROW(resolve_path("file://meshes/a.obj", scene), SceneError);
  EXPECT_THROW(resolve_path("../meshes/b.obj", scene), SceneError);
  EXPECT_THROW(resolve_path("../meshes", scene), SceneError);
  EXPECT_THROW(resolve_path("https://meshes/a.obj", scene), SceneError);
}

TEST(ResourcePath, PackagesAreFoundByTheNameInTheirPackageXml) {
  const TemporaryFolder folder;
  folder.write("first/group/folder_of_another_name/package.xml", "<package>\n <name> arm </name></package>");
  const std::string mesh = folder.write("first/group/folder_of_another_name/m/a.obj", "x");
  folder.write("second/arm/package.xml", "<package><name>arm</name></package>");
  folder.write("second/arm/m/a.obj", "x");
  folder.write("second/hidden/CATKIN_IGNORE", "");
  folder.write("second/hidden/leg/package.xml", "<package><name>leg</name></package>");
  const Environment packages("ROS_PACKAGE_PATH",
                             (folder.path / "first").string() + ":" + (folder.path / "second").string());
  const Environment prefixes("CMAKE_PREFIX_PATH", "");
  EXPECT_EQ(resolve_path("package://arm/m/a.obj", "/s.yaml"), mesh);
  EXPECT_THROW(resolve_path("package://leg/package.xml", "/s.yaml"), SceneError);
  EXPECT_THROW(resolve_path("package://arm/m/b.obj", "/s.yaml"), SceneError);
  EXPECT_THROW(resolve_path("package://", "/s.yaml"), SceneError);
}

TEST(ResourcePath, InstalledPackagesAndTheOwnOneNeedNoPackagePath) {
  const TemporaryFolder folder;
  folder.write("prefix/share/arm/package.xml", "<package><name>arm</name></package>");
  const std::string installed = folder.write("prefix/share/arm/a.obj", "x");
  folder.write("own/package.xml", "<package><name>own</name></package>");
  const std::string scene = folder.write("own/config/s.yaml", "x");
  const Environment packages("ROS_PACKAGE_PATH", "");
  const Environment prefixes("CMAKE_PREFIX_PATH", (folder.path / "prefix").string());
  EXPECT_EQ(resolve_path("package://arm/a.obj", scene), installed);
  EXPECT_EQ(resolve_path("package://own/config/s.yaml", scene), scene);
}

}  // namespace
}  // namespace tissue_sim::resource_path_test
