#include "tissue_sim/tissue/neo_hookean_batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "geometry/twins.h"

namespace tissue_sim::neo_hookean_batch_test {
namespace {

using Vectors = NeoHookeanElement::Vectors;

constexpr double edge_length = 0.002;  // m
constexpr double rounding = 6e-8;      // 2^-24, what one operation in float may be off by

/// A block of cells of six tetrahedra around the diagonal, its vertices moved by up to a tenth of the edge.
struct Block {
  explicit Block(int n, double poisson = 0.45) {
    for (int k = 0; k <= n; ++k) {
      for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i)
          rest.push_back(edge_length * Vector3(i, j, k) + random_point(random, 0.1 * edge_length));
      }
    }
    const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    const int step[3] = {1, n + 1, (n + 1) * (n + 1)};
    for (int k = 0; k < n; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          for (const auto& order : orders) {
            std::array<int, 4> v{};
            v[0] = i * step[0] + j * step[1] + k * step[2];
            for (std::size_t c = 0; c < 3; ++c) v[c + 1] = v[c] + step[order[c]];
            if (&order >= orders + 3) std::swap(v[2], v[3]);
            elements.push_back(NeoHookeanElement::at_rest(v, corners(rest, v), lame_moduli(5400.0, poisson)));
          }
        }
      }
    }
  }

  static Vectors corners(const std::vector<Vector3>& x, const std::array<int, 4>& v) {
    const auto at = [&](int i) { return x[static_cast<std::size_t>(i)]; };
    return {at(v[0]), at(v[1]), at(v[2]), at(v[3])};
  }

  /// One strain everywhere, and as much again from vertex to vertex.
  std::vector<float> displacements(double strain) {
    Matrix3 h;
    h << random_point(random, strain), random_point(random, strain), random_point(random, strain);
    std::vector<float> result;
    for (const Vector3& x : rest) {
      const Vector3 u = h * x + random_point(random, 0.5 * strain * edge_length);
      for (int a = 0; a < 3; ++a) result.push_back(static_cast<float>(u[a]));
      result.push_back(0.0f);
    }
    return result;
  }

  std::vector<Vector3> positions(const std::vector<float>& u) const {
    std::vector<Vector3> x = rest;
    for (std::size_t v = 0; v < x.size(); ++v) x[v] += Vector3(u[4 * v], u[4 * v + 1], u[4 * v + 2]);
    return x;
  }

  std::vector<float> forces(const std::vector<float>& u, InstructionSet set = instruction_set()) const {
    std::vector<float> result(u.size(), 0.0f);
    add_neo_hookean_forces(pack(elements), u.data(), result.data(), set);
    return result;
  }

  Random random{11};
  std::vector<Vector3> rest;
  std::vector<NeoHookeanElement> elements;
};

