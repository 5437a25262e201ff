#include "tissue_sim/scene/scene_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::scene_file_test {
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
    levels: {tolerance: 4%}
    wall_thickness: 0.004
    material: {young: 30000, poisson: 0.45, density: 1060, damping: 0.2, drag: 3}
    attachments:
      - sphere: {center: [0, 0, 0.05], radius: 0.01}
      - box: {min: [0.04, -0.01, -0.01], max: [0.06, 0.01, 0.01]}
  - {name: stone, mesh: organ.obj, scale: 0.0005, model: contact_only}
instruments:
  - {name: probe, urdf: probe.urdf, tip_link: tip, pose_topic: /PSM1/measured_cp}
)";

/// The octahedron around a vertex at its centre.
const char* const solid_octahedron =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n7\n1 0 0 50\n2 50 0 0\n3 0 50 0\n4 -50 0 0\n5 0 -50 0\n"
    "6 0 0 -50\n7 0 0 0\n$EndNodes\n$Elements\n8\n1 4 2 1 1 7 1 2 3\n2 4 2 1 1 7 1 3 4\n3 4 2 1 1 7 1 4 5\n"
    "4 4 2 1 1 7 1 5 2\n5 4 2 1 1 7 6 3 2\n6 4 2 1 1 7 6 4 3\n7 4 2 1 1 7 6 5 4\n8 4 2 1 1 7 6 2 5\n"
    "$EndElements\n";

/// A scene that leaves the model of its organ, of which more keys are given, to the accuracy.
std::string dial_scene(const std::string& accuracy, const std::string& keys) {
  return "frame: world\ntime_step: 0.001\naccuracy: " + accuracy +
         "\norgans:\n  - name: liver\n    scale: 0.001\n    pose: {parent: world, xyz: [1, 0, 0]}\n    " + keys +
         "\n    attachments:\n      - sphere: {center: [0, 0, -0.05], radius: 0.01}\ninstruments:\n"
         "  - {name: probe, urdf: probe.urdf, tip_link: tip, pose_topic: a/b}\n";
}
const std::string soft = "\n    material: {young: 5400, poisson: 0.45, density: 1060}";

/// `model solid` of each.
std::vector<std::string> names(const std::vector<Alternative>& alternatives) {
  std::vector<std::string> found;
  for (const Alternative& each : alternatives) {
    found.push_back(to_string(each.organ.model) + (each.solid.empty() ? "" : " " + each.solid));
  }
  return found;
}
using Names = std::vector<std::string>;

