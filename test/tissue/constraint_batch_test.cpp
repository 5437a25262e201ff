#include "tissue_sim/tissue/constraint_batch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <stdexcept>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "tissue/test_solids.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/tissue/enclosed_volume.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim::constraint_batch_test {
namespace {

constexpr InstructionSet instruction_sets[] = {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512};
constexpr double no_limit = 1e30;

/// Elements of an organ, and a motion of its vertices as the batches read it and as doubles.
struct Moved {
  Moved(const RestShape& shape, double strain, double limit, unsigned seed = 7)
      : random(seed), rest(shape), stiffest(limit) {
    pulls.resize(rest.positions.size());
    motions.resize(rest.positions.size());
    for (std::size_t v = 0; v < rest.positions.size(); ++v) {
      const Vector3 u = random_point(random, strain * rest.mean_edge);
      const Vector3 speed = random_point(random, 50.0 * strain * rest.mean_edge);
      for (std::size_t i = 0; i < 3; ++i) {
        motions[v].displacement[i] = static_cast<float>(u[static_cast<Eigen::Index>(i)]);
        motions[v].velocity[i] = static_cast<float>(speed[static_cast<Eigen::Index>(i)]);
      }
      motions[v].inverse_mass = static_cast<float>(rest.inverse_mass[v]);
    }
  }

  Vector3 position(std::size_t v) const {
    const auto& u = motions[v].displacement;
    return rest.positions[v] + Vector3(u[0], u[1], u[2]);
  }
  Vector3 velocity(std::size_t v) const {
    const auto& w = motions[v].velocity;
    return {w[0], w[1], w[2]};
  }
  std::vector<Vector3> positions() const {
    std::vector<Vector3> all;
    for (std::size_t v = 0; v < motions.size(); ++v) all.push_back(position(v));
    return all;
  }
  std::vector<Vector3> velocities() const {
    std::vector<Vector3> all;
    for (std::size_t v = 0; v < motions.size(); ++v) all.push_back(velocity(v));
    return all;
  }

  ConstraintBatches packed() const {
    return pack(rest.distances, rest.areas, rest.volumes,
                rest.enclosed.stiffness > 0.0 ? rest.triangles : std::vector<Triangle>(), rest.positions,
                {rest.inverse_mass, stiffest});
  }
  void compute(InstructionSet set = instruction_set()) {
    const ConstraintBatches batches = packed();
    pulls.assign(motions.size(), VertexPull());
    shares.assign(batches.shares(), EnclosedShare());
    add_constraint_forces(batches, motions.data(), pulls.data(), shares.data(), set);
  }
  Vector3 force(std::size_t v) const { return {pulls[v].force[0], pulls[v].force[1], pulls[v].force[2]}; }
  Vector3 normal(std::size_t v) const { return {pulls[v].normal[0], pulls[v].normal[1], pulls[v].normal[2]}; }

  Random random;
  const RestShape& rest;
  double stiffest;
  std::vector<VertexMotion> motions;
  std::vector<VertexPull> pulls;
  std::vector<EnclosedShare> shares;
};

/// What the plain elements give.
std::vector<Vector3> plain_forces(const Moved& moved) {
  const StiffnessLimit limit = {moved.rest.inverse_mass, moved.stiffest};
  const std::vector<Vector3> x = moved.positions();
  const std::vector<Vector3> v = moved.velocities();
  std::vector<Vector3> forces(x.size(), Vector3::Zero());
  for (const DistanceElement& element : moved.rest.distances) add_forces(element, limit, x, v, forces);
  for (const AreaElement& element : moved.rest.areas) add_forces(element, limit, x, v, forces);
  for (const VolumeElement& element : moved.rest.volumes) add_forces(element, limit, x, v, forces);
  return forces;
}

double largest(const std::vector<Vector3>& vectors) {
  double size = 0.0;
  for (const Vector3& v : vectors) size = std::max(size, v.norm());
  return size;
}

double sum_of(const std::vector<EnclosedShare>& shares, const FloatLanes EnclosedShare::*part) {
  double sum = 0.0;
  for (const EnclosedShare& share : shares) {
    for (const float value : share.*part) sum += static_cast<double>(value);
  }
  return sum;
}

template <class Item>
bool same_bits(const std::vector<Item>& a, const std::vector<Item>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Item& x, const Item& y) { return std::memcmp(&x, &y, sizeof(Item)) == 0; });
}

