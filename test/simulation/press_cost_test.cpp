#include "tissue_sim/simulation/press_cost.h"

#include <gtest/gtest.h>

#include "simulation/test_scenes.h"

namespace tissue_sim::press_cost_test {
namespace {

TEST(Press, IsInContactAndEnds) {
  Scene scene = scene_of(wall_sphere(16), {ball(0.01)});
  scene.organs[0].model = Model::surface;
  Timeline timeline(scene);
  const PressCost cost = time_press(scene, 0, 0.0, timeline);  // no more than has to be
  EXPECT_GE(cost.steps, 1);
  EXPECT_GT(cost.step, 0.0);
  Timeline apart(scene);
  EXPECT_GT(time_apart(scene, 0.0, apart), 0.0);
  EXPECT_TRUE(apart.report().contacts.empty());
}

}  // namespace
}  // namespace tissue_sim::press_cost_test
