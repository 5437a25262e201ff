#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/replay/replay.h"
#include "tissue_sim/ros/message_types.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::dvrk_replay_test {
namespace {

/// The real recording through the real forceps over the real organ, whole: every pose used, contact at least 10 mm
/// deep, and the organ back at its rest shape within 1 % of its size one second after the forceps have left.
TEST(DvrkReplay, PressesTheStomachAndLetsItComeBack) {
  const std::string bag = TISSUE_SIM_SOURCE_DIR "/../shared/data/dvrk/psm2_measured.bag";
  if (!std::ifstream(bag).good()) GTEST_SKIP() << "no ../shared/data beside the repository";
  std::vector<std::string> warnings;
  const Scene scene = load_scene(TISSUE_SIM_SOURCE_DIR "/test/scenes/dvrk_stomach.yaml", warnings);
  const TemporaryFolder folder;
  ReplayOptions options;
  options.input = bag;
  options.output = (folder.path / "out.bag").string();
  const ReplaySummary summary = replay(scene, options);

  EXPECT_EQ(summary.poses_used, 3420u);
  EXPECT_EQ(summary.poses_dropped(), 0u);
  EXPECT_EQ(summary.non_finite, 0u);
  EXPECT_EQ(summary.counters.recoveries, 0u);
  EXPECT_GT(summary.contact_steps, 1000u);
  EXPECT_GT(summary.depth_max, 0.010);
  EXPECT_GT(summary.force_max, 0.0);

  double left = 0.0;
  for (const ReplayRow& row : summary.rows) {
    if (row.contacts > 0) left = row.t;
  }
  const std::vector<Vector3>& rest = scene.organs[0].mesh.vertices;
  const double size = bounds_of(rest).size().norm();
  double farthest = -1.0;
  rosbag::Bag out(options.output);
  for (const rosbag::MessageInstance& message : rosbag::View(out, rosbag::TopicQuery("/tissue_sim/stomach/state"))) {
    const TissueState::ConstPtr state = message.instantiate<TissueState>();
    if (!state || state->header.stamp.toSec() < left + 1.0) continue;
    ASSERT_EQ(state->positions.size(), 3 * rest.size());
    farthest = 0.0;
    for (std::size_t v = 0; v < rest.size(); ++v) {
      const Vector3 shown(state->positions[3 * v], state->positions[3 * v + 1], state->positions[3 * v + 2]);
      farthest = std::max(farthest, (shown - rest[v]).norm());
    }
    break;
  }
  out.close();
  ASSERT_GE(farthest, 0.0) << "no state later than one second after the last contact";
  EXPECT_LT(farthest, 0.01 * size);
  RecordProperty("farthest_um", static_cast<int>(1e6 * farthest));
}

}  // namespace
}  // namespace tissue_sim::dvrk_replay_test
