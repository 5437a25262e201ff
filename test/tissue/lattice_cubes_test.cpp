#include "tissue_sim/tissue/lattice_cubes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::lattice_cubes_test {
namespace {

using Vectors = NeoHookeanElement::Vectors;

constexpr double edge = 0.009;  // m

/// Not along the axes, so that cubes at its surface lack tetrahedra.
TetrahedralMesh turned_block() {
  TetrahedralMesh block = make_block({0.05, 0.04, 0.03}, {4, 3, 5});
  for (Vector3& v : block.vertices) v = turn(0.7, Vector3(2.0, 1.0, -2.0) / 3.0) * v;
  return block;
}

/// The lattice of a block, of which the outermost cubes have only some of their tetrahedra, each with moduli of its
/// own.
struct LatticeOfBlock {
  LatticeOfBlock() : lattice(cover(turned_block(), {}, edge)) {
    for (std::size_t t = 0; t < lattice.mesh.tetrahedra.size(); ++t) {
      const Tetrahedron& corners = lattice.mesh.tetrahedra[t];
      Vectors x;
      for (std::size_t i = 0; i < 4; ++i) x[i] = lattice.mesh.vertices[static_cast<std::size_t>(corners[i])];
      const LameModuli moduli = lame_moduli(2000.0 + 10.0 * static_cast<double>(t), 0.45);
      elements.push_back(NeoHookeanElement::at_rest(corners, x, moduli));
    }
    cubes = pack(lattice, elements);
  }

  /// One strain everywhere, and as much again from vertex to vertex.
  std::vector<float> displacements(double strain) {
    Matrix3 h;
    h << random_point(random, strain), random_point(random, strain), random_point(random, strain);
    std::vector<float> result;
    for (const Vector3& x : lattice.mesh.vertices) {
      const Vector3 u = h * x + random_point(random, 0.5 * strain * edge);
      for (int a = 0; a < 3; ++a) result.push_back(static_cast<float>(u[a]));
      result.push_back(0.0F);
    }
    return result;
  }

  std::vector<float> forces(const std::vector<float>& u, InstructionSet set = instruction_set()) const {
    std::vector<float> result(u.size(), 0.0F);
    add_cube_forces(cubes, u.data(), result.data(), set);
    return result;
  }

  /// One tetrahedron after the other, in double.
  std::vector<Vector3> plain_forces(const std::vector<float>& u) const {
    std::vector<Vector3> forces(lattice.mesh.vertices.size(), Vector3::Zero());
    for (const NeoHookeanElement& element : elements) {
      Vectors x;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto v = static_cast<std::size_t>(element.vertices[i]);
        x[i] = lattice.mesh.vertices[v] + Vector3(u[4 * v], u[4 * v + 1], u[4 * v + 2]);
      }
      Vectors gradient;
      element.evaluate(x, gradient);
      for (std::size_t i = 0; i < 4; ++i) forces[static_cast<std::size_t>(element.vertices[i])] -= gradient[i];
    }
    return forces;
  }

  Random random{5};
  Lattice lattice;
  std::vector<NeoHookeanElement> elements;
  LatticeCubes cubes;
};

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST(LatticeCubes, AgreeWithThePlainElements) {
  LatticeOfBlock block;
  ASSERT_LT(block.elements.size(), 6 * block.cubes.cubes) << "some cubes should lack tetrahedra";
  for (const double strain : {1e-5, 1e-2, 0.5}) {
    const std::vector<float> u = block.displacements(strain);
    const std::vector<float> found = block.forces(u);
    const std::vector<Vector3> expected = block.plain_forces(u);
    double largest = 0.0;
    for (const Vector3& force : expected) largest = std::max(largest, force.norm());
    ASSERT_GT(largest, 0.0);
    for (std::size_t v = 0; v < expected.size(); ++v) {
      const Vector3 force(found[4 * v], found[4 * v + 1], found[4 * v + 2]);
      // A strain of 1e-5 is a difference of two floats of which each has seven digits.
      EXPECT_LT((force - expected[v]).norm(), 1e-5 * largest) << "vertex " << v << ", strain " << strain;
      EXPECT_EQ(found[4 * v + 3], 0.0F);
    }
  }
}

TEST(LatticeCubes, GiveTheSameBitsInAllRegisters) {
  LatticeOfBlock block;
  const std::vector<float> u = block.displacements(0.3);
  const std::vector<float> expected = block.forces(u, InstructionSet::baseline);
  for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (available(set)) {
      EXPECT_TRUE(same_bits(block.forces(u, set), expected)) << name(set);
    } else {
      EXPECT_THROW(block.forces(u, set), std::invalid_argument) << name(set);
    }
  }
}

TEST(LatticeCubes, ACopiedCubePullsAsItDidAmongTheOthers) {
  LatticeOfBlock block;
  const std::vector<float> u = block.displacements(0.1);
  LatticeOfBlock copies;
  copies.cubes = LatticeCubes();
  for (std::size_t cube = block.cubes.cubes; cube-- > 0;) {
    add_cube(block.cubes.batches[cube / CubeBatch::lanes], cube % CubeBatch::lanes, copies.cubes);
  }
  fill_last(copies.cubes);
  EXPECT_EQ(copies.cubes.cubes, block.cubes.cubes);
  const std::vector<float> found = copies.forces(u);
  const std::vector<float> expected = block.forces(u);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6F);
}

TEST(LatticeCubes, ABadDisplacementSpoilsItsOwnCubesOnly) {
  LatticeOfBlock block;
  std::vector<float> u = block.displacements(0.01);
  const std::vector<float> before = block.forces(u);
  const int bad = block.cubes.batches.front().vertices[0][0];
  u[4 * static_cast<std::size_t>(bad)] = std::numeric_limits<float>::infinity();
  std::vector<char> beside(block.lattice.mesh.vertices.size(), 0);
  for (std::size_t cube = 0; cube < block.cubes.cubes; ++cube) {
    const CubeBatch& batch = block.cubes.batches[cube / CubeBatch::lanes];
    bool has_it = false;
    for (const auto& row : batch.vertices) has_it = has_it || row[cube % CubeBatch::lanes] == bad;
    if (!has_it) continue;
    for (const auto& row : batch.vertices) beside[static_cast<std::size_t>(row[cube % CubeBatch::lanes])] = 1;
  }
  std::vector<float> after;
  {
    const WithoutTraps off;  // infinities are subtracted
    after = block.forces(u);
  }
  EXPECT_FALSE(std::isfinite(after[4 * static_cast<std::size_t>(bad)]));
  for (std::size_t v = 0; v < beside.size(); ++v) {
    for (std::size_t a = 0; a < 3 && beside[v] == 0; ++a) EXPECT_EQ(after[4 * v + a], before[4 * v + a]);
  }
}

}  // namespace
}  // namespace tissue_sim::lattice_cubes_test