Vector3 vector_at(const std::vector<float>& values, std::size_t v) {
  return {values[4 * v], values[4 * v + 1], values[4 * v + 2]};
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

/// What the terms of a tetrahedron's force add up to when none of them cancels, N: the rounding is a few parts of this.
double magnitude(const NeoHookeanElement& element, const Vectors& u) {
  double h = 0.0;
  for (std::size_t c = 1; c < 4; ++c) h += (u[c] - u[0]).norm() * element.shape_gradient(c).norm();
  const double cofactors = 1.0 + 2.0 * h + 2.0 * h * h;
  const double stretch = 3.0 * h + 3.0 * h * h + h * h * h;
  const LameModuli& m = element.moduli;
  const double stress = m.mu * (2.0 * h + 2.0 * h * h) + (m.lambda + m.mu) * stretch * cofactors;
  return element.volume * stress * element.inverse_rest.norm();
}

TEST(NeoHookeanBatch, AgreesWithThePlainElement) {
  // On the longest way from a displacement to a force lie some 40 roundings: 6 to H, 8 more to its cofactors, 6 to J -
  // 1, 6 to the stress, 4 to the force, and one for each tetrahedron that a vertex belongs to.
  for (const double strain : {1e-6, 1e-2, 0.5, 2.0}) {
    int inverted = 0;
    for (const int n : {1, 2, 5}) {
      Block block(n);
      const std::vector<float> u = block.displacements(strain);
      const std::vector<Vector3> x = block.positions(u);
      const std::vector<Vector3> origin(x.size(), Vector3::Zero());
      std::vector<Vector3> expected(x.size(), Vector3::Zero());
      std::vector<double> tolerance(x.size(), 0.0);
      for (const NeoHookeanElement& element : block.elements) {
        const Vectors corners = Block::corners(x, element.vertices);
        const Vectors rest = Block::corners(block.rest, element.vertices);
        Vectors gradient;
        element.evaluate(corners, gradient);
        inverted += element.deformation_gradient(corners).determinant() < 0.0;
        const Vectors moved{corners[0] - rest[0], corners[1] - rest[1], corners[2] - rest[2], corners[3] - rest[3]};
        for (std::size_t c = 0; c < 4; ++c) {
          const auto v = static_cast<std::size_t>(element.vertices[c]);
          expected[v] -= gradient[c];
          tolerance[v] += 40.0 * rounding * magnitude(element, moved);
        }
      }
      const std::vector<float> forces = block.forces(u);
      for (std::size_t v = 0; v < x.size(); ++v) {
        EXPECT_LT((vector_at(forces, v) - expected[v]).norm(), tolerance[v]) << strain << " " << n << " " << v;
      }
    }
    EXPECT_EQ(inverted > 0, strain == 2.0);
  }
}

TEST(NeoHookeanBatch, AHundredThousandRandomTetrahedraPullAsThePlainOnes) {
  Block block(6);
  std::size_t tetrahedra = 0;
  double worst = 0.0;
  for (int round = 0; tetrahedra < 100'000; ++round) {
    const std::vector<float> u = block.displacements(0.1 * (1 + round % 5));
    const std::vector<Vector3> x = block.positions(u);
    std::vector<Vector3> expected(x.size(), Vector3::Zero());
    for (const NeoHookeanElement& element : block.elements) {
      Vectors gradient;
      element.evaluate(Block::corners(x, element.vertices), gradient);
      for (std::size_t c = 0; c < 4; ++c) expected[static_cast<std::size_t>(element.vertices[c])] -= gradient[c];
    }
    double size = 0.0;
    for (const Vector3& f : expected) size = std::max(size, f.norm());
    const std::vector<float> forces = block.forces(u);
    for (std::size_t v = 0; v < x.size(); ++v) {
      worst = std::max(worst, (vector_at(forces, v) - expected[v]).norm() / size);
    }
    tetrahedra += block.elements.size();
  }
  EXPECT_LT(worst, 1e-5) << "in floats, of the largest force";
  testing::Test::RecordProperty("worst_per_billion", static_cast<int>(1e9 * worst));
}

/// Formed as 1 + H, the deformation gradient would lose the stress of such a strain to 1e-1.
TEST(NeoHookeanBatch, SmallStrainsKeepTheirDigits) {
  for (const double strain : {1e-3, 1e-6, 1e-9}) {
    Block block(2);
    const std::vector<float> u = block.displacements(strain);
    const std::vector<Vector3> x = block.positions(u);
    for (const NeoHookeanElement& element : block.elements) {
      std::vector<float> forces(u.size(), 0.0f);
      add_neo_hookean_forces(pack({element}), u.data(), forces.data());
      Vectors gradient;
      element.evaluate(Block::corners(x, element.vertices), gradient);
      for (std::size_t c = 0; c < 4; ++c) {
        const auto v = static_cast<std::size_t>(element.vertices[c]);
        EXPECT_LT((vector_at(forces, v) + gradient[c]).norm(), 1e-5 * gradient[c].norm()) << strain;
      }
    }
  }
}

TEST(NeoHookeanBatch, RestMakesNoForceAtAll) {
  const Block block(3);
  const std::vector<float> u(4 * block.rest.size(), 0.0f);
  for (const float f : block.forces(u)) EXPECT_EQ(f, 0.0f);
}

TEST(NeoHookeanBatch, ShiftingTheWholeMakesNoForceAtAll) {
  const Block block(3);
  std::vector<float> u;
  for (std::size_t v = 0; v < block.rest.size(); ++v) u.insert(u.end(), {0.1f, -0.03f, 7.0f, 0.0f});
  for (const float f : block.forces(u)) EXPECT_EQ(f, 0.0f);
}

TEST(NeoHookeanBatch, SameBitsWithEveryInstructionSet) {
  EXPECT_TRUE(available(InstructionSet::baseline));
  EXPECT_TRUE(available(instruction_set()));
  EXPECT_STRNE(name(InstructionSet::baseline), name(InstructionSet::avx2));
  for (const double strain : {1e-6, 1e-2, 0.5, 2.0}) {
    Block block(4);
    const std::vector<float> u = block.displacements(strain);
    const std::vector<float> baseline = block.forces(u, InstructionSet::baseline);
    EXPECT_NE(baseline[0], 0.0f);
    if (available(InstructionSet::avx2)) {
      EXPECT_TRUE(same_bits(block.forces(u, InstructionSet::avx2), baseline)) << strain;
    } else {
      EXPECT_THROW(block.forces(u, InstructionSet::avx2), std::invalid_argument);
    }
  }
}

/// Batches of n are the same as n batches of one, one after the other: neither what fills up the last batch nor the
/// place in it shows in the result, and a vertex's forces are added in the order of the tetrahedra.
TEST(NeoHookeanBatch, SameBitsWhateverThePadding) {
  Block block(3);
  const std::vector<float> u = block.displacements(0.3);
  std::vector<float> before;
  for (std::size_t i = 0; i < u.size(); ++i)
    before.push_back(i % 3 == 0 ? -0.0f : static_cast<float>(random_in(block.random, -1.0, 1.0)));
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (!available(set)) continue;
    std::vector<float> one_by_one = before;
    for (std::size_t n = 0; n <= 70; ++n) {
      const std::vector<NeoHookeanElement> first(block.elements.begin(),
                                                 block.elements.begin() + static_cast<std::ptrdiff_t>(n));
      std::vector<float> forces = before;
      add_neo_hookean_forces(pack(first), u.data(), forces.data(), set);
      EXPECT_TRUE(same_bits(forces, one_by_one)) << name(set) << " " << n;
      add_neo_hookean_forces(pack({block.elements[n]}), u.data(), one_by_one.data(), set);
    }
  }
}