Organ wall_of(const TriangleMesh& mesh) {
  Organ organ;
  organ.name = "wall";
  organ.mesh = mesh;
  organ.model = Model::surface;
  organ.wall_thickness = 0.003;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.attached = {0, 1};
  return organ;
}

/// A sphere whose triangles are all joined in pairs, and a bumpy one whose flaps are in random order, which leaves
/// some.
std::vector<RestShape> walls() {
  std::vector<RestShape> shapes;
  shapes.push_back(build_rest_shape(wall_of(make_sphere(0.05, 12))));
  TriangleMesh bumpy = make_sphere(0.05, 17);
  Random random(5);
  for (Vector3& v : bumpy.vertices) v *= 1.0 + random_in(random, -0.05, 0.05);
  for (std::size_t t = bumpy.triangles.size() - 1; t > 0; --t) {
    const auto other = static_cast<std::size_t>(random_in(random, 0.0, static_cast<double>(t)));
    std::swap(bumpy.triangles[t], bumpy.triangles[other]);
  }
  for (Vector3& v : bumpy.vertices) v += Vector3(3.0, -2.0, 1.0);  // far from the origin
  shapes.push_back(build_rest_shape(wall_of(bumpy)));
  std::vector<VolumeElement>& flaps = shapes.back().volumes;
  for (std::size_t f = flaps.size() - 1; f > 0; --f) {
    std::swap(flaps[f], flaps[static_cast<std::size_t>(random_in(random, 0.0, static_cast<double>(f)))]);
  }
  return shapes;
}

RestShape volume_block() {
  Organ organ;
  organ.name = "block";
  organ.solid = make_block({0.02, 0.02, 0.01}, {5, 5, 3});
  organ.mesh = take_surface(organ.solid);
  organ.model = Model::volume;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.attached = {0};
  return build_rest_shape(organ);
}

std::vector<RestShape> all_shapes() {
  std::vector<RestShape> shapes = walls();
  shapes.push_back(volume_block());
  return shapes;
}

TEST(ConstraintBatch, EveryElementIsPackedOnce) {
  for (const RestShape& rest : all_shapes()) {
    const ConstraintBatches batches = Moved(rest, 0.1, no_limit).packed();
    std::size_t distances = 0;
    std::size_t volumes = 0;
    std::size_t areas = 0;
    const auto count = [](const FloatLanes& lanes) {
      return static_cast<std::size_t>(std::count_if(lanes.begin(), lanes.end(), [](float k) { return k > 0.0F; }));
    };
    const auto count_flap = [&](const FlapBatch& batch) {
      distances += count(batch.distance_stiffness);
      volumes += count(batch.volume_stiffness);
    };
    for (const PairBatch& batch : batches.pairs) {
      count_flap(batch.flap);
      areas += count(batch.areas[0].stiffness) + count(batch.areas[1].stiffness);
    }
    for (const FlapBatch& batch : batches.flaps) count_flap(batch);
    for (const TriangleBatch& batch : batches.triangles) areas += count(batch.area.stiffness);
    for (const DistanceBatch& batch : batches.distances) distances += count(batch.stiffness);
    EXPECT_EQ(distances, rest.distances.size());
    EXPECT_EQ(volumes, rest.volumes.size());
    EXPECT_EQ(areas, rest.areas.size());
  }
}

TEST(ConstraintBatch, TheShapesOfTheseTestsHaveAllKindsOfBatches) {
  std::size_t pairs = 0;
  std::size_t flaps = 0;
  std::size_t triangles = 0;
  std::size_t distances = 0;
  for (const RestShape& rest : all_shapes()) {
    const ConstraintBatches batches = Moved(rest, 0.1, no_limit).packed();
    pairs += batches.pairs.size();
    flaps += batches.flaps.size();
    triangles += batches.triangles.size();
    distances += batches.distances.size();
  }
  EXPECT_TRUE(pairs > 10 && flaps > 10 && triangles > 1 && distances > 1)
      << pairs << " " << flaps << " " << triangles << " " << distances;
}

