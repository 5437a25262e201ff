#include "tissue_sim/scene/scene_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "temporary_folder.h"

namespace tissue_sim {
namespace {

const char* const octahedron =
    "v 0 0 50\nv 50 0 0\nv 0 50 0\nv -50 0 0\nv 0 -50 0\nv 0 0 -50\n"
    "f 1 2 3\nf 1 3 4\nf 1 4 5\nf 1 5 2\nf 6 3 2\nf 6 4 3\nf 6 5 4\nf 6 2 5\n";
const char* const probe =
    "<robot name=\"p\"><link name=\"tip\"><collision><geometry><sphere radius=\"0.005\"/></geometry></collision>"
    "</link></robot>";

const char* const full_scene = R"(frame: world
gravity: [0, 0, -9.81]
time_step: 2e-3
max_substeps: 40
frames:                                # a child may stand before its parent
  - {name: bed, parent: room, xyz: [0, 0, 1], rpy: [0, 0, 1.5707963267948966]}
  - {name: room, parent: world, xyz: [10, 0, 0]}
organs:
  - name: stomach
    mesh: organ.obj
    scale: 0.001
    pose: {parent: bed, xyz: [1, 0, 0], rpy: [0, 0, 0]}
    model: surface
    restoration: false
    colliding_set: paper
    depth: paper
    wall_thickness: 0.004
    material: {young: 30000, poisson: 0.45, density: 1060, damping: 0.2, drag: 3}
    attachments:
      - sphere: {center: [0, 0, 0.05], radius: 0.01}
      - box: {min: [0.04, -0.01, -0.01], max: [0.06, 0.01, 0.01]}
  - {name: stone, mesh: organ.obj, scale: 0.0005, model: contact_only}
instruments:
  - {name: probe, urdf: probe.urdf, tip_link: tip, pose_topic: /PSM1/measured_cp}
)";

struct SceneFiles : TemporaryFolder {
  SceneFiles() {
    write("organ.obj", octahedron);
    write("probe.urdf", probe);
  }
  Scene load(const std::string& text) const {
    std::vector<std::string> warnings;
    return load_scene(write("scene.yaml", text), warnings);
  }
};

TEST(SceneFile, EveryKeyArrives) {
  const SceneFiles files;
  const Scene scene = files.load(full_scene);
  EXPECT_EQ(scene.frame, "world");
  EXPECT_EQ(scene.gravity, Vector3(0, 0, -9.81));
  EXPECT_EQ(scene.time_step, 0.002);
  EXPECT_EQ(scene.max_substeps, 40);
  ASSERT_EQ(scene.organs.size(), 2u);
  const Organ& stomach = scene.organs[0];
  EXPECT_EQ(stomach.name, "stomach");
  EXPECT_EQ(stomach.model, Model::surface);
  EXPECT_FALSE(stomach.restoration);
  EXPECT_EQ(stomach.colliding_set, CollidingSet::paper);
  EXPECT_EQ(stomach.depth, DepthScheme::paper);
  EXPECT_EQ(stomach.wall_thickness, 0.004);
  EXPECT_EQ(stomach.material.young, 30000);
  EXPECT_EQ(stomach.material.poisson, 0.45);
  EXPECT_EQ(stomach.material.density, 1060);
  EXPECT_EQ(stomach.material.damping, 0.2);
  EXPECT_EQ(stomach.material.drag, 3);
  EXPECT_EQ(stomach.attached.size(), 2u);
  EXPECT_TRUE(std::is_sorted(stomach.attached.begin(), stomach.attached.end()));
  ASSERT_EQ(scene.instruments.size(), 1u);
  EXPECT_EQ(scene.instruments[0].name, "probe");
  EXPECT_EQ(scene.instruments[0].tip_link, "tip");
  EXPECT_EQ(scene.instruments[0].pose_topic, "/PSM1/measured_cp");
  EXPECT_EQ(scene.instruments[0].parts.size(), 1u);
}

TEST(SceneFile, PosesChainThroughTheFrames) {
  const SceneFiles files;
  const Scene scene = files.load(full_scene);
  // 1 along x of the bed, which is turned a quarter about z and stands at (10, 0, 1).
  Vector3 centre = Vector3::Zero();
  for (const Vector3& p : scene.organs[0].mesh.vertices) centre += p / 6.0;
  EXPECT_NEAR((centre - Vector3(10, 1, 1)).norm(), 0.0, 1e-9);
  // The vertex at +x of the organ's own frame is attached, and now lies at +y.
  const Vector3 held = scene.organs[0].mesh.vertices[scene.organs[0].attached[1]] - centre;
  EXPECT_NEAR((held - Vector3(0, 0.05, 0)).norm(), 0.0, 1e-7);
}

TEST(SceneFile, DefaultsOfWhatIsLeftOut) {
  const SceneFiles files;
  const Scene scene = files.load(R"(frame: world
time_step: 0.001
organs:
  - {name: a, mesh: organ.obj, scale: 0.001, model: surface, wall_thickness: 0.003,
     material: {young: 5400, poisson: 0.45, density: 1060}}
  - {name: b, mesh: organ.obj, scale: 0.001, model: contact_only}
instruments:
  - {name: probe, urdf: probe.urdf, tip_link: tip, pose_topic: a/b}
)");
  EXPECT_EQ(scene.gravity, Vector3(0, 0, 0));
  EXPECT_EQ(scene.max_substeps, 100);
  EXPECT_TRUE(scene.organs[0].restoration);
  EXPECT_EQ(scene.organs[0].colliding_set, CollidingSet::flood);
  EXPECT_EQ(scene.organs[0].depth, DepthScheme::exact);
  EXPECT_EQ(scene.organs[0].material.damping, 0.1);
  EXPECT_EQ(scene.organs[0].material.drag, 5.0);
  EXPECT_TRUE(scene.organs[0].attached.empty());
  EXPECT_EQ(scene.organs[1].wall_thickness, 0.0);
  EXPECT_EQ(scene.organs[1].material.density, 0.0);
}

TEST(SceneFile, WarningsCarryTheirPlace) {
  const SceneFiles files;
  std::string inward = octahedron;
  for (std::size_t f = inward.find("f "); f != std::string::npos; f = inward.find("f ", f + 2)) {
    std::swap(inward[f + 2], inward[f + 4]);
  }
  files.write("organ.obj", inward);
  std::vector<std::string> warnings;
  const std::string path = files.write("scene.yaml", full_scene);
  load_scene(path, warnings);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0].find(path + ":10:5: organs[0].mesh: "), 0u) << warnings[0];
  EXPECT_NE(warnings[0].find("turned 8 triangles"), std::string::npos) << warnings[0];
}

