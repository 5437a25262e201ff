#include "tissue_sim/simulation/levels.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

#include "floating_point_traps.h"
#include "simulation/solid_scenes.h"
#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim::levels_test {
namespace {

constexpr double radius = 0.0067;  // m, of the ball: two cells
constexpr double depth = 0.005;    // m

/// 80 x 80 x 30 mm of liver on a table, its top at z = 0, in cells of 3.3 mm: 6 cells around a contact are a quarter of
/// it. Without a tolerance all of it is awake.
Organ wide_block(std::optional<double> tolerance, int across = 24) {
  const Vector3 size(0.01 / 3.0 * across, 0.01 / 3.0 * across, 0.03);
  TetrahedralMesh block = make_block(size, {across, across, 9});
  sort_vertices_for_locality(block);
  Organ organ = solid_organ(std::move(block), size, Model::fem);
  organ.integrator = Integrator::explicit_substeps;
  organ.material.drag = 60.0;
  organ.levels_tolerance = tolerance;
  return organ;
}

/// A ball, a little off the grid's lines, its lowest point `in` below z = 0.
Pose ball_at(double x, double in) {
  Pose pose = ball_over_block(radius, in);
  pose.position.x() += x;
  return pose;
}

Scene block_scene(std::optional<double> tolerance, std::size_t balls = 1, int across = 24) {
  std::vector<Instrument> instruments;
  for (std::size_t i = 0; i < balls; ++i) {
    instruments.push_back(round_ball(radius, 16));
    instruments.back().name = "ball" + std::to_string(i);
  }
  return scene_of(wide_block(tolerance, across), instruments);
}

double force_of(const Simulation& simulation, std::size_t ball = 0) {
  return simulation.report.wrenches[ball].force.z();
}

std::vector<Vector3> surface_of(Simulation& simulation) {
  const OrganState& organ = simulation.organ();
  return {organ.positions.begin(), organ.positions.begin() + simulation.rest().surface_vertices};
}

/// Everything that one press shows: 5 mm in, at rest, 20 mm aside at 50 mm/s.
struct Press {
  Simulation simulation;
  double at_rest = 0.0;          // N
  std::vector<double> sliding;   // N, a step
  std::vector<Vector3> surface;  // m, at rest

  explicit Press(std::optional<double> tolerance) : simulation(block_scene(tolerance)) {
    simulation.start_at(ball_at(-0.01, -0.0002));
    simulation.slide_to(ball_at(-0.01, depth), 50);
    for (int i = 0; i < 200; ++i) simulation.go_to(simulation.poses[0]);
    at_rest = force_of(simulation);
    surface = surface_of(simulation);
    for (int i = 1; i <= 400; ++i) {
      simulation.go_to(ball_at(-0.01 + 5e-5 * i, depth));
      sliding.push_back(force_of(simulation));
    }
  }
};

double largest_jump(const std::vector<double>& forces) {
  double largest = 0.0;
  for (std::size_t i = 1; i < forces.size(); ++i) {
    largest = std::max(largest, std::abs(forces[i] - forces[i - 1]) / forces[i - 1]);
  }
  return largest;
}

/// rms of the difference over rms of the displacement, of the vertices within `reach` of where the ball is.
double displacement_error(const Press& levels, const Press& awake, double reach) {
  const std::vector<Vector3>& rest = awake.simulation.rest().positions;
  double difference = 0.0;
  double displacement = 0.0;
  for (std::size_t v = 0; v < awake.surface.size(); ++v) {
    if (!((rest[v] - Vector3(-0.01, 0.0, 0.0)).norm() < reach)) continue;
    difference += (levels.surface[v] - awake.surface[v]).squaredNorm();
    displacement += (awake.surface[v] - rest[v]).squaredNorm();
  }
  return std::sqrt(difference / displacement);
}

/// One run of each, for the tests below.
struct LevelsTest : ::testing::Test {
  static Press& with_levels() {
    static Press press(0.05);
    return press;
  }
  static Press& awake() {
    static Press press(std::nullopt);
    return press;
  }
};

TEST_F(LevelsTest, PressAsEverythingAwakeDoes) {
  ASSERT_EQ(with_levels().simulation.world.organs[0].levels.size(), 1u);
  EXPECT_GT(awake().at_rest, 0.1);
  EXPECT_NEAR(with_levels().at_rest, awake().at_rest, 0.05 * awake().at_rest);
  EXPECT_LT(displacement_error(with_levels(), awake(), 2.0 * radius), 0.05);
  EXPECT_LT(displacement_error(with_levels(), awake(), 1.0), 0.12);
}

TEST_F(LevelsTest, SlideAsEverythingAwakeDoes) {
  const std::vector<double>& ours = with_levels().sliding;
  const std::vector<double>& theirs = awake().sliding;
  double mean = 0.0;
  for (std::size_t i = 20; i < ours.size(); ++i) {
    mean += (ours[i] / theirs[i] - 1.0) / static_cast<double>(ours.size() - 20);
    EXPECT_NEAR(ours[i], theirs[i], 0.08 * theirs[i]) << i;
  }
  EXPECT_LT(std::abs(mean), 0.05);
  EXPECT_LT(largest_jump(ours), 0.03) << "everything awake: " << largest_jump(theirs);
}

/// Attached vertices that a region reaches stay where they are, although the lattice around them gives a little.
TEST_F(LevelsTest, LeaveAttachedVerticesInPlace) {
  Press close(0.035);  // a larger region, as far as the underside
  const OrganState& organ = close.simulation.organ();
  const RestShape& rest = close.simulation.rest();
  const AwakeSolid& awake = close.simulation.workspace.organs[0].levels.awake[0];
  int reached = 0;
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    if (!rest.attached[v]) continue;
    EXPECT_EQ(organ.positions[v], rest.positions[v]);
    if (awake.place[v] < 0) continue;
    ++reached;
    const Vector3 displacement = awake.displacements[awake.place[v]].head<3>().cast<double>();
    EXPECT_LT((displacement + close.simulation.workspace.organs[0].levels.common).norm(), 1e-9);
  }
  EXPECT_GT(reached, 0);
}