TEST(ConstraintBatch, AgreesWithThePlainElements) {
  for (const RestShape& rest : all_shapes()) {
    for (const double strain : {1e-6, 1e-3, 0.1, 0.5}) {
      // Without a limit; with one that softens the stretched; with one that softens nearly all.
      for (const double limit : {no_limit, 1.5 * rest.stiffest_element, 0.1 * rest.stiffest_element}) {
        Moved moved(rest, strain, limit);
        moved.compute();
        const std::vector<Vector3> expected = plain_forces(moved);
        const double size = largest(expected);
        ASSERT_GT(size, 0.0);
        if (limit < rest.stiffest_element) {
          moved.stiffest = no_limit;
          EXPECT_GT(largest(plain_forces(moved)), 1.1 * size) << "this limit softens";
        }
        for (std::size_t v = 0; v < expected.size(); ++v) {
          EXPECT_LT((moved.force(v) - expected[v]).norm(), 1e-5 * size) << strain << " " << limit << " " << v;
        }
      }
    }
  }
}

/// The forces that organs move by, against those that the tests of each kind of element differentiate.
TEST(ConstraintBatch, AHundredThousandRandomElementsOfEachKindPullAsThePlainOnes) {
  std::size_t distances = 0;
  std::size_t areas = 0;
  std::size_t volumes = 0;
  const std::vector<RestShape> shapes = all_shapes();
  double worst = 0.0;
  for (unsigned seed = 100; std::min({distances, areas, volumes}) < 100'000; ++seed) {
    for (const RestShape& rest : shapes) {
      Moved moved(rest, 0.1 * (1 + seed % 5), 1.5 * rest.stiffest_element, seed);
      moved.compute();
      const std::vector<Vector3> expected = plain_forces(moved);
      const double size = largest(expected);
      for (std::size_t v = 0; v < expected.size(); ++v) {
        worst = std::max(worst, (moved.force(v) - expected[v]).norm() / size);
      }
      distances += rest.distances.size();
      areas += rest.areas.size();
      volumes += rest.volumes.size();
    }
  }
  EXPECT_LT(worst, 1e-5) << "in floats, of the largest force";
  testing::Test::RecordProperty("worst_per_billion", static_cast<int>(1e9 * worst));
}

TEST(ConstraintBatch, EnclosedVolumeAgreesWithThePlainOne) {
  for (const RestShape& rest : walls()) {
    for (const double strain : {1e-7, 1e-3, 0.3}) {
      Moved moved(rest, strain, no_limit);
      moved.compute();
      std::vector<Vector3> gradient(rest.positions.size());
      const double c = rest.enclosed.evaluate(moved.positions(), rest.triangles, gradient);
      double rate = 0.0;
      for (std::size_t v = 0; v < gradient.size(); ++v) rate += gradient[v].dot(moved.velocity(v));
      const double six = 6.0 * rest.enclosed.rest;
      // The rounding of the plain one is some 1e-13 of the volume itself, and of the place far from the origin.
      EXPECT_NEAR(sum_of(moved.shares, &EnclosedShare::change) / six, c, 2e-6 * std::abs(c) + 1e-12) << strain;
      EXPECT_NEAR(sum_of(moved.shares, &EnclosedShare::rate) / six, rate, 1e-5 * std::abs(rate));
      const double size = largest(gradient);
      for (std::size_t v = 0; v < gradient.size(); ++v) {
        EXPECT_LT((moved.normal(v) / six - gradient[v]).norm(), 2e-6 * size) << v;
      }
    }
  }
}

TEST(ConstraintBatch, RestAndAShiftOfTheWholeMakeNoForceAtAll) {
  for (const RestShape& rest : all_shapes()) {
    Moved moved(rest, 0.0, no_limit);
    for (const float way : {0.0F, 0.1F}) {
      for (VertexMotion& motion : moved.motions) motion.displacement = {way, -0.5F * way, 7.0F * way};
      moved.compute();
      for (const VertexPull& pull : moved.pulls) {
        for (const float f : pull.force) EXPECT_EQ(f, 0.0F);
      }
      const double change = sum_of(moved.shares, &EnclosedShare::change);
      EXPECT_LE(std::abs(change), static_cast<double>(way) * 1e-5 * rest.size * rest.size);
    }
  }
}

