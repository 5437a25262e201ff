#include "tissue_sim/simulation/active_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "floating_point_traps.h"
#include "simulation/test_scenes.h"
#include "tissue_sim/simulation/health.h"
#include "tissue_sim/simulation/levels.h"

namespace tissue_sim::active_region_test {
namespace {

constexpr double tube_radius = 0.015;  // m
constexpr double ball_radius = 0.003;  // m
constexpr int around = 36;

/// A closed tube along x, as the thin wall of a hollow organ that is held from behind: its bending length is 2 mm.
Organ tube(int rings, double edge = 2.0 * 3.14159265358979 * tube_radius / around) {
  Organ organ;
  organ.name = "tube";
  organ.wall_thickness = 0.001;
  organ.material = {10000.0, 0.45, 1060.0, 0.1, 60.0};
  TriangleMesh& mesh = organ.mesh;
  for (int r = 0; r < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2.0 * 3.14159265358979 * (i + 0.5 * (r % 2)) / around;
      mesh.vertices.emplace_back(edge * (r - rings / 2), tube_radius * std::cos(angle), tube_radius * std::sin(angle));
    }
  }
  const auto at = [](int r, int i) { return r * around + i % around; };
  for (int r = 0; r + 1 < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      if (r % 2 == 0) {
        mesh.triangles.push_back({at(r, i), at(r, i + 1), at(r + 1, i)});
        mesh.triangles.push_back({at(r, i + 1), at(r + 1, i + 1), at(r + 1, i)});
      } else {
        mesh.triangles.push_back({at(r, i), at(r, i + 1), at(r + 1, i + 1)});
        mesh.triangles.push_back({at(r, i), at(r + 1, i + 1), at(r + 1, i)});
      }
    }
  }
  for (const int r : {0, rings - 1}) {
    const int middle = static_cast<int>(mesh.vertices.size());
    mesh.vertices.emplace_back(edge * (r - rings / 2), 0.0, 0.0);
    for (int i = 0; i < around; ++i) {
      r == 0 ? mesh.triangles.push_back({at(r, i + 1), at(r, i), middle})
             : mesh.triangles.push_back({at(r, i), at(r, i + 1), middle});
    }
  }
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
    if (mesh.vertices[v].z() < 0.2 * tube_radius) organ.attached.push_back(v);
  }
  return organ;
}

Organ tube_in_parts(int rings) {
  Organ organ = tube(rings);
  organ.levels_tolerance = 0.05;
  return organ;
}

/// Off the grid, so that nothing is at the same distance from two vertices.
Pose ball_at(double x, double depth) {
  return {Vector3(x + 0.0003, 0.0002, tube_radius + ball_radius - depth), Eigen::Quaterniond::Identity()};
}

void press_in(Simulation& simulation, double x = 0.0) {
  simulation.start_at(ball_at(x, -0.0005));
  simulation.slide_to(ball_at(x, 0.0015), 60);
  simulation.slide_to(ball_at(x, 0.0015), 60);
}

double force(const Simulation& simulation) {
  return simulation.report.wrenches[0].force.norm();
}

/// With a tolerance that no coarser shell would be within: both have the organ's own mesh.
TEST(WallRegion, ForceIsThatOfEverythingAwake) {
  Organ organ = tube(160);
  organ.levels_tolerance = 0.01;
  Simulation part(scene_of(organ, {ball(ball_radius)}));
  ASSERT_EQ(part.world.organs[0].rest.first_simulated, 0);
  ASSERT_FALSE(part.world.organs[0].regions.empty());
  Simulation whole(scene_of(tube(160), {ball(ball_radius)}));
  ASSERT_TRUE(whole.world.organs[0].regions.empty());
  press_in(part);
  press_in(whole);
  EXPECT_GT(force(whole), 0.0004);
  EXPECT_NEAR(force(part) / force(whole), 1.0, 0.04);
}

TEST(WallRegion, IsAsLargeInALargerOrgan) {
  std::set<std::size_t> free;
  for (const int rings : {160, 320}) {
    Simulation simulation(scene_of(tube_in_parts(rings), {ball(ball_radius)}));
    press_in(simulation);
    free.insert(simulation.organ().region.free.size());
    EXPECT_LT(simulation.organ().region.free.size(), simulation.organ().positions.size() / 2);
  }
  EXPECT_LT(static_cast<double>(*free.rbegin()), 1.15 * static_cast<double>(*free.begin()));
}