TEST(Levels, ComeBackToRestAndFallAsleep) {
  Simulation simulation(block_scene(0.05));
  simulation.start_at(ball_at(0.0, -0.0002));
  simulation.slide_to(ball_at(0.0, depth), 50);
  simulation.slide_to(ball_at(0.003, depth), 60);
  simulation.slide_to(ball_at(0.003, -0.01), 50);
  int steps = 0;
  while (!simulation.state.organs[0].asleep && ++steps < 3000) simulation.go_to(simulation.poses[0]);
  EXPECT_TRUE(simulation.state.organs[0].asleep);
  EXPECT_TRUE(simulation.state.organs[0].region.free.empty());
  const std::vector<Vector3> surface = surface_of(simulation);
  double farthest = 0.0;
  for (std::size_t v = 0; v < surface.size(); ++v) {
    farthest = std::max(farthest, (surface[v] - simulation.rest().positions[v]).norm());
  }
  EXPECT_LT(farthest, 1e-6 * simulation.rest().size);
}

/// Two balls at the ends of the block; the first comes to the second, and their regions join, and goes back.
std::vector<double> forces_of_two(std::optional<double> tolerance) {
  Simulation simulation(block_scene(tolerance, 2));
  std::vector<Pose> at = {ball_at(-0.03, -0.0002), ball_at(0.03, -0.0002)};
  std::vector<double> forces;
  const auto go = [&](double first, double in) {
    const std::vector<Pose> to = {ball_at(first, in), ball_at(0.03, in)};
    const Motion motion = {0.001, {{true, at[0], to[0]}, {true, at[1], to[1]}}};
    ++simulation.report.step;
    step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
    at = to;
    forces.push_back(force_of(simulation, 1));
  };
  for (int i = 1; i <= 50; ++i) go(-0.03, depth * i / 50.0);
  for (int i = 0; i < 100; ++i) go(-0.03, depth);
  forces.clear();
  for (int i = 1; i <= 300; ++i) go(-0.03 + 0.042 * i / 300, depth);
  for (int i = 300; i-- > 0;) go(-0.03 + 0.042 * i / 300, depth);
  return forces;
}

TEST(Levels, OfTwoInstrumentsJoinAndPartWithoutAJump) {
  const std::vector<double> ours = forces_of_two(0.05);
  const std::vector<double> theirs = forces_of_two(std::nullopt);
  EXPECT_LT(largest_jump(ours), largest_jump(theirs) + 0.03);
  // At 140 mm/s, 18 mm from the other ball and 10 mm from the edge of the block, the tissue between is not at rest.
  for (std::size_t i = 0; i < ours.size(); ++i) EXPECT_NEAR(ours[i], theirs[i], 0.12 * theirs[i]) << i;
}