/// Measured as the difference of two lengths, such a strain would be lost among the last digits.
TEST(ConstraintBatch, SmallStrainsKeepTheirDigits) {
  for (const RestShape& rest : all_shapes()) {
    for (const double strain : {1e-7, 1e-9}) {
      Moved moved(rest, 1e-3, no_limit);
      // The plain elements have not the digits either: they get the same motion, larger, where they are still linear.
      Moved smaller(rest, 0.0, no_limit);
      for (std::size_t v = 0; v < moved.motions.size(); ++v) {
        for (std::size_t i = 0; i < 3; ++i) {
          moved.motions[v].velocity[i] = 0.0F;
          smaller.motions[v].displacement[i] = static_cast<float>(strain / 1e-3) * moved.motions[v].displacement[i];
          moved.motions[v].displacement[i] = 1e-3F * moved.motions[v].displacement[i];
        }
      }
      smaller.compute();
      const std::vector<Vector3> expected = plain_forces(moved);
      const double ratio = strain / 1e-6;
      for (std::size_t v = 0; v < expected.size(); ++v) {
        EXPECT_LT((smaller.force(v) - ratio * expected[v]).norm(), 1e-4 * ratio * largest(expected)) << strain;
      }
    }
  }
}

TEST(ConstraintBatch, ForcesAndTorquesAddUpToNothing) {
  for (const RestShape& rest : all_shapes()) {
    Moved moved(rest, 0.2, 1.5 * rest.stiffest_element);
    moved.compute();
    Vector3 force = Vector3::Zero();
    Vector3 torque = Vector3::Zero();
    double size = 0.0;
    const Vector3 middle = rest.positions.front();
    for (std::size_t v = 0; v < moved.motions.size(); ++v) {
      force += moved.force(v);
      torque += (moved.position(v) - middle).cross(moved.force(v));
      size += moved.force(v).norm();
    }
    EXPECT_LT(force.norm(), 1e-6 * size);
    EXPECT_LT(torque.norm(), 1e-6 * size * rest.size);
  }
}

TEST(ConstraintBatch, SameBitsWithEveryInstructionSet) {
  for (const RestShape& rest : all_shapes()) {
    for (const double strain : {1e-6, 1e-2, 0.5}) {
      Moved baseline(rest, strain, 1.5 * rest.stiffest_element);
      baseline.compute(InstructionSet::baseline);
      for (const InstructionSet set : instruction_sets) {
        Moved other(rest, strain, 1.5 * rest.stiffest_element);
        if (!available(set)) {
          EXPECT_THROW(other.compute(set), std::invalid_argument);
          continue;
        }
        other.compute(set);
        EXPECT_TRUE(same_bits(other.pulls, baseline.pulls)) << name(set) << " " << strain;
        EXPECT_TRUE(same_bits(other.shares, baseline.shares)) << name(set) << " " << strain;
      }
    }
  }
}

std::vector<int> some_of(std::size_t count, std::size_t every) {
  std::vector<int> list;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % every != 0) list.push_back(static_cast<int>(i));
  }
  return list;
}