struct SceneFiles : TemporaryFolder {
  SceneFiles() {
    write("organ.obj", octahedron);
    write("probe.urdf", probe);
    write("solid.msh", solid_octahedron);
    write("other.msh", solid_octahedron);
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
  EXPECT_EQ(stomach.levels_tolerance, 0.04);
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
  EXPECT_FALSE(scene.organs[0].levels_tolerance);
  EXPECT_TRUE(scene.organs[0].attached.empty());
  EXPECT_EQ(scene.organs[1].wall_thickness, 0.0);
  EXPECT_EQ(scene.organs[1].material.density, 0.0);
}

TEST(SceneFile, AnAccuracyIsABudgetOrAnError) {
  const SceneFiles files;
  const Scene budget = files.load(dial_scene("{budget_ms: 0.8}", "mesh: organ.obj"));
  EXPECT_EQ(budget.accuracy.goal, Accuracy::Goal::budget);
  EXPECT_DOUBLE_EQ(budget.accuracy.value, 0.0008);
  EXPECT_NE(budget.accuracy.place.find("scene.yaml:3:12: accuracy.budget_ms: "), std::string::npos)
      << budget.accuracy.place;
  for (const char* part : {"5%", "5 %", "'5%'", "0.05", "5e-2"}) {
    const Scene error = files.load(dial_scene("{error: " + std::string(part) + "}", "mesh: organ.obj"));
    EXPECT_EQ(error.accuracy.goal, Accuracy::Goal::error);
    EXPECT_DOUBLE_EQ(error.accuracy.value, 0.05) << part;
  }
  EXPECT_EQ(files.load(full_scene).accuracy.goal, Accuracy::Goal::none);
}

TEST(SceneFile, WhatAnOrganGivesIsWhatItCanBe) {
  const SceneFiles files;
  const auto alternatives = [&](const std::string& keys) {
    return names(files.load(dial_scene("{budget_ms: 1}", keys)).alternatives.at(0));
  };
  EXPECT_EQ(alternatives("mesh: organ.obj"), Names({"contact_only"}));
  EXPECT_EQ(alternatives("mesh: organ.obj\n    wall_thickness: 0.003" + soft), Names({"contact_only", "surface"}));
  EXPECT_EQ(alternatives("mesh: solid.msh" + soft), Names({"contact_only", "volume solid.msh", "fem solid.msh"}));
  EXPECT_EQ(alternatives("mesh: organ.obj\n    solid: solid.msh" + soft),
            Names({"contact_only", "volume solid.msh", "fem solid.msh"}));
  EXPECT_EQ(
      alternatives("mesh: organ.obj\n    wall_thickness: 0.003\n    solid: [solid.msh, other.msh]" + soft),
      Names({"contact_only", "surface", "volume solid.msh", "volume other.msh", "fem solid.msh", "fem other.msh"}));
}

TEST(SceneFile, AlternativesAreWholeOrgans) {
  const SceneFiles files;
  const Scene scene = files.load(
      dial_scene("{budget_ms: 1}",
                 "mesh: organ.obj\n    wall_thickness: 0.003\n    restoration: false\n    solid: solid.msh" + soft));
  ASSERT_EQ(scene.alternatives.size(), 1u);
  ASSERT_EQ(scene.alternatives[0].size(), 4u);
  for (const Alternative& each : scene.alternatives[0]) {
    const Organ& organ = each.organ;
    const bool solid = is_solid(organ.model);
    EXPECT_EQ(organ.name, "liver");
    EXPECT_FALSE(organ.restoration);
    EXPECT_EQ(organ.material.young, 5400);
    EXPECT_EQ(organ.wall_thickness, organ.model == Model::surface ? 0.003 : 0.0);
    EXPECT_EQ(organ.solid.tetrahedra.size(), solid ? 8u : 0u);
    EXPECT_EQ(organ.embedded, solid);
    ASSERT_EQ(organ.attached.size(), 1u);
    const std::vector<Vector3>& bearers = solid ? organ.solid.vertices : organ.mesh.vertices;
    EXPECT_NEAR((bearers[static_cast<std::size_t>(organ.attached[0])] - Vector3(1, 0, -0.05)).norm(), 0.0, 1e-9);
  }
}

TEST(SceneFile, AMeshThatIsASolidIsNotEmbedded) {
  const SceneFiles files;
  const Scene scene = files.load(dial_scene("{budget_ms: 1}", "mesh: solid.msh" + soft));
  ASSERT_EQ(scene.alternatives[0].size(), 3u);
  EXPECT_TRUE(scene.alternatives[0][0].organ.solid.empty());
  EXPECT_FALSE(scene.alternatives[0][2].organ.embedded);
  EXPECT_EQ(scene.alternatives[0][2].organ.solid.vertices.size(), 7u);
}

TEST(SceneFile, PoissonsRatioDecidesWhatAnOrganCanBe) {
  const SceneFiles files;
  const auto load = [&](const std::string& poisson, std::vector<std::string>& warnings) {
    const std::string keys =
        "mesh: organ.obj\n    wall_thickness: 0.003\n    solid: solid.msh\n    material: {young: 1, poisson: ";
    const std::string scene = dial_scene("{error: 5%}", keys + poisson + ", density: 1}");
    return names(load_scene(files.write("scene.yaml", scene), warnings).alternatives.at(0));
  };
  std::vector<std::string> warnings;
  EXPECT_EQ(load("0.3", warnings), Names({"contact_only", "volume solid.msh", "fem solid.msh"}));
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("accuracy does without surface"), std::string::npos) << warnings[0];
  EXPECT_EQ(load("0.1", warnings), Names({"contact_only", "fem solid.msh"}));
  EXPECT_EQ(warnings.size(), 3u);
}

TEST(SceneFile, AModelThatIsNamedWins) {
  const SceneFiles files;
  std::vector<std::string> warnings;
  const std::string text = dial_scene("{error: 5%}", "model: fem\n    mesh: organ.obj\n    solid: solid.msh" + soft);
  const Scene scene = load_scene(files.write("scene.yaml", text), warnings);
  EXPECT_EQ(scene.organs[0].model, Model::fem);
  ASSERT_EQ(scene.alternatives.size(), 1u);
  EXPECT_TRUE(scene.alternatives[0].empty());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("accuracy: chooses nothing"), std::string::npos) << warnings[0];
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
}  // namespace tissue_sim::scene_file_test