/// An organ too small for levels moves as one without the key, bit for bit.
TEST(Levels, OffMeansTheSameBits) {
  const auto run = [](std::optional<double> tolerance) {
    Organ organ = soft_block(Model::fem, 3);
    organ.levels_tolerance = tolerance;
    Simulation simulation(scene_of(organ, {round_ball(0.006, 16)}));
    press(simulation, 0.006, 0.003, 20);
    return simulation.hash();
  };
  EXPECT_EQ(run(0.05), run(std::nullopt));
}

int awake_when_pressed(int across) {
  Simulation simulation(block_scene(0.05, 1, across));
  simulation.start_at(ball_at(0.0, -0.0002));
  simulation.slide_to(ball_at(0.0, 0.5 * depth), 10);
  return static_cast<int>(simulation.state.organs[0].region.free.size());
}

TEST(Levels, WakeNoMoreOfALargerOrgan) {
  const int small = awake_when_pressed(24);
  EXPECT_GT(small, 100);
  EXPECT_NEAR(awake_when_pressed(40), small, 0.01 * small);
}

TEST(Levels, GiveTheSameBitsAgainAlsoFromACopy) {
  Simulation first(block_scene(0.05));
  Simulation second(block_scene(0.05));
  for (Simulation* simulation : {&first, &second}) {
    simulation->start_at(ball_at(0.0, -0.0002));
    simulation->slide_to(ball_at(0.0, depth), 30);
  }
  EXPECT_EQ(first.hash(), second.hash());

  Simulation copied(block_scene(0.05));
  copied.state = first.state;
  copied.poses = first.poses;
  copied.workspace.organs[0].last_good = first.state.organs[0];
  for (Simulation* simulation : {&first, &copied}) {
    simulation->slide_to(ball_at(0.01, depth), 60);
    simulation->slide_to(ball_at(0.01, -0.002), 30);
  }
  EXPECT_EQ(first.hash(), copied.hash());

  for (int i = 0; i < 2; ++i) {  // after a reset too
    second.start_at(ball_at(0.0, -0.0002));
    second.slide_to(ball_at(0.0, depth), 30);
    second.slide_to(ball_at(0.01, depth), 60);
    second.slide_to(ball_at(0.01, -0.002), 30);
    EXPECT_EQ(first.hash(), second.hash());
  }
}

TEST(Levels, AreAsTheyWereBeforeANumberWasNone) {
  const Vector3 none = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  using Spoil = void (*)(OrganState&, const Vector3&);
  const Spoil spoils[] = {
      [](OrganState& organ, const Vector3& bad) { organ.positions[organ.region.free.front()] = bad; },
      [](OrganState& organ, const Vector3& bad) { organ.velocities[organ.region.free.back()] = bad; },
      [](OrganState& organ, const Vector3& bad) { organ.levels[0].positions[17] = bad; },
      [](OrganState& organ, const Vector3& bad) { organ.levels[0].velocities[17] = bad; },
      [](OrganState& organ, const Vector3& bad) { organ.levels[0].push[17] = bad; },
  };
  Simulation simulation(block_scene(0.05));
  simulation.start_at(ball_at(0.0, -0.0002));
  simulation.slide_to(ball_at(0.0, depth), 40);
  for (int i = 0; i < 100; ++i) simulation.go_to(simulation.poses[0]);
  const double force = force_of(simulation);
  for (const Spoil spoil : spoils) {
    const OrganState good = simulation.state.organs[0];
    spoil(simulation.state.organs[0], none);
    {
      const WithoutTraps off;  // a NaN is computed with
      simulation.go_to(simulation.poses[0]);
    }
    EXPECT_TRUE(simulation.report.recovered);
    const OrganState& organ = simulation.state.organs[0];
    for (const int v : good.region.free) EXPECT_EQ(organ.positions[v], good.positions[v]);
    EXPECT_EQ(organ.region.free, good.region.free);
    EXPECT_EQ(organ.levels[0].positions, good.levels[0].positions);
    for (int i = 0; i < 100; ++i) simulation.go_to(simulation.poses[0]);
    EXPECT_NEAR(force_of(simulation), force, 0.01 * force);
    EXPECT_FALSE(simulation.report.recovered);
  }
}