/// Some of the batches give what their tetrahedra alone give; what another list of batches added before stays.
TEST(NeoHookeanBatch, SomeBatchesAreTheSameAsNoOthersThere) {
  Block block(3);
  block.elements.resize(block.elements.size() - 3);
  const NeoHookeanSolid solid = pack(block.elements);
  const std::vector<float> u = block.displacements(0.3);
  std::vector<int> all;
  for (std::size_t b = 0; b < solid.batches.size(); ++b) all.push_back(static_cast<int>(b));
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (!available(set)) continue;
    std::vector<float> forces(u.size(), 0.0f);
    add_neo_hookean_forces(solid, all, u.data(), forces.data(), set);
    EXPECT_TRUE(same_bits(forces, block.forces(u, set)));
    for (const int every : {2, 3, 7}) {
      std::vector<int> some;
      std::vector<NeoHookeanElement> theirs;
      for (std::size_t t = 0; t < block.elements.size(); ++t) {
        const int b = static_cast<int>(t / NeoHookeanBatch::lanes);
        if ((b + 1) % every != 0 && b != all.back()) continue;
        if (some.empty() || some.back() != b) some.push_back(b);
        theirs.push_back(block.elements[t]);
      }
      ASSERT_LT(some.size(), all.size());
      std::vector<float> expected(u.size(), 0.25f);
      add_neo_hookean_forces(pack(theirs), u.data(), expected.data(), set);
      forces.assign(u.size(), 0.25f);
      add_neo_hookean_forces(solid, some, u.data(), forces.data(), set);
      EXPECT_TRUE(same_bits(forces, expected)) << every;
    }
  }
  std::vector<float> none(u.size(), 0.25f);
  add_neo_hookean_forces(solid, std::vector<int>(), u.data(), none.data());
  EXPECT_EQ(none, std::vector<float>(u.size(), 0.25f));
}

/// Products of these displacements are below what a float holds in full; what is linear in them is not.
TEST(NeoHookeanBatch, TinyStrainsKeepTheirLinearPartAndTheCallerKeepsItsRounding) {
  Block block(2);
  const std::vector<float> u = block.displacements(1e-20);
  std::vector<float> larger = u;
  for (float& value : larger) value *= 1024.0f * 1024.0f;
  const std::vector<float> forces = block.forces(u);
  const std::vector<float> larger_forces = block.forces(larger);
  for (std::size_t i = 0; i < u.size(); ++i) EXPECT_EQ(forces[i] * 1024.0f * 1024.0f, larger_forces[i]);
  EXPECT_NE(forces[0], 0.0f);
  volatile float smallest = std::numeric_limits<float>::min();
  EXPECT_GT(smallest / 4.0f, 0.0f);
}

TEST(NeoHookeanBatch, FourthComponentIsNeitherReadNorChanged) {
  Block block(2);
  std::vector<float> u = block.displacements(0.1);
  const std::vector<float> expected = block.forces(u);
  for (std::size_t v = 0; v < block.rest.size(); ++v) u[4 * v + 3] = NAN;
  const std::vector<float> forces = block.forces(u);
  EXPECT_TRUE(same_bits(forces, expected));
  for (std::size_t v = 0; v < block.rest.size(); ++v) EXPECT_EQ(forces[4 * v + 3], 0.0f);
}

TEST(NeoHookeanBatch, NoTetrahedraAddNothing) {
  const NeoHookeanSolid solid = pack({});
  EXPECT_TRUE(solid.batches.empty());
  std::vector<float> forces(8, 1.0f);
  add_neo_hookean_forces(solid, std::vector<float>(8, 2.0f).data(), forces.data());
  EXPECT_EQ(forces, std::vector<float>(8, 1.0f));
}

TEST(NeoHookeanBatch, OneBadVertexSpoilsOnlyItsTetrahedra) {
  Block block(3);
  block.elements.resize(block.elements.size() - 5);
  for (const std::size_t bad : {std::size_t{0}, std::size_t{21}, block.rest.size() - 1}) {
    std::vector<float> u = block.displacements(0.1);
    u[4 * bad] = NAN;
    std::vector<bool> spoiled(block.rest.size(), false);
    for (const NeoHookeanElement& element : block.elements) {
      bool touched = false;
      for (const int v : element.vertices) touched = touched || static_cast<std::size_t>(v) == bad;
      for (const int v : element.vertices)
        spoiled[static_cast<std::size_t>(v)] = spoiled[static_cast<std::size_t>(v)] || touched;
    }
    const std::vector<float> forces = block.forces(u);
    for (std::size_t v = 0; v < block.rest.size(); ++v) {
      EXPECT_EQ(vector_at(forces, v).allFinite(), !spoiled[v]) << bad << " " << v;
    }
  }
}

}  // namespace
}  // namespace tissue_sim::neo_hookean_batch_test