/// The plain version: every batch with a vertex within the radius, and what those have for corners.
TEST(WallRegion, HoldsWhatIsWithinTheRadius) {
  const World world = build_world(scene_of(tube_in_parts(160), {ball(ball_radius)}));
  const OrganModel& model = world.organs[0];
  const RestShape& rest = model.rest;
  RegionRoom room;
  prepare(room, rest);
  ActiveRegion region;
  region.mark.assign(rest.positions.size(), Part::asleep);
  for (const double x : {0.0, 0.004, -0.05}) {
    const std::vector<Vector3> centres = {Vector3(x, 0.0, tube_radius), Vector3(x, 0.01, 0.01)};
    region.centres = centres;
    recentre(model.regions[0], rest, region, room);
    const auto near = [&](int v) {
      return std::min((rest.positions[v] - centres[0]).norm(), (rest.positions[v] - centres[1]).norm()) <
             model.regions[0].radius;
    };
    std::set<int> free;
    std::set<int> driven;
    const auto expect_batches = [&](const auto& batches, const auto& rows_of, const std::vector<int>& chosen) {
      std::vector<int> expected;
      for (std::size_t b = 0; b < batches.size(); ++b) {
        std::set<int> corners;
        for (const auto& row : rows_of(batches[b])) {
          for (const int v : row) corners.insert(v / 8);
        }
        if (std::none_of(corners.begin(), corners.end(), near)) continue;
        expected.push_back(static_cast<int>(b));
        for (const int v : corners) (near(v) ? free : driven).insert(v);
      }
      EXPECT_EQ(chosen, expected);
    };
    const auto own = [](const auto& batch) -> const auto& {
      return batch.vertices;
    };
    const ConstraintSelection& chosen = region.active.constraints;
    expect_batches(
        rest.constraints.pairs, [](const PairBatch& b) -> const auto& { return b.flap.vertices; }, chosen.pairs);
    expect_batches(rest.constraints.flaps, own, chosen.flaps);
    expect_batches(rest.constraints.triangles, own, chosen.triangles);
    expect_batches(rest.constraints.distances, own, chosen.distances);
    EXPECT_EQ(std::set<int>(region.free.begin(), region.free.end()), free);
    EXPECT_EQ(std::set<int>(region.driven.begin(), region.driven.end()), driven);
    for (std::size_t v = 0; v < region.mark.size(); ++v) {
      const int vertex = static_cast<int>(v);
      const Part expected = free.count(vertex) ? Part::free : driven.count(vertex) ? Part::driven : Part::asleep;
      EXPECT_EQ(region.mark[v], expected);
    }
  }
}

TEST(WallRegion, LeavesWhatSleepsAtRest) {
  Simulation simulation(scene_of(tube_in_parts(160), {ball(ball_radius)}));
  press_in(simulation);
  simulation.slide_to(ball_at(0.03, 0.0015), 600);
  const OrganState& organ = simulation.organ();
  const RestShape& rest = simulation.world.organs[0].rest;
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < organ.positions.size(); ++v) {
    if (organ.region.mark[v] == Part::free) continue;
    EXPECT_EQ(organ.positions[v], rest.positions[v]);
    EXPECT_EQ(organ.velocities[v], Vector3::Zero());
  }
}

TEST(WallRegion, SlidesWithoutAJumpInForce) {
  Simulation simulation(scene_of(tube_in_parts(200), {ball(ball_radius)}));
  press_in(simulation);
  Simulation whole(scene_of(tube(200), {ball(ball_radius)}));
  press_in(whole);
  double before = force(simulation);
  double before_whole = force(whole);
  double jump = 0.0;
  double jump_whole = 0.0;
  for (int i = 1; i <= 600; ++i) {  // 50 mm/s
    for (Simulation* each : {&simulation, &whole}) each->go_to(ball_at(5e-5 * i, 0.0015));
    jump = std::max(jump, std::abs(force(simulation) - before));
    jump_whole = std::max(jump_whole, std::abs(force(whole) - before_whole));
    before = force(simulation);
    before_whole = force(whole);
  }
  EXPECT_LT(jump, 1.5 * jump_whole + 0.03 * force(simulation));
}

