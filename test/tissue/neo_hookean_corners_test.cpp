#include "tissue_sim/tissue/neo_hookean_corners.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "geometry/twins.h"
#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim::neo_hookean_corners_test {
namespace {

using Vectors = NeoHookeanElement::Vectors;
using Displacements = std::vector<Eigen::Vector4f>;

constexpr double edge_length = 0.002;  // m
constexpr double rounding = 6e-8;      // 2^-24, what one operation in float may be off by

/// Tetrahedra, and the plain sum over those around a vertex.
struct Tissue {
  static Vectors corners(const std::vector<Vector3>& x, const std::array<int, 4>& v) {
    const auto at = [&](int i) { return x[static_cast<std::size_t>(i)]; };
    return {at(v[0]), at(v[1]), at(v[2]), at(v[3])};
  }

  void add(const std::array<int, 4>& v, double poisson = 0.45) {
    elements.push_back(NeoHookeanElement::at_rest(v, corners(rest, v), lame_moduli(5400.0, poisson)));
  }

  /// One strain everywhere, and as much again from vertex to vertex.
  Displacements displacements(double strain) {
    Matrix3 h;
    h << random_point(random, strain), random_point(random, strain), random_point(random, strain);
    Displacements result;
    for (const Vector3& x : rest) {
      const Vector3 u = h * x + random_point(random, 0.5 * strain * edge_length);
      result.emplace_back(static_cast<float>(u.x()), static_cast<float>(u.y()), static_cast<float>(u.z()), 0.0F);
    }
    return result;
  }

  std::vector<Vector3> positions(const Displacements& u) const {
    std::vector<Vector3> x = rest;
    for (std::size_t v = 0; v < x.size(); ++v) x[v] += u[v].head<3>().cast<double>();
    return x;
  }

  std::vector<LocalStiffness> plain(const Displacements& u) const {
    const std::vector<Vector3> x = positions(u);
    std::vector<LocalStiffness> sums(x.size());
    for (const NeoHookeanElement& element : elements) {
      for (std::size_t c = 0; c < 4; ++c) {
        const LocalStiffness local = element.local(corners(x, element.vertices), c);
        LocalStiffness& sum = sums[static_cast<std::size_t>(element.vertices[c])];
        sum.gradient += local.gradient;
        sum.block += local.block;
      }
    }
    return sums;
  }

  std::vector<LocalStiffness> fast(const Displacements& u, InstructionSet set = instruction_set()) const {
    const CornerBatches corners = pack_corners(elements, rest.size());
    const CornerSum sum = corner_sum(set);
    std::vector<LocalStiffness> sums;
    for (std::size_t v = 0; v < rest.size(); ++v) sums.push_back(sum(corners, static_cast<int>(v), u.data()));
    return sums;
  }

