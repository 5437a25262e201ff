#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "floating_point_traps.h"
#include "tissue_sim/scene/scene_file.h"

namespace tissue_sim::malformed_test {
namespace {

const std::string folder = TISSUE_SIM_SOURCE_DIR "/test/malformed/";

struct Case {
  const char* scene;  ///< file name without .yaml
  int line;
  const char* key;
  const char* cure;  ///< a piece of what the error says is allowed
};

/// Each file is good.yaml with one thing wrong.
const Case cases[] = {
    // clang-format off
    {"empty", 1, "scene", "is empty"},
    {"only_a_list", 1, "scene", "allowed is a mapping"},
    {"two_documents", 1, "scene", "a scene is one"},
    {"tab", 6, "scene", "is not YAML"},
    {"open_bracket", 11, "scene", "is not YAML"},
    {"unknown_key", 3, "gravitty", "did you mean gravity?"},
    {"key_of_another_room", 7, "organs[0].wall_thicknes", "did you mean wall_thickness?"},
    {"far_from_any_key", 16, "instruments[0].colour", "allowed are name, urdf, tip_link, pose_topic"},
    {"doubled_key", 7, "organs[0].scale", "stands here and in line 6, delete one"},
    {"no_frame", 1, "frame", "is missing, add it"},
    {"frame_name", 1, "frame", "a letter, then letters, digits and _"},
    {"no_time_step", 1, "time_step", "is missing, add it"},
    {"time_step_zero", 2, "time_step", "from 1e-6 to 0.1, in seconds"},
    {"time_step_in_ms", 2, "time_step", "from 1e-6 to 0.1, in seconds"},
    {"time_step_nan", 2, "time_step", "from 1e-6 to 0.1, in seconds"},
    {"time_step_text", 2, "time_step", "allowed is a number"},
    {"time_step_unit", 2, "time_step", "allowed is a number"},
    {"substeps_half", 3, "max_substeps", "a whole number from 1 to 10000"},
    {"gravity_short", 3, "gravity", "three finite numbers"},
    {"gravity_infinite", 3, "gravity", "not all finite"},
    {"no_organs", 3, "organs", "at least one organ"},
    {"no_instruments", 1, "instruments", "at least one instrument"},
    {"organs_no_list", 3, "organs", "allowed is a list"},
    {"organ_name", 4, "organs[0].name", "a letter, then letters"},
    {"organ_name_number", 4, "organs[0].name", "in quotes if it looks like a number"},
    {"same_name", 13, "instruments[0].name", "give each its own"},
    {"model_unknown", 7, "organs[0].model", "contact_only, surface, volume, fem"},
    {"model_volume", 5, "organs[0].mesh", "needs a solid: name the file that this command makes: scripts/make_solid"},
    {"model_fem", 5, "organs[0].mesh", "needs a solid: name the file that this command makes: scripts/make_solid"},
    {"model_missing", 4, "organs[0].model", "is missing, add it (contact_only, surface, volume, fem), or give the scene an accuracy"},
    {"accuracy_both", 3, "accuracy", "has 2 of its keys, allowed is one of budget_ms, error"},
    {"accuracy_empty", 3, "accuracy", "has 0 of its keys, allowed is one of budget_ms, error"},
    {"accuracy_unknown", 3, "accuracy.budget", "allowed are budget_ms, error"},
    {"accuracy_number", 3, "accuracy", "allowed is a mapping with the keys budget_ms, error"},
    {"accuracy_zero_percent", 3, "accuracy.error", "is '0%', allowed is a part above 0%"},
    {"accuracy_five", 3, "accuracy.error", "is '5', allowed is a part above 0% and at most 100%, such as 5% or 0.05"},
    {"accuracy_many_percent", 3, "accuracy.error", "at most 100%"},
    {"accuracy_word", 3, "accuracy.error", "such as 5% or 0.05"},
    {"accuracy_percent_alone", 3, "accuracy.error", "such as 5% or 0.05"},
    {"accuracy_negative", 3, "accuracy.budget_ms", "a number above 0, in milliseconds a step"},
    {"accuracy_zero", 3, "accuracy.budget_ms", "a number above 0, in milliseconds a step"},
    {"accuracy_budget_unit", 3, "accuracy.budget_ms", "a number above 0, in milliseconds a step"},
    {"accuracy_no_material", 5, "organs[0].material", "is missing, add it"},
    {"accuracy_poisson", 9, "organs[0].material.poisson", "to below 0.5"},
    {"accuracy_solid_gone", 7, "organs[0].solid", "there is no file"},
    {"accuracy_solid_twice", 7, "organs[0].solid", "holds 'a.msh' twice, delete one"},
    {"accuracy_solid_empty", 7, "organs[0].solid", "is an empty list"},
    {"accuracy_solid_number", 7, "organs[0].solid", "holds '8', allowed are a text and a list of texts"},
    {"solid_list_and_model", 6, "organs[0].solid", "but model is fem: name one file, or delete model"},
    {"solid_not_used", 6, "organs[0].solid", "is used by the models volume and fem only"},
    {"wall_not_used", 8, "organs[0].wall_thickness", "delete it"},
    {"levels_number", 9, "organs[0].levels", "allowed is a mapping with the keys tolerance"},
    {"levels_unit", 9, "organs[0].levels.tolerance", "such as 5% or 0.05"},
    {"levels_five", 9, "organs[0].levels.tolerance", "is '5', allowed is a part above 0%"},
    {"levels_zero", 9, "organs[0].levels.tolerance", "above 0%"},
    {"levels_half", 9, "organs[0].levels.tolerance", "is '50%', allowed is at most 30%"},
    {"levels_empty", 9, "organs[0].levels.tolerance", "is missing, add it"},
    {"levels_unknown", 9, "organs[0].levels.error", "allowed are tolerance"},
    {"levels_contact_only", 8, "organs[0].levels", "contact_only simulates none of it: delete it"},
    {"levels_descent", 8, "organs[0].levels", "are moved explicitly, and integrator is vertex_block_descent"},
    {"levels_plastic", 8, "organs[0].levels", "restoration is false: delete one of the two"},
    {"levels_embedded", 9, "organs[0].levels", "delete levels, or name the solid as the mesh"},
    {"levels_volume", 8, "organs[0].levels", "is used by the models surface and fem only"},
    {"wall_missing", 4, "organs[0].wall_thickness", "is missing, add it"},
    {"wall_negative", 8, "organs[0].wall_thickness", "above 0, in metres"},
    {"material_missing", 4, "organs[0].material", "is missing, add it"},
    {"young_zero", 9, "organs[0].material.young", "above 0, in Pa"},
    {"poisson_half", 9, "organs[0].material.poisson", "to below 0.5"},
    {"poisson_small", 9, "organs[0].material.poisson", "from 1/3"},
    {"density_missing", 9, "organs[0].material.density", "is missing, add it"},
    {"damping_large", 9, "organs[0].material.damping", "from 0 to 1"},
    {"drag_negative", 9, "organs[0].material.drag", "from 0 to 1000, in 1/s"},
    {"restoration_word", 8, "organs[0].restoration", "true and false"},
    {"colliding_set", 8, "organs[0].colliding_set", "flood, paper"},
    {"depth", 8, "organs[0].depth", "exact, paper"},
    {"attachment_far", 11, "organs[0].attachments[0].sphere", "the nearest is 4.94 m away"},
    {"attachment_box_turned", 11, "organs[0].attachments[0].box.max", "not above min"},
    {"attachment_two_shapes", 11, "organs[0].attachments[0]", "one of sphere, box"},
    {"attachment_no_radius", 11, "organs[0].attachments[0].sphere.radius", "is missing, add it"},
    {"pose_parent", 8, "organs[0].pose.parent", "allowed are the frames of this scene: world"},
    {"pose_far", 8, "organs[0].pose", "rounding changes its shape"},
    {"frame_unknown_parent", 4, "frames[0].parent", "allowed are the frames of this scene: bed, world"},
    {"frame_circle", 4, "frames[0].parent", "leads round in a circle"},
    {"frame_twice", 5, "frames[1].name", "give each its own"},
    {"topic", 16, "instruments[0].pose_topic", "the name of a ROS topic"},
    {"scale_missing", 4, "organs[0].scale", "is missing, add it"},
    {"scale_zero", 6, "organs[0].scale", "0.001 for millimetres"},
    {"scale_metres", 6, "organs[0].scale", "0.001 is the scale of a mesh in millimetres"},
    {"scale_tiny", 5, "organs[0].mesh", "is its scale right?"},
    {"mesh_gone", 5, "organs[0].mesh", "there is no file"},
    {"mesh_folder", 5, "organs[0].mesh", "name a file"},
    {"mesh_package", 5, "organs[0].mesh", "ROS_PACKAGE_PATH"},
    {"mesh_web", 5, "organs[0].mesh", "allowed are package://, file:// and plain paths"},
    {"mesh_kind", 5, "organs[0].mesh", ".stl, .obj, .ply and .dae"},
    {"mesh_open", 5, "organs[0].mesh", "3 boundary edges: an organ is a closed surface"},
    {"mesh_fin", 5, "organs[0].mesh", "2 boundary edges, 1 non-manifold edge"},
    {"mesh_bad_index", 5, "organs[0].mesh", "export it again"},
    {"mesh_touching", 5, "organs[0].mesh", "1 non-manifold vertex"},
    {"mesh_flat", 5, "organs[0].mesh", "3 boundary edges"},
    {"mesh_pillow", 5, "organs[0].mesh", "encloses no volume"},
    {"mesh_points", 5, "organs[0].mesh", "holds no triangles"},
    {"mesh_empty", 5, "organs[0].mesh", "cannot be read as a mesh"},
    {"mesh_not_a_mesh", 5, "organs[0].mesh", "export"},
    {"mesh_nan", 5, "organs[0].mesh", "1 non-finite vertex"},
    {"mesh_cut_short", 5, "organs[0].mesh", "cannot be read as a mesh"},
    {"mesh_klein", 5, "organs[0].mesh", "misoriented edges"},
    {"tip_link", 14, "instruments[0].urdf", "there are: tip"},
    {"urdf_not_closed", 14, "instruments[0].urdf", "not_closed.urdf:5: </link> where <collision> of line 4 should be closed"},
    {"urdf_open_quote", 14, "instruments[0].urdf", "open_quote.urdf:3: a tag is not ended by >"},
    {"urdf_nothing_below", 14, "instruments[0].urdf", "nothing_below.urdf:2: <robot> is never closed"},
    {"urdf_not_a_robot", 14, "instruments[0].urdf", "is not a URDF"},
    {"urdf_empty", 14, "instruments[0].urdf", "is not a URDF"},
    {"urdf_no_geometry", 14, "instruments[0].urdf", "give one a <collision>"},
    {"urdf_zero_size", 14, "instruments[0].urdf", "give one a <collision>"},
    {"urdf_negative", 14, "instruments[0].urdf", "allowed are numbers above 0, in metres"},
    {"urdf_no_number", 14, "instruments[0].urdf", "small"},
    {"urdf_no_mesh", 14, "instruments[0].urdf", "link 'tip': there is no file"},
    {"urdf_no_parent", 14, "instruments[0].urdf", "is not a URDF"},
    {"urdf_two_roots", 14, "instruments[0].urdf", "is not a URDF"}
    // clang-format on
};

class Malformed : public testing::TestWithParam<Case> {};

TEST_P(Malformed, IsRefusedWithPlaceAndCure) {
  const std::string path = folder + GetParam().scene + ".yaml";
  std::vector<std::string> warnings;
  const WithoutTraps off;  // some have numbers that are none
  try {
    load_scene(path, warnings);
    FAIL() << path << " was loaded";
  } catch (const SceneError& error) {
    const std::string what = error.what();
    const std::string start = path + ":" + std::to_string(GetParam().line) + ":";
    ASSERT_EQ(what.substr(0, start.size()), start) << what;
    const std::string rest = what.substr(what.find(": ", start.size()) + 2);
    EXPECT_EQ(rest.substr(0, rest.find(": ")), GetParam().key) << what;
    EXPECT_NE(rest.find(GetParam().cure), std::string::npos) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Malformed, testing::ValuesIn(cases),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.scene); });

TEST(MalformedScenes, TheFileThatTheyAreMadeFromLoads) {
  std::vector<std::string> warnings;
  const Scene scene = load_scene(folder + "good.yaml", warnings);
  EXPECT_EQ(scene.organs.size(), 1u);
  EXPECT_TRUE(warnings.empty());
}

}  // namespace
}  // namespace tissue_sim::malformed_test