/// The batches that are chosen give what they give when there are no others.
TEST(ConstraintBatch, SomeBatchesAreTheSameAsNoOthersThere) {
  for (const RestShape& rest : all_shapes()) {
    Moved moved(rest, 0.1, 1.5 * rest.stiffest_element);
    const ConstraintBatches batches = moved.packed();
    for (const std::size_t every : {std::size_t{1}, std::size_t{2}, std::size_t{3}}) {
      const ConstraintSelection some = {some_of(batches.pairs.size(), every), some_of(batches.flaps.size(), every),
                                        some_of(batches.triangles.size(), every),
                                        some_of(batches.distances.size(), every)};
      ConstraintBatches alone;
      alone.stiffest = batches.stiffest;
      for (const int i : some.pairs) alone.pairs.push_back(batches.pairs[static_cast<std::size_t>(i)]);
      for (const int i : some.flaps) alone.flaps.push_back(batches.flaps[static_cast<std::size_t>(i)]);
      for (const int i : some.triangles) alone.triangles.push_back(batches.triangles[static_cast<std::size_t>(i)]);
      for (const int i : some.distances) alone.distances.push_back(batches.distances[static_cast<std::size_t>(i)]);
      std::vector<VertexPull> expected(moved.motions.size());
      std::vector<EnclosedShare> expected_shares(alone.shares());
      add_constraint_forces(alone, moved.motions.data(), expected.data(), expected_shares.data());

      for (const InstructionSet set : instruction_sets) {
        if (!available(set)) continue;
        std::vector<VertexPull> pulls(moved.motions.size());
        std::vector<EnclosedShare> shares(batches.shares());
        for (EnclosedShare& share : shares) share.change.fill(3.0F);
        add_constraint_forces(batches, some, moved.motions.data(), pulls.data(), shares.data(), set);
        EXPECT_TRUE(same_bits(pulls, expected)) << name(set) << " " << every;
        for (std::size_t i = 0; i < some.pairs.size(); ++i) {
          EXPECT_EQ(shares[static_cast<std::size_t>(some.pairs[i])].change, expected_shares[i].change);
        }
        for (std::size_t i = 0; i < some.triangles.size(); ++i) {
          EXPECT_EQ(shares[batches.pairs.size() + static_cast<std::size_t>(some.triangles[i])].change,
                    expected_shares[alone.pairs.size() + i].change);
        }
        if (batches.pairs.empty() || every == 1) continue;
        EXPECT_EQ(shares[0].change[0], 3.0F) << "of a batch that was not chosen";
      }
    }
  }
}

TEST(ConstraintBatch, OneBadVertexSpoilsOnlyItsElements) {
  for (const RestShape& rest : all_shapes()) {
    for (const std::size_t bad : {std::size_t{0}, rest.positions.size() / 2, rest.positions.size() - 1}) {
      Moved moved(rest, 0.1, 1.5 * rest.stiffest_element);
      const WithoutTraps off;  // a NaN is compared
      moved.motions[bad].displacement[1] = NAN;
      moved.compute();
      std::set<int> near;
      const auto note = [&](const auto& element) {
        for (const int v : element.vertices) {
          if (v == static_cast<int>(bad)) near.insert(element.vertices.begin(), element.vertices.end());
        }
      };
      for (const DistanceElement& element : rest.distances) note(element);
      for (const AreaElement& element : rest.areas) note(element);
      for (const VolumeElement& element : rest.volumes) note(element);
      for (std::size_t v = 0; v < moved.motions.size(); ++v) {
        EXPECT_EQ(moved.force(v).allFinite(), near.count(static_cast<int>(v)) == 0) << bad << " " << v;
      }
    }
  }
}

/// Two vertices in one place have no direction, a triangle without area no normal: no pull, and nothing infinite.
TEST(ConstraintBatch, ElementsThatHaveCollapsedDoNotPull) {
  const RestShape rest = build_rest_shape(wall_of(make_sphere(0.05, 12)));
  Moved moved(rest, 0.0, 1.5 * rest.stiffest_element);
  for (std::size_t v = 0; v < moved.motions.size(); ++v) {
    for (std::size_t i = 0; i < 3; ++i) {
      moved.motions[v].displacement[i] = -static_cast<float>(rest.positions[v][static_cast<Eigen::Index>(i)]);
    }
  }
  moved.compute();
  for (std::size_t v = 0; v < moved.motions.size(); ++v) EXPECT_TRUE(moved.force(v).allFinite());
}

TEST(ConstraintBatch, NoElementsAddNothing) {
  const ConstraintBatches batches = pack({}, {}, {}, {}, {}, {{}, 1.0});
  EXPECT_TRUE(batches.empty());
  std::vector<VertexPull> pulls(2);
  const std::vector<VertexMotion> motions(2);
  add_constraint_forces(batches, motions.data(), pulls.data(), nullptr);
  for (const VertexPull& pull : pulls) EXPECT_EQ(pull.force[0], 0.0F);
}

}  // namespace
}  // namespace tissue_sim::constraint_batch_test