  Random random{11};
  std::vector<Vector3> rest;
  std::vector<NeoHookeanElement> elements;
};

/// A block of n x n x n cells, its vertices moved by up to a tenth of the edge.
Tissue make_tissue(int n) {
  Tissue tissue;
  const TetrahedralMesh mesh = make_block(edge_length * Vector3(n, n, n), {n, n, n});
  for (const Vector3& x : mesh.vertices) tissue.rest.push_back(x + random_point(tissue.random, 0.1 * edge_length));
  for (const Tetrahedron& v : mesh.tetrahedra) tissue.add(v);
  return tissue;
}

/// What the terms of a corner's gradient (N) and block (N/m) add up to when none of them cancels: the rounding is a few
/// parts of this. `h` bounds the gradient of the displacements.
void add_magnitude(const NeoHookeanElement& element, std::size_t corner, const Vectors& u, double& gradient,
                   double& block) {
  double h = 0.0;
  double longest = 0.0;  // of the shape gradients, since our own is made of the others
  for (std::size_t c = 0; c < 4; ++c) {
    h += (u[c] - u[corner]).norm() * element.shape_gradient(c).norm();
    longest += element.shape_gradient(c).norm();
  }
  const double cofactors = 1.0 + 2.0 * h + 2.0 * h * h;
  const double stretch = 3.0 * h + 3.0 * h * h + h * h * h;
  const double stiff = element.moduli.lambda + element.moduli.mu;
  const double stress = element.moduli.mu * (2.0 * h + 2.0 * h * h) + stiff * stretch * cofactors;
  gradient += element.volume * stress * longest;
  block += element.volume * stiff * std::pow(cofactors * longest, 2);
}

bool same_bits(const std::vector<LocalStiffness>& a, const std::vector<LocalStiffness>& b) {
  for (std::size_t v = 0; v < a.size(); ++v) {
    if (std::memcmp(a[v].gradient.data(), b[v].gradient.data(), sizeof(Vector3)) != 0) return false;
    if (std::memcmp(a[v].block.data(), b[v].block.data(), sizeof(Matrix3)) != 0) return false;
  }
  return a.size() == b.size();
}

TEST(NeoHookeanCorners, AgreeWithThePlainElement) {
  // Some 30 roundings lie on the longest way from a displacement to a gradient, and one more for each tetrahedron that
  // shares a lane.
  for (const double strain : {1e-6, 1e-2, 0.5, 2.0}) {
    int inverted = 0;
    for (const int n : {1, 2, 5}) {
      Tissue tissue = make_tissue(n);
      const Displacements u = tissue.displacements(strain);
      const std::vector<Vector3> x = tissue.positions(u);
      std::vector<double> gradient(x.size(), 0.0);
      std::vector<double> block(x.size(), 0.0);
      for (const NeoHookeanElement& element : tissue.elements) {
        Vectors moved = Tissue::corners(x, element.vertices);
        inverted += element.deformation_gradient(moved).determinant() < 0.0;
        for (std::size_t c = 0; c < 4; ++c) moved[c] -= tissue.rest[static_cast<std::size_t>(element.vertices[c])];
        for (std::size_t c = 0; c < 4; ++c) {
          const auto v = static_cast<std::size_t>(element.vertices[c]);
          add_magnitude(element, c, moved, gradient[v], block[v]);
        }
      }
      const std::vector<LocalStiffness> expected = tissue.plain(u);
      const std::vector<LocalStiffness> sums = tissue.fast(u);
      for (std::size_t v = 0; v < x.size(); ++v) {
        EXPECT_LT((sums[v].gradient - expected[v].gradient).norm(), 30.0 * rounding * gradient[v])
            << strain << " " << v;
        EXPECT_LT((sums[v].block - expected[v].block).norm(), 30.0 * rounding * block[v]) << strain << " " << v;
        EXPECT_GT(expected[v].block.norm(), 0.0);
      }
    }
    EXPECT_EQ(inverted > 0, strain == 2.0);
  }
}

/// Moderately deformed, what is left is a few parts in ten million of the largest in the block.
TEST(NeoHookeanCorners, KeepSixDigits) {
  Tissue tissue = make_tissue(4);
  const Displacements u = tissue.displacements(0.1);
  const std::vector<LocalStiffness> expected = tissue.plain(u);
  const std::vector<LocalStiffness> sums = tissue.fast(u);
  double gradient = 0.0;
  double block = 0.0;
  for (const LocalStiffness& local : expected) {
    gradient = std::max(gradient, local.gradient.norm());
    block = std::max(block, local.block.norm());
  }
  for (std::size_t v = 0; v < sums.size(); ++v) {
    EXPECT_LT((sums[v].gradient - expected[v].gradient).norm(), 1e-6 * gradient);
    EXPECT_LT((sums[v].block - expected[v].block).norm(), 1e-6 * block);
  }
}

/// From none at all to more than two batches, in which lanes are left free.
TEST(NeoHookeanCorners, AnyNumberAroundAVertex) {
  for (int n = 0; n <= 19; ++n) {
    Tissue tissue;
    tissue.rest = {Vector3::Zero(), edge_length * Vector3::UnitZ()};
    for (int i = 0; i <= n; ++i) {
      tissue.rest.push_back(edge_length * Vector3(std::cos(0.3 * i), std::sin(0.3 * i), 0.0));
      if (i > 0) tissue.add({0, i + 1, i + 2, 1}, 0.3 + 0.01 * i);
    }
    const Displacements u = tissue.displacements(0.2);
    const LocalStiffness expected = tissue.plain(u)[0];
    for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
      if (!available(set)) continue;
      const LocalStiffness sum = tissue.fast(u, set)[0];
      EXPECT_LE((sum.gradient - expected.gradient).norm(), 1e-5 * expected.gradient.norm()) << n;
      EXPECT_LE((sum.block - expected.block).norm(), 1e-5 * expected.block.norm()) << n;
    }
    EXPECT_EQ(expected.gradient.norm() > 0.0, n > 0);
  }
}

/// Formed as 1 + H, the deformation gradient would lose the stress of such a strain to 1e-1.
TEST(NeoHookeanCorners, SmallStrainsKeepTheirDigits) {
  for (const double strain : {1e-3, 1e-6, 1e-9}) {
    Tissue tissue = make_tissue(2);
    const std::vector<NeoHookeanElement> all = tissue.elements;
    const Displacements u = tissue.displacements(strain);
    for (const NeoHookeanElement& element : all) {
      tissue.elements = {element};
      const std::vector<LocalStiffness> expected = tissue.plain(u);
      const std::vector<LocalStiffness> sums = tissue.fast(u);
      for (const int vertex : element.vertices) {
        const auto v = static_cast<std::size_t>(vertex);
        EXPECT_LT((sums[v].gradient - expected[v].gradient).norm(), 1e-5 * expected[v].gradient.norm()) << strain;
      }
    }
  }
}