TEST(WallRegion, ComesBackToRestWhereItWasPressed) {
  Simulation simulation(scene_of(tube_in_parts(200), {ball(ball_radius)}));
  press_in(simulation);
  // Off, and down at once where the first region does not reach: the first dent comes back while that is pressed.
  simulation.slide_to(ball_at(0.0, -0.02), 20);
  simulation.slide_to(ball_at(0.08, -0.02), 10);
  simulation.slide_to(ball_at(0.08, 0.0015), 20);
  const RestShape& rest = simulation.world.organs[0].rest;
  EXPECT_EQ(simulation.organ().centres[0].size(), 2u);
  simulation.slide_to(ball_at(0.08, 0.0015), 1500);
  EXPECT_EQ(simulation.organ().centres[0].size(), 1u);
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < rest.positions.size(); ++v) {
    if (rest.positions[v].x() < 0.02) {
      EXPECT_EQ(simulation.state.organs[0].positions[v], rest.positions[v]);
    }
  }
  simulation.slide_to(ball_at(0.08, -0.05), 20);
  for (int i = 0; i < 6000 && !simulation.organ().asleep; ++i) simulation.go_to(ball_at(0.08, -0.05));
  EXPECT_TRUE(simulation.organ().asleep);
  place_surface(simulation.world.organs[0], simulation.state.organs[0]);
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    EXPECT_LT((simulation.state.organs[0].positions[v] - rest.positions[v]).norm(), 1e-5);
  }
}

TEST(WallRegion, IsThereOnlyWhereTheRestMayStayAtRest) {
  const auto regions = [](const Organ& organ, const Vector3& gravity = Vector3::Zero()) {
    Scene scene = scene_of(organ, {ball(ball_radius)});
    scene.gravity = gravity;
    return build_world(scene).organs[0].regions.size();
  };
  Organ organ = tube_in_parts(160);
  EXPECT_EQ(regions(organ), 1u);
  EXPECT_EQ(regions(organ, Vector3(0.0, 0.0, -9.81)), 0u) << "all of it sags";
  EXPECT_EQ(regions(tube(160)), 0u) << "off";
  Organ shorter = tube(24);
  shorter.levels_tolerance = 0.01;
  EXPECT_EQ(regions(shorter), 0u) << "nearly all of it";
  organ.restoration = false;
  EXPECT_EQ(regions(organ), 0u) << "a dent stays";
  organ.restoration = true;
  organ.attached = {0};
  EXPECT_EQ(regions(organ), 0u) << "it goes aside as a whole";
}

/// With the region's bookkeeping but everything in it, nothing differs by a bit.
TEST(WallRegion, OfEverythingIsEverythingAwake) {
  Simulation whole(scene_of(tube(40), {ball(ball_radius)}));
  Simulation region(scene_of(tube(40), {ball(ball_radius)}));
  OrganModel& model = region.world.organs[0];
  model.regions.push_back(build_wall_region_model(model.rest, 10.0));
  model.fine_edge = model.rest.mean_edge;
  region.state = rest_state(region.world);
  region.workspace = build_workspace(region.world);
  press_in(whole);
  press_in(region);
  EXPECT_GT(force(whole), 0.0004);
  EXPECT_EQ(force(region), force(whole));
  EXPECT_EQ(region.organ().positions, whole.organ().positions);
}

TEST(WallRegion, HealthPutsTheLastGoodStateBack) {
  Simulation simulation(scene_of(tube_in_parts(160), {ball(ball_radius)}));
  press_in(simulation);
  OrganState copy = rest_state(simulation.world, 0);
  copy_state(simulation.world.organs[0], simulation.organ(), copy);
  const RestShape& rest = simulation.world.organs[0].rest;
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < rest.positions.size(); ++v) {
    EXPECT_EQ(copy.positions[v], simulation.organ().positions[v]);
  }
  EXPECT_TRUE(healthy(simulation.world.organs[0], copy));
  const WithoutTraps off;  // a NaN is compared
  copy.positions[copy.region.free.front()].x() = std::nan("");
  EXPECT_FALSE(healthy(simulation.world.organs[0], copy));
}

}  // namespace
}  // namespace tissue_sim::active_region_test
