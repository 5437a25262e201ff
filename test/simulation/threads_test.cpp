#include "tissue_sim/simulation/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>

#include "geometry/twins.h"
#include "simulation/solid_scenes.h"
#include "tissue_sim/simulation/integrator.h"

namespace tissue_sim::threads_test {
namespace {

TEST(Threads, DoEveryPartOnce) {
  for (const int count : {1, 2, 3, 7}) {
    Threads threads(count);
    EXPECT_EQ(threads.count(), count);
    for (std::size_t parts = 0; parts < 200; ++parts) {
      std::vector<int> done(parts, 0);
      threads.run(parts, [&](std::size_t part) { ++done[part]; });
      EXPECT_EQ(done, std::vector<int>(parts, 1));
    }
  }
}

TEST(Threads, OfWhichThereAreNoneGoInOrder) {
  std::vector<std::size_t> order;
  run(nullptr, 5, [&](std::size_t part) { order.push_back(part); });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

/// Each piece of work reads what the one before wrote, in another order: a part that is begun too soon, or seen too
/// late, leaves a sum that is wrong. Of some the threads go to sleep before the next.
TEST(Threads, SeeWhatWasDoneBefore) {
  constexpr std::size_t parts = 13;
  constexpr std::uint64_t rounds = 3000;
  Threads threads(4);
  std::vector<std::uint64_t> now(parts, 1);
  std::vector<std::uint64_t> next(parts, 0);
  for (std::uint64_t round = 0; round < rounds; ++round) {
    threads.run(parts, [&](std::size_t part) { next[part] = now[(5 * part + 3) % parts] + 1; });
    std::swap(now, next);
    if (round % 300 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(now, std::vector<std::uint64_t>(parts, rounds + 1));
}

TEST(Threads, StartAndStopOften) {
  std::atomic<int> done{0};
  for (int i = 0; i < 300; ++i) {
    Threads threads(1 + i % 5);
    for (int k = 0; k < i % 3; ++k) threads.run(8, [&](std::size_t) { ++done; });
  }
  EXPECT_EQ(done, 8 * 300);
}

TEST(Threads, OfANumberOutOfRangeAreRefused) {
  for (const int count : {-1, 0, most_threads + 1}) EXPECT_THROW(Threads threads(count), std::invalid_argument);
}

/// 24,000 tetrahedra, softer than tissue: a step takes fewer substeps.
Organ large_solid(Model model) {
  Organ organ = soft_block(model, 10);
  organ.material.young = 500.0;
  return organ;
}

/// 45,600 elements, with what the sphere encloses kept.
Organ large_wall() {
  Organ organ = wall_sphere(76);
  organ.material.young = 1000.0;
  return organ;
}

std::vector<Organ> large_organs() {
  return {large_solid(Model::fem), large_solid(Model::volume), large_wall()};
}

/// Moved at random.
OrganState some_state(const World& world) {
  OrganState state = rest_state(world, 0);
  const double edge = world.organs.front().rest.mean_edge;
  Random random(11);
  for (Vector3& p : state.positions) p += random_point(random, 0.05 * edge);
  for (Vector3& v : state.velocities) v += random_point(random, 5.0 * edge);
  return state;
}

std::vector<Vector3> forces_of(const RestShape& rest, const OrganState& state, Threads* threads) {
  ElementRoom room;
  prepare(room, rest);
  std::vector<Vector3> forces(state.positions.size(), Vector3::Zero());
  for (int i = 0; i < 3; ++i) element_forces(rest, state, forces, room, threads);
  return forces;
}

TEST(ChunksOfElements, AddToTheSumsOfTheWhole) {
  for (const Organ& organ : large_organs()) {
    const World world = build_world(scene_of(organ, {ball(0.005)}));
    const OrganState state = some_state(world);
    const RestShape& cut = world.organs.front().rest;
    ASSERT_EQ(cut.chunks.chunks.size(), 8u);
    EXPECT_GT(cut.chunks.stand_ins, 0);
    EXPECT_LT(cut.chunks.stand_ins, static_cast<int>(cut.positions.size())) << "neighbours are in one chunk";
    RestShape whole = cut;
    whole.chunks = ElementChunks();
    pack_elements(whole);
    const std::vector<Vector3> expected = forces_of(whole, state, nullptr);
    double largest = 0.0;
    for (const Vector3& f : expected) largest = std::max(largest, f.norm());
    const std::vector<Vector3> sums = forces_of(cut, state, nullptr);
    for (std::size_t v = 0; v < sums.size(); ++v) ASSERT_LT((sums[v] - expected[v]).norm(), 3e-6 * largest);

    for (const int count : {2, 3, 7}) {
      Threads threads(count);
      EXPECT_EQ(forces_of(cut, state, &threads), sums) << count << " threads";
    }
  }
}

TEST(ChunksOfElements, HaveNoVertexInCommon) {
  for (const Organ& organ : large_organs()) {
    const World world = build_world(scene_of(organ, {ball(0.005)}));
    const RestShape& rest = world.organs.front().rest;
    std::vector<int> owner(rest.positions.size() + static_cast<std::size_t>(rest.chunks.stand_ins), -1);
    for (int c = 0; c < 8; ++c) {
      const auto own = [&](const auto& rows, int floats) {
        for (const auto& row : rows) {
          for (const int place : row) {
            int& of = owner[static_cast<std::size_t>(place / floats)];
            EXPECT_TRUE(of < 0 || of == c);
            of = c;
          }
        }
      };
      const auto each = [](const BatchRange& range, const auto& visit) {
        for (std::size_t b = range.first; b < range.first + range.count; ++b) visit(b);
      };
      const ElementChunk& chunk = rest.chunks.chunks[static_cast<std::size_t>(c)];
      const ConstraintRanges& ranges = chunk.constraints;
      each(chunk.tetrahedra, [&](std::size_t b) { own(rest.packed.batches[b].vertices, 1); });
      each(ranges.pairs, [&](std::size_t b) { own(rest.constraints.pairs[b].flap.vertices, 8); });
      each(ranges.flaps, [&](std::size_t b) { own(rest.constraints.flaps[b].vertices, 8); });
      each(ranges.triangles, [&](std::size_t b) { own(rest.constraints.triangles[b].vertices, 8); });
      each(ranges.distances, [&](std::size_t b) { own(rest.constraints.distances[b].vertices, 8); });
    }
    for (const int of : owner) EXPECT_GE(of, 0);
  }
}

TEST(ChunksOfElements, AreNotMadeOfASmallOrgan) {
  for (const Organ& organ : {soft_block(Model::fem, 3), soft_block(Model::volume, 3), wall_sphere(16)}) {
    EXPECT_TRUE(build_world(scene_of(organ, {ball(0.005)})).organs.front().rest.chunks.empty());
  }
}

/// Of every step of a press.
std::vector<std::uint64_t> hashes_of_a_press(Simulation& simulation, int threads, const Pose& from,
                                             const Vector3& way) {
  simulation.workspace = build_workspace(simulation.world, threads);
  simulation.start_at(from);
  std::vector<std::uint64_t> hashes;
  bool touched = false;
  for (int i = 1; i <= 12; ++i) {
    simulation.go_to({from.position + way * (i / 12.0), from.orientation});
    touched = touched || !simulation.report.contacts.empty();
    hashes.push_back(simulation.hash());
    EXPECT_FALSE(simulation.report.recovered);
  }
  EXPECT_TRUE(touched);
  return hashes;
}

TEST(NumberOfThreads, LeavesEveryBitOfAPressAsItIs) {
  for (const Organ& organ : large_organs()) {
    Simulation simulation(scene_of(organ, {ball(0.006)}));
    ASSERT_FALSE(simulation.rest().chunks.empty());
    const bool wall = organ.model == Model::surface;
    const Vector3 from = wall ? Vector3(0.0562, 0.0003, 0.0002) : Vector3(0.0003, 0.0002, 0.0062);
    const Vector3 way = wall ? Vector3(-0.002, 0.0, 0.0) : Vector3(0.0, 0.0, -0.001);
    const Pose start = {from, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3::UnitX()))};
    const std::vector<std::uint64_t> one = hashes_of_a_press(simulation, 1, start, way);
    for (const int threads : {2, 3, 7}) {
      EXPECT_EQ(hashes_of_a_press(simulation, threads, start, way), one) << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace tissue_sim::threads_test
