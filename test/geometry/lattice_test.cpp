#include "tissue_sim/geometry/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::lattice_test {
namespace {

double filled_volume(const Lattice& lattice) {
  double volume = 0.0;
  for (std::size_t t = 0; t < lattice.fill.size(); ++t) {
    volume += lattice.fill[t] * tetrahedron_volume(lattice.mesh, lattice.mesh.tetrahedra[t]);
  }
  return volume;
}

TEST(Lattice, IsSoundAndItsTetrahedraShareTheCubes) {
  const TetrahedralMesh block = make_block({0.05, 0.04, 0.03}, {5, 4, 3});
  const Lattice lattice = cover(block, {}, 0.012);
  const TetrahedralFaults faults = inspect(lattice.mesh);
  EXPECT_EQ(faults.inverted, 0);
  EXPECT_EQ(faults.flat, 0);
  EXPECT_EQ(faults.overlapping_faces, 0);
  EXPECT_EQ(faults.crowded_faces, 0);
  EXPECT_EQ(faults.unreferenced_vertices, 0);
  for (const Tetrahedron& t : lattice.mesh.tetrahedra) {
    EXPECT_NEAR(tetrahedron_volume(lattice.mesh, t), 0.012 * 0.012 * 0.012 / 6.0, 1e-18);
  }
}

TEST(Lattice, HoldsTheVolumeOfTheSolid) {
  const TetrahedralMesh block = make_block({0.05, 0.04, 0.03}, {3, 4, 5});
  for (const double edge : {0.004, 0.0071, 0.013, 0.1}) {
    EXPECT_NEAR(filled_volume(cover(block, {}, edge)) / 6e-5, 1.0, 0.03) << edge;
  }
  for (const double fill : cover(block, {}, 0.05).fill) EXPECT_LE(fill, 1.0);
}

TEST(Lattice, EmbedsEveryPointWhereItIs) {
  const TetrahedralMesh block = make_block({0.05, 0.04, 0.03}, {5, 4, 3});
  const Lattice lattice = cover(block, {Vector3(0.1, 0.1, 0.1)}, 0.009);
  std::vector<Vector3> points = block.vertices;
  points.emplace_back(0.1, 0.1, 0.1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const Tetrahedron& t = block.tetrahedra[random() % block.tetrahedra.size()];
    Vector3 point = Vector3::Zero();
    double sum = 0.0;
    for (const int corner : t) {
      const double weight = part(random);
      point += weight * block.vertices[corner];
      sum += weight;
    }
    points.push_back(point / sum);
  }
  const Lattice whole = cover(block, points, 0.009);
  const Embedding embedding = embed(points, whole);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_LT((embedded_point(embedding, i, whole.mesh.vertices) - points[i]).norm(), 1e-15);
    for (const double weight : embedding.weights[i]) EXPECT_GE(weight, -1e-12);
  }
  EXPECT_THROW(embed({Vector3(0.1, -0.1, 0.1)}, lattice), std::invalid_argument);
}

TEST(Lattice, IsTheSameEveryTime) {
  const TetrahedralMesh block = make_block({0.05, 0.04, 0.03}, {5, 4, 3});
  const Lattice a = cover(block, {}, 0.007);
  const Lattice b = cover(block, {}, 0.007);
  EXPECT_EQ(a.mesh.tetrahedra, b.mesh.tetrahedra);
  EXPECT_EQ(a.fill, b.fill);
}

/// Corner i of a cube lies at the far end of the axes whose bits are set in i, and its tetrahedra go along its edges.
TEST(Lattice, CubesHaveEveryTetrahedronOnce) {
  const double edge = 0.009;
  const Lattice lattice = cover(make_block({0.05, 0.04, 0.03}, {5, 4, 3}), {Vector3(0.1, 0.1, 0.1)}, edge);
  std::vector<int> seen(lattice.mesh.tetrahedra.size(), 0);
  for (const LatticeCube& cube : cubes_of(lattice)) {
    const auto place = [&](int corner) {
      return lattice.mesh.vertices[static_cast<std::size_t>(cube.corners[corner])];
    };
    for (int n = 0; n < 6; ++n) {
      if (cube.tetrahedra[n] < 0) continue;
      ++seen[static_cast<std::size_t>(cube.tetrahedra[n])];
      std::array<int, 4> found = lattice.mesh.tetrahedra[static_cast<std::size_t>(cube.tetrahedra[n])];
      std::array<int, 4> expected{};
      const std::array<int, 4> along = corners_along(n);
      for (std::size_t i = 0; i < 4; ++i) expected[i] = cube.corners[along[i]];
      std::sort(found.begin(), found.end());
      std::sort(expected.begin(), expected.end());
      EXPECT_EQ(found, expected);
      for (const int corner : along) {
        Vector3 way = Vector3::Zero();
        for (int axis = 0; axis < 3; ++axis) {
          if ((corner >> axis & 1) != 0) way[axis] = cube.mirrored[static_cast<std::size_t>(axis)] ? -edge : edge;
        }
        EXPECT_LT((place(corner) - place(0) - way).norm(), 1e-12);
      }
    }
  }
  for (const int times : seen) EXPECT_EQ(times, 1);
}

}  // namespace
}  // namespace tissue_sim::lattice_test