/// m, how far the surface has moved under gravity.
std::vector<Vector3> sagged(std::optional<double> tolerance) {
  Scene scene = block_scene(tolerance);
  scene.gravity = {0.0, 0.0, -9.81};
  Simulation simulation(scene);
  simulation.start_at(ball_at(0.0, -0.05));
  for (int i = 0; i < 400; ++i) simulation.go_to(simulation.poses[0]);
  std::vector<Vector3> surface = surface_of(simulation);
  for (std::size_t v = 0; v < surface.size(); ++v) surface[v] -= simulation.rest().positions[v];
  return surface;
}

TEST(Levels, SagUnderGravity) {
  const std::vector<Vector3> ours = sagged(0.05);
  const std::vector<Vector3> theirs = sagged(std::nullopt);
  double difference = 0.0;
  double sag = 0.0;
  for (std::size_t v = 0; v < ours.size(); ++v) {
    difference += (ours[v] - theirs[v]).squaredNorm();
    sag += theirs[v].squaredNorm();
  }
  EXPECT_GT(sag, 0.0);
  // Nothing is touched: it is the coarsest level alone, of three cells across, held a little softer and made of softer
  // tissue than the organ, which is what a contact asks for.
  EXPECT_LT(std::sqrt(difference / sag), 0.25);
}

/// Three levels, of which the middle one sleeps where nothing touches and is pinned like the others.
TEST(Levels, OfThreeSizesHoldTogether) {
  Organ organ = solid_organ(make_block({0.11, 0.11, 0.04}, {33, 33, 12}), {0.11, 0.11, 0.04}, Model::fem);
  organ.material.drag = 60.0;
  organ.levels_tolerance = 0.08;
  Simulation simulation(scene_of(organ, {round_ball(radius, 16)}));
  ASSERT_EQ(simulation.world.organs[0].integrator, Integrator::explicit_substeps);
  ASSERT_EQ(simulation.world.organs[0].levels.size(), 2u);
  simulation.start_at(ball_at(0.0, -0.0002));
  simulation.slide_to(ball_at(0.0, depth), 50);
  for (int i = 0; i < 200; ++i) simulation.go_to(simulation.poses[0]);
  const double force = force_of(simulation);
  const std::vector<Part>& middle = simulation.state.organs[0].levels[0].region.mark;
  EXPECT_GT(std::count(middle.begin(), middle.end(), Part::asleep), 100);
  for (int i = 0; i < 100; ++i) simulation.go_to(simulation.poses[0]);
  EXPECT_NEAR(force_of(simulation), force, 0.01 * force) << "it is at rest";
  Vector3 mean = Vector3::Zero();
  const LevelState& coarsest = simulation.state.organs[0].levels[1];
  for (std::size_t v = 0; v < coarsest.positions.size(); ++v) {
    mean += (coarsest.positions[v] - simulation.world.organs[0].levels[1].shape.positions[v]) /
            static_cast<double>(coarsest.positions.size());
  }
  EXPECT_LT(mean.norm(), 0.001) << "and has not been pushed away";
}

TEST(Levels, ATimelineTellsOfThemAndOfHowMuchIsAwake) {
  Timeline timeline(block_scene(0.05));
  const OrganSummary summary = timeline.summary(0);
  ASSERT_GE(summary.levels.size(), 2u);
  EXPECT_EQ(summary.levels[0].tetrahedra, summary.tetrahedra);
  EXPECT_NEAR(summary.levels[0].edge, 0.01 / 3.0, 0.002);
  for (std::size_t level = 1; level < summary.levels.size(); ++level) {
    EXPECT_GT(summary.levels[level].edge, summary.levels[level - 1].edge);
    EXPECT_LT(summary.levels[level].tetrahedra, summary.levels[level - 1].tetrahedra);
    EXPECT_GT(summary.levels[level - 1].radius, 0.0);
  }
  EXPECT_EQ(summary.levels.back().radius, 0.0) << "all of the coarsest is awake";

  EXPECT_EQ(timeline.active_vertices(), 0) << "it sleeps until it is touched";
  constexpr std::int64_t start = 1'000'000'000, step = 1'000'000;  // ns
  for (int i = 0; i <= 10; ++i) {
    timeline.add_pose(0, {start + i * step, ball_at(0.0, 0.0005 * i)});
    while (timeline.step()) {
    }
  }
  EXPECT_FALSE(timeline.report().contacts.empty());
  EXPECT_GT(timeline.active_vertices(), 0);
  EXPECT_LT(timeline.active_vertices(), summary.simulated_vertices);
  EXPECT_GT(timeline.kinetic_energy(), 0.0);
  EXPECT_GT(timeline.elastic_energy(), 0.0);
}

}  // namespace
}  // namespace tissue_sim::levels_test