TEST(SceneFile, AMissingFileIsASceneError) {
  std::vector<std::string> warnings;
  EXPECT_THROW(load_scene("/nowhere/scene.yaml", warnings), SceneError);
  EXPECT_THROW(load_scene("/", warnings), SceneError);
}

TEST(SceneFile, AListThatHoldsItselfIsASceneError) {
  const SceneFiles files;
  EXPECT_THROW(files.load("frame: world\ntime_step: 0.001\norgans: &x [*x]\n"), SceneError);
  EXPECT_THROW(files.load("? [frame]\n: world\n"), SceneError);
  EXPECT_THROW(files.load(std::string("frame: \"wor\\0ld\"\n")), SceneError);
}

TEST(SceneFile, EveryTruncationLoadsOrIsASceneError) {
  const SceneFiles files;
  const std::string text = full_scene;
  int loaded = 0;
  for (std::size_t length = 0; length <= text.size(); ++length) {
    try {
      files.load(text.substr(0, length));
      ++loaded;
    } catch (const SceneError& error) {
      const std::string what = error.what();
      EXPECT_NE(what.find("scene.yaml:"), std::string::npos) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }
  EXPECT_EQ(loaded, 2);  // the whole, and the whole without its last line break
}

TEST(SceneFile, EveryDamagedByteLoadsOrIsASceneError) {
  const SceneFiles files;
  int refused = 0;
  for (const char damage : {'\0', '\t', ':', '[', '"', '&', '*', '-', '\xff'}) {
    for (std::size_t at = 0; at < std::string(full_scene).size(); at += 5) {
      std::string text = full_scene;
      text[at] = damage;
      try {
        files.load(text);
      } catch (const SceneError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace tissue_sim