/// A tetrahedron of a thousandth of the height: its shape gradients are a thousand times those of its neighbours, and
/// what is left of their products is far smaller than they are.
TEST(NeoHookeanCorners, SliversKeepTheirDigits) {
  Tissue tissue;
  tissue.rest = {Vector3::Zero(), edge_length * Vector3::UnitX(), edge_length * Vector3::UnitY(),
                 edge_length * Vector3(0.3, 0.4, 1e-3)};
  tissue.add({0, 1, 2, 3});
  const Displacements u = tissue.displacements(1e-3);
  const std::vector<LocalStiffness> expected = tissue.plain(u);
  const std::vector<LocalStiffness> sums = tissue.fast(u);
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_LT((sums[v].gradient - expected[v].gradient).norm(), 1e-5 * expected[v].gradient.norm()) << v;
    EXPECT_LT((sums[v].block - expected[v].block).norm(), 1e-5 * expected[v].block.norm()) << v;
  }
}

TEST(NeoHookeanCorners, RestAndShiftsMakeNoGradientAtAll) {
  const Tissue tissue = make_tissue(3);
  for (const Eigen::Vector4f& shift :
       {Eigen::Vector4f(0.0F, 0.0F, 0.0F, 0.0F), Eigen::Vector4f(0.1F, -0.03F, 7.0F, 0.0F)}) {
    const Displacements u(tissue.rest.size(), shift);
    const std::vector<LocalStiffness> expected = tissue.plain(Displacements(u.size(), Eigen::Vector4f::Zero()));
    const std::vector<LocalStiffness> sums = tissue.fast(u);
    for (std::size_t v = 0; v < sums.size(); ++v) {
      EXPECT_EQ(sums[v].gradient, Vector3::Zero());
      EXPECT_LT((sums[v].block - expected[v].block).norm(), 1e-6 * expected[v].block.norm());
    }
  }
}

TEST(NeoHookeanCorners, SameBitsWithEveryInstructionSet) {
  for (const double strain : {0.0, 1e-20, 1e-6, 1e-2, 0.5, 2.0}) {
    Tissue tissue = make_tissue(4);
    const Displacements u = tissue.displacements(strain);
    const std::vector<LocalStiffness> baseline = tissue.fast(u, InstructionSet::baseline);
    EXPECT_EQ(baseline[0].gradient.norm() > 0.0, strain > 0.0);
    if (available(InstructionSet::avx2)) {
      EXPECT_TRUE(same_bits(tissue.fast(u, InstructionSet::avx2), baseline)) << strain;
    } else {
      EXPECT_THROW(corner_sum(InstructionSet::avx2), std::invalid_argument);
    }
  }
}

TEST(NeoHookeanCorners, BlockIsSymmetricToTheLastBit) {
  Tissue tissue = make_tissue(2);
  for (const LocalStiffness& local : tissue.fast(tissue.displacements(0.5))) {
    EXPECT_EQ(local.block, local.block.transpose().eval());
  }
}

TEST(NeoHookeanCorners, FourthComponentIsNotRead) {
  Tissue tissue = make_tissue(2);
  Displacements u = tissue.displacements(0.1);
  const std::vector<LocalStiffness> expected = tissue.fast(u);
  for (Eigen::Vector4f& value : u) value[3] = NAN;
  EXPECT_TRUE(same_bits(tissue.fast(u), expected));
}

TEST(NeoHookeanCorners, OneBadVertexSpoilsOnlyItsNeighbours) {
  Tissue tissue = make_tissue(3);
  for (const std::size_t bad : {std::size_t{0}, std::size_t{21}, tissue.rest.size() - 1}) {
    Displacements u = tissue.displacements(0.1);
    u[bad].x() = NAN;
    std::vector<bool> spoiled(u.size(), false);
    for (const NeoHookeanElement& element : tissue.elements) {
      bool touched = false;
      for (const int v : element.vertices) touched = touched || static_cast<std::size_t>(v) == bad;
      for (const int v : element.vertices) {
        spoiled[static_cast<std::size_t>(v)] = spoiled[static_cast<std::size_t>(v)] || touched;
      }
    }
    const std::vector<LocalStiffness> sums = tissue.fast(u);
    for (std::size_t v = 0; v < u.size(); ++v) EXPECT_EQ(sums[v].gradient.allFinite(), !spoiled[v]) << bad << " " << v;
  }
}

TEST(NeoHookeanCorners, NoTetrahedraAddNothing) {
  Tissue tissue;
  tissue.rest.assign(3, Vector3::Zero());
  const CornerBatches corners = pack_corners({}, 3);
  EXPECT_TRUE(corners.batches.empty());
  EXPECT_EQ(corners.first, std::vector<int>(4, 0));
  for (const LocalStiffness& local : tissue.fast(Displacements(3, Eigen::Vector4f::Ones()))) {
    EXPECT_EQ(local.gradient, Vector3::Zero());
    EXPECT_EQ(local.block, Matrix3::Zero());
  }
}

#ifdef __x86_64__
TEST(NeoHookeanCorners, TheCallerKeepsItsRounding) {
  volatile float smallest = std::numeric_limits<float>::min();
  {
    const TinyIsZero tiny_is_zero;
    volatile float quarter = smallest / 4.0F;
    EXPECT_EQ(quarter, 0.0F);
  }
  volatile float quarter = smallest / 4.0F;
  EXPECT_GT(quarter, 0.0F);
}
#endif

}  // namespace
}  // namespace tissue_sim::neo_hookean_corners_test
