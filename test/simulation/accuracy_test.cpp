#include "tissue_sim/simulation/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "environment.h"
#include "scene/obj_text.h"
#include "simulation/test_scenes.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::accuracy_test {
namespace {

using Goal = Accuracy::Goal;

const Candidate coarse = {0.40, 0.5e-3, true};
const Candidate middle = {0.10, 1.0e-3, true};
const Candidate fine = {0.02, 4.0e-3, true};

TEST(Choose, ABudgetBuysTheSmallestErrorThatFits) {
  const std::vector<Candidate> all = {fine, coarse, middle};
  EXPECT_EQ(choose(all, Goal::budget, 0.5e-3), -1);  // the margin does not fit
  EXPECT_EQ(choose(all, Goal::budget, 0.6e-3), 1);
  EXPECT_EQ(choose(all, Goal::budget, 1.2e-3), 2);
  EXPECT_EQ(choose(all, Goal::budget, 10e-3), 0);
}

TEST(Choose, ABudgetKeepsItsMargin) {
  EXPECT_FALSE(fits(middle, Goal::budget, (1.0 + 0.99 * cost_margin) * middle.cost));
  EXPECT_TRUE(fits(middle, Goal::budget, (1.0 + 1.01 * cost_margin) * middle.cost));
}

TEST(Choose, OfEquallyExactOnesABudgetBuysTheCheapest) {
  const Candidate dear = {middle.expected_error, 2.0 * middle.cost, true};
  EXPECT_EQ(choose({dear, middle}, Goal::budget, 1.0), 1);
  EXPECT_EQ(choose({middle, dear}, Goal::budget, 1.0), 0);
  EXPECT_EQ(choose({middle, middle}, Goal::budget, 1.0), 0);
}

TEST(Choose, AnErrorIsReachedAtTheLeastCost) {
  const std::vector<Candidate> all = {fine, coarse, middle};
  EXPECT_EQ(choose(all, Goal::error, 0.01), -1);
  EXPECT_EQ(choose(all, Goal::error, 0.02), 0);
  EXPECT_EQ(choose(all, Goal::error, 0.1), 2);
  EXPECT_EQ(choose(all, Goal::error, 1.0), 1);
}

TEST(Choose, OfEquallyCheapOnesAnErrorTakesTheMostExact) {
  const Candidate better = {0.5 * middle.expected_error, middle.cost, true};
  EXPECT_EQ(choose({middle, better}, Goal::error, 1.0), 1);
  EXPECT_EQ(choose({better, middle}, Goal::error, 1.0), 0);
}

TEST(Choose, WhatCannotBeSteppedIsNeverChosen) {
  Candidate impossible = {0.0, 0.0, false};
  EXPECT_EQ(choose({impossible, middle}, Goal::budget, 1.0), 1);
  EXPECT_EQ(choose({impossible, middle}, Goal::error, 1.0), 1);
  EXPECT_EQ(choose({impossible}, Goal::budget, 1.0), -1);
  EXPECT_EQ(choose({}, Goal::error, 1.0), -1);
}

TEST(Choose, AnUnknownErrorIsBeyondEveryGoalButABudget) {
  const Candidate unknown = {HUGE_VAL, 0.1e-3, true};
  EXPECT_EQ(choose({unknown}, Goal::error, 1.0), -1);
  EXPECT_EQ(choose({unknown, middle}, Goal::budget, 1.0), 1);
  EXPECT_EQ(choose({unknown}, Goal::budget, 1.0), 0);
}

AccuracyTable small_table() {
  return {{{Model::fem, Integrator::explicit_substeps, 2.0, 0.3},
           {Model::fem, Integrator::explicit_substeps, 1.0, 0.1},
           {Model::fem, Integrator::explicit_substeps, 4.0, 0.4},
           {Model::fem, Integrator::vertex_block_descent, 1.0, 0.7},
           {Model::contact_only, Integrator::automatic, 1.0, 1.0}}};
}

TEST(ExpectedError, IsLinearBetweenRowsAndConstantOutside) {
  const AccuracyTable table = small_table();
  const auto at = [&](double edges) { return expected_error(table, Model::fem, Integrator::explicit_substeps, edges); };
  EXPECT_DOUBLE_EQ(at(0.2), 0.1);
  EXPECT_DOUBLE_EQ(at(1.0), 0.1);
  EXPECT_DOUBLE_EQ(at(1.25), 0.15);
  EXPECT_DOUBLE_EQ(at(2.0), 0.3);
  EXPECT_DOUBLE_EQ(at(3.0), 0.35);
  EXPECT_DOUBLE_EQ(at(4.0), 0.4);
  EXPECT_DOUBLE_EQ(at(9.0), 0.4);
}

TEST(ExpectedError, IsThatOfTheIntegratorOrElseOfTheModel) {
  const AccuracyTable table = small_table();
  EXPECT_DOUBLE_EQ(expected_error(table, Model::fem, Integrator::vertex_block_descent, 3.0), 0.7);
  EXPECT_DOUBLE_EQ(expected_error(table, Model::contact_only, Integrator::explicit_substeps, 3.0), 1.0);
  AccuracyTable descent;
  descent.rows = {table.rows[3]};
  EXPECT_DOUBLE_EQ(expected_error(descent, Model::fem, Integrator::explicit_substeps, 3.0), 0.7);
  EXPECT_TRUE(std::isinf(expected_error(table, Model::volume, Integrator::explicit_substeps, 1.0)));
}

TEST(ExpectedError, OfTwoRowsInOnePlaceIsTheLargerFromThereOn) {
  AccuracyTable table;
  for (const double error : {0.4, 0.2}) table.rows.push_back({Model::fem, Integrator::automatic, 1.0, error});
  table.rows.push_back({Model::fem, Integrator::automatic, 2.0, 0.6});
  EXPECT_DOUBLE_EQ(expected_error(table, Model::fem, Integrator::explicit_substeps, 1.0), 0.4);
  EXPECT_DOUBLE_EQ(expected_error(table, Model::fem, Integrator::explicit_substeps, 1.5), 0.5);
}

TEST(RelativeEdges, CountsEachEdgeOfWhatIsIntegratedOnce) {
  Organ organ;
  organ.mesh = {{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {0, 0, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  Instrument instrument = ball(0.5);  // its extent is that of 12 slices: 1 along the poles, less across
  const double thinnest = bounds_of(instrument.parts[0].mesh.vertices).size().minCoeff();
  EXPECT_NEAR(relative_edges(organ, {instrument}), 4.0 / (0.5 * thinnest), 1e-12);
  // Two tetrahedra on one face: nine edges, three of them of both.
  organ.solid = {{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {0, 0, 1}, {0, 0, -1}}, {{0, 1, 2, 3}, {0, 2, 1, 4}}};
  const double sum = 3.0 + 4.0 + 5.0 + 2.0 * (1.0 + std::sqrt(10.0) + std::sqrt(17.0));
  EXPECT_NEAR(relative_edges(organ, {instrument}), sum / 9.0 / (0.5 * thinnest), 1e-12);
  // The thinnest piece of all counts.
  EXPECT_NEAR(relative_edges(organ, {instrument, ball(0.05)}), sum / 9.0 / (0.05 * thinnest), 1e-9);
}

/// A sphere that may be contact_only, surface, or fem on one of two solids.
Scene open_scene(Goal goal, double value, int organs = 1) {
  Scene scene = scene_of(wall_sphere(16), {ball(0.01)});
  scene.accuracy = {goal, value, "scene.yaml:3:12: accuracy: "};
  std::vector<Alternative> alternatives;
  for (const Model model : {Model::contact_only, Model::surface}) {
    alternatives.push_back({scene.organs[0], ""});
    alternatives.back().organ.model = model;
  }
  for (const int cells : {1, 4}) {
    alternatives.push_back({scene.organs[0], cells == 1 ? "coarse.msh" : "fine.msh"});
    alternatives.back().organ.model = Model::fem;
    alternatives.back().organ.embedded = true;
    alternatives.back().organ.solid = make_block({0.1, 0.1, 0.1}, {cells, cells, cells});
  }
  scene.organs.assign(static_cast<std::size_t>(organs), alternatives[0].organ);
  scene.alternatives.assign(static_cast<std::size_t>(organs), alternatives);
  for (int o = 1; o < organs; ++o) scene.organs[static_cast<std::size_t>(o)].name = "other";
  return scene;
}

AccuracyTable table_of_open_scene() {
  return {{{Model::contact_only, Integrator::automatic, 1.0, 1.0},
           {Model::surface, Integrator::automatic, 1.0, 0.5},
           {Model::fem, Integrator::automatic, 3.0, 0.05},
           {Model::fem, Integrator::automatic, 10.0, 0.2}}};
}

/// 0.1 ms, 0.3 ms, and 1 ms for 100 tetrahedra; explicit.
SceneCost fake_cost(const Scene& scene) {
  EXPECT_EQ(scene.organs.size(), 1u);
  EXPECT_TRUE(scene.alternatives.empty());
  const Organ& organ = scene.organs[0];
  SceneCost cost;
  cost.integrator = Integrator::explicit_substeps;
  cost.step = organ.model == Model::contact_only ? 0.1e-3 : 0.3e-3;
  if (is_solid(organ.model)) cost.step = 1e-5 * static_cast<double>(organ.solid.tetrahedra.size());
  return cost;
}

ModelChoice choice_of(Goal goal, double value, const MeasureCost& measure = fake_cost) {
  std::vector<ModelChoice> choices;
  const Scene chosen = choose_models(open_scene(goal, value), table_of_open_scene(), measure, choices);
  EXPECT_TRUE(chosen.alternatives.empty());
  EXPECT_EQ(chosen.organs.size(), 1u);
  EXPECT_EQ(choices.size(), 1u);
  EXPECT_EQ(chosen.organs[0].model, choices[0].model);
  EXPECT_EQ(chosen.organs[0].solid.empty(), choices[0].solid.empty());
  return choices[0];
}

std::string refusal_of(const Scene& scene, const MeasureCost& measure = fake_cost,
                       const AccuracyTable& table = table_of_open_scene()) {
  std::vector<ModelChoice> choices;
  try {
    choose_models(scene, table, measure, choices);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(ChooseModels, ALargerBudgetBuysACostlierAndMoreExactModel) {
  // 6 tetrahedra in the coarse solid: 0.06 ms. 384 in the fine one: 3.84 ms.
  EXPECT_EQ(choice_of(Goal::budget, 0.1e-3).solid, "coarse.msh");
  EXPECT_EQ(choice_of(Goal::budget, 2e-3).solid, "coarse.msh");
  const ModelChoice fine_one = choice_of(Goal::budget, 5e-3);
  EXPECT_EQ(fine_one.model, Model::fem);
  EXPECT_EQ(fine_one.solid, "fine.msh");
  EXPECT_EQ(fine_one.integrator, Integrator::explicit_substeps);
  EXPECT_DOUBLE_EQ(fine_one.measured, 3.84e-3);
  EXPECT_LT(fine_one.expected_error, choice_of(Goal::budget, 2e-3).expected_error);
}

TEST(ChooseModels, AnErrorIsReachedAtTheLeastCost) {
  EXPECT_EQ(choice_of(Goal::error, 0.1).solid, "fine.msh");
  EXPECT_EQ(choice_of(Goal::error, 0.2).solid, "coarse.msh");
  EXPECT_EQ(choice_of(Goal::error, 1.0).solid, "coarse.msh");  // cheaper than contact_only here
}

TEST(ChooseModels, SayWhatWasChosenAndWhatWasRejected) {
  const ModelChoice choice = choice_of(Goal::budget, 5e-3);
  EXPECT_EQ(to_text(choice).find("organ sphere: fem on fine.msh, explicit: expected error "), 0u) << to_text(choice);
  EXPECT_NE(to_text(choice).find("3.84 ms a step: the most exact that keeps to 5 ms a step"), std::string::npos)
      << to_text(choice);
  ASSERT_EQ(choice.rejected.size(), 3u);
  EXPECT_EQ(choice.rejected[0], "contact_only: expected error 100 %, 0.1 ms a step, less exact");
  const ModelChoice tight = choice_of(Goal::budget, 1e-3);
  ASSERT_EQ(tight.rejected.size(), 3u);
  EXPECT_NE(tight.rejected[2].find("3.84 ms a step, does not keep to 1 ms a step"), std::string::npos);
}

TEST(ChooseModels, ABudgetIsSharedEqually) {
  std::vector<ModelChoice> choices;
  choose_models(open_scene(Goal::budget, 5e-3, 2), table_of_open_scene(), fake_cost, choices);
  ASSERT_EQ(choices.size(), 2u);
  EXPECT_EQ(choices[0].solid, "coarse.msh");  // 3.84 ms do not fit into 2.5 ms
  EXPECT_EQ(choices[1].solid, "coarse.msh");
  // An organ that names its model has its part too.
  Scene half_open = open_scene(Goal::budget, 5e-3, 2);
  half_open.alternatives[0].clear();
  choices.clear();
  const Scene chosen = choose_models(half_open, table_of_open_scene(), fake_cost, choices);
  ASSERT_EQ(choices.size(), 1u);
  EXPECT_EQ(choices[0].solid, "coarse.msh");
  EXPECT_EQ(chosen.organs[0].model, Model::contact_only);
  EXPECT_EQ(chosen.organs[1].model, Model::fem);
}

TEST(ChooseModels, WhatIsRefusedIsRejectedWithItsReason) {
  const MeasureCost no_fine_one = [](const Scene& scene) {
    SceneCost cost = fake_cost(scene);
    if (cost.step > 1e-3) cost.refused = "needs 900 substeps";
    return cost;
  };
  const ModelChoice choice = choice_of(Goal::budget, 5e-3, no_fine_one);
  EXPECT_EQ(choice.solid, "coarse.msh");
  EXPECT_NE(choice.rejected.back().find("needs 900 substeps"), std::string::npos);
  const MeasureCost none = [](const Scene&) { return SceneCost{0.0, Integrator::automatic, "needs 900 substeps"}; };
  EXPECT_EQ(refusal_of(open_scene(Goal::budget, 5e-3), none),
            "scene.yaml:3:12: accuracy: no model of organ sphere works: needs 900 substeps");
}

TEST(ChooseModels, ABudgetThatNothingFitsNamesTheCheapestAndOneThatWouldDo) {
  const std::string what = refusal_of(open_scene(Goal::budget, 0.05e-3));
  EXPECT_EQ(what.find("scene.yaml:3:12: accuracy: no model of organ sphere keeps to 0.05 ms a step: the cheapest"), 0u)
      << what;
  EXPECT_NE(what.find("fem on coarse.msh"), std::string::npos) << what;
  EXPECT_NE(what.find("give budget_ms: 0.0693 or more"), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos);
  EXPECT_EQ(refusal_of(open_scene(Goal::budget, 0.0693e-3)), "");
}

TEST(ChooseModels, ABudgetThatIsTooSmallForItsPartsNamesTheWhole) {
  const std::string what = refusal_of(open_scene(Goal::budget, 0.1e-3, 2));
  EXPECT_NE(what.find("keeps to 0.05 ms a step (a part of 2 equal ones)"), std::string::npos) << what;
  EXPECT_NE(what.find("give budget_ms: 0.139 or more"), std::string::npos) << what;
}

TEST(ChooseModels, AnErrorThatNothingReachesNamesTheBestAndTheCure) {
  const std::string what = refusal_of(open_scene(Goal::error, 0.001));
  EXPECT_NE(what.find("keeps to 0.1 %: the best there is, fem on fine.msh, explicit, has expected error"),
            std::string::npos)
      << what;
  EXPECT_NE(what.find("finer solid (scripts/make_solid)"), std::string::npos) << what;
  Scene wall = open_scene(Goal::error, 0.001);
  wall.alternatives[0].resize(2);
  EXPECT_NE(refusal_of(wall).find("allow error: 50%, or give the organ a solid (scripts/make_solid)"),
            std::string::npos)
      << refusal_of(wall);
}

TEST(ChooseModels, TheErrorToAllowIsRoundedUp) {
  const auto refusal = [](double error) {
    Scene scene = open_scene(Goal::error, 0.001);
    scene.alternatives[0].resize(1);
    return refusal_of(scene, fake_cost, {{{Model::contact_only, Integrator::automatic, 1.0, error}}});
  };
  EXPECT_NE(refusal(0.2641).find("allow error: 27%,"), std::string::npos) << refusal(0.2641);
  EXPECT_NE(refusal(0.0341).find("allow error: 3.5%,"), std::string::npos) << refusal(0.0341);
  EXPECT_NE(refusal(HUGE_VAL).find("accuracy.yaml has no error for it, name a model"), std::string::npos);
}

TEST(ChooseModels, ATimelineRefusesASceneThatIsStillOpen) {
  EXPECT_THROW(Timeline{open_scene(Goal::budget, 1.0)}, SceneError);
}

TEST(AccuracyTable, TheShippedOneHasEveryModel) {
  const AccuracyTable table = load_accuracy_table(source_file("config/scenes/dial.yaml"));
  for (const Model model : {Model::contact_only, Model::surface, Model::volume, Model::fem}) {
    EXPECT_TRUE(std::isfinite(expected_error(table, model, Integrator::explicit_substeps, 1.0))) << to_string(model);
  }
}

/// A small wall and ball, in files. `keys` are the scene's own, `of_organ` the organ's.
std::string write_wall_scene(const TemporaryFolder& folder, const std::string& keys, const std::string& of_organ) {
  folder.write("wall.obj", obj_of(make_sphere(50.0, 20), 9));
  folder.write("ball.urdf",
               "<robot name='b'><link name='tip'><collision><geometry><sphere radius='0.04'/></geometry></collision>"
               "</link></robot>");
  return folder.write("scene.yaml", "frame: world\n" + keys + "organs:\n  - name: wall\n    mesh: wall.obj\n" +
                                        "    scale: 0.001\n    wall_thickness: 0.003\n" + of_organ +
                                        "    material: {young: 5400, poisson: 0.45, density: 1060}\n    attachments:\n"
                                        "      - sphere: {center: [0, 0, -0.05], radius: 0.01}\ninstruments:\n"
                                        "  - {name: ball, urdf: ball.urdf, tip_link: tip, pose_topic: a/b}\n");
}

TEST(LoadChosenScene, TakesTheMostExactThatABudgetWithoutEndPays) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  std::vector<ModelChoice> choices;
  const Scene scene = load_chosen_scene(
      write_wall_scene(folder, "time_step: 0.001\naccuracy: {budget_ms: 100000}\n", ""), warnings, choices);
  EXPECT_EQ(scene.organs.at(0).model, Model::contact_only) << "a thick wall is no surface";
  ASSERT_EQ(choices.size(), 1u);
  EXPECT_EQ(choices[0].model, Model::contact_only);
  EXPECT_GT(choices[0].measured, 0.0);
  EXPECT_LT(choices[0].measured, 100.0);
  ASSERT_EQ(choices[0].rejected.size(), 1u);
  EXPECT_EQ(choices[0].rejected[0].find("surface, explicit: expected error 144 %, "), 0u) << choices[0].rejected[0];
  EXPECT_NE(choices[0].rejected[0].find("less exact"), std::string::npos) << choices[0].rejected[0];
}

TEST(LoadChosenScene, RejectsAModelThatTheTimeStepIsTooLongFor) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  std::vector<ModelChoice> choices;
  const Scene scene =
      load_chosen_scene(write_wall_scene(folder, "time_step: 0.1\nmax_substeps: 1\naccuracy: {budget_ms: 100000}\n",
                                         "    integrator: explicit\n"),
                        warnings, choices);
  EXPECT_EQ(scene.organs.at(0).model, Model::contact_only);
  ASSERT_EQ(choices.size(), 1u);
  ASSERT_EQ(choices[0].rejected.size(), 1u);
  EXPECT_NE(choices[0].rejected[0].find("surface, auto: organ wall: a step of 0.1 s needs "), std::string::npos)
      << choices[0].rejected[0];
}

TEST(LoadChosenScene, LeavesASceneThatNamesItsModelsAsItIs) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  std::vector<ModelChoice> choices;
  const Scene scene =
      load_chosen_scene(write_wall_scene(folder, "time_step: 0.001\n", "    model: surface\n"), warnings, choices);
  EXPECT_EQ(scene.organs.at(0).model, Model::surface);
  EXPECT_TRUE(choices.empty());
}

TEST(AccuracyTable, IsFoundFromTheProgramWhereNoEnvironmentAndNoSceneLeadsToIt) {
  const Environment packages("ROS_PACKAGE_PATH", "");
  const Environment prefixes("CMAKE_PREFIX_PATH", "");
  const AccuracyTable table = load_accuracy_table("/scene.yaml");
  EXPECT_EQ(table.rows.size(), load_accuracy_table(source_file("config/scenes/dial.yaml")).rows.size());
}

}  // namespace
}  // namespace tissue_sim::accuracy_test
