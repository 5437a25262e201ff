#include "tissue_sim/tissue/solid.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "tissue/test_solids.h"
#include "tissue_sim/tissue/energy.h"

namespace tissue_sim::solid_test {
namespace {

const Vector3 size(0.03, 0.02, 0.015);
constexpr double edge = 0.005;
const std::array<int, 3> cells = {6, 4, 3};

TetrahedralMesh uneven_block() {
  TetrahedralMesh block = make_block(size, cells);
  jitter_inside(block, size, edge, 0.2);
  return block;
}

std::vector<Vector3> stretched(const std::vector<Vector3>& positions, double strain) {
  std::vector<Vector3> x = positions;
  for (Vector3& v : x) v *= 1.0 + strain;
  return x;
}

TEST(Solid, WeighsItsDensityTimesItsVolume) {
  for (const Model model : {Model::volume, Model::fem}) {
    const Organ organ = solid_organ(uneven_block(), size, model);
    const RestShape shape = build_rest_shape(organ);
    const double weight = organ.material.density * size.prod();
    double sum = 0.0;
    for (const double m : shape.mass) sum += m;
    EXPECT_NEAR(sum, shape.total_mass, 1e-12 * weight);
    EXPECT_NEAR(sum - shape.added_mass, weight, 1e-12 * weight);
    EXPECT_LE(shape.added_mass, 0.005 * weight * (1.0 + 1e-9));
  }
}

TEST(Solid, AVertexWeighsAQuarterOfItsTetrahedra) {
  const Organ organ = solid_organ(uneven_block(), size, Model::fem);
  RestShape shape;
  shape.positions = organ.solid.vertices;
  shape.mass.assign(shape.positions.size(), 0.0);
  add_solid(organ, shape);
  std::vector<double> expected(shape.mass.size(), 0.0);
  for (const Tetrahedron& t : organ.solid.tetrahedra) {
    for (const int v : t) expected[v] += 0.25 * organ.material.density * tetrahedron_volume(organ.solid, t);
  }
  for (std::size_t v = 0; v < expected.size(); ++v) EXPECT_NEAR(shape.mass[v], expected[v], 1e-15 * expected[v]);
}

TEST(Solid, FemHasOneTetrahedronForEach) {
  const Organ organ = solid_organ(uneven_block(), size, Model::fem);
  const RestShape shape = build_rest_shape(organ);
  EXPECT_TRUE(shape.distances.empty() && shape.areas.empty() && shape.volumes.empty());
  ASSERT_EQ(shape.tetrahedra.size(), organ.solid.tetrahedra.size());
  const LameModuli moduli = lame_moduli(5400.0, 0.45);
  for (std::size_t t = 0; t < shape.tetrahedra.size(); ++t) {
    EXPECT_EQ(shape.tetrahedra[t].vertices, organ.solid.tetrahedra[t]);
    EXPECT_EQ(shape.tetrahedra[t].moduli.mu, moduli.mu);
    EXPECT_EQ(shape.tetrahedra[t].moduli.lambda, moduli.lambda);
  }
}

TEST(Solid, VolumeHasEveryEdgeOnceAndEveryTetrahedron) {
  const Organ organ = solid_organ(uneven_block(), size, Model::volume);
  const RestShape shape = build_rest_shape(organ);
  EXPECT_TRUE(shape.tetrahedra.empty() && shape.areas.empty());
  EXPECT_EQ(shape.enclosed.stiffness, 0.0);
  EXPECT_EQ(shape.volumes.size(), organ.solid.tetrahedra.size());

  std::set<std::pair<int, int>> expected;
  for (const Tetrahedron& t : organ.solid.tetrahedra) {
    for (const int a : t) {
      for (const int b : t) {
        if (a < b) expected.insert({a, b});
      }
    }
  }
  std::set<std::pair<int, int>> found;
  for (const DistanceElement& e : shape.distances) {
    EXPECT_LT(e.vertices[0], e.vertices[1]);
    EXPECT_TRUE(found.insert({e.vertices[0], e.vertices[1]}).second) << "twice";
  }
  EXPECT_EQ(found, expected);
}

// Before its correction, one factor for all elements.
TEST(Solid, OfVolumeResistsCompressionWithItsBulkModulusOnAnyMesh) {
  const LameModuli moduli = lame_moduli(5400.0, 0.45);
  const double bulk = moduli.lambda + 2.0 / 3.0 * moduli.mu;
  for (const TetrahedralMesh& block : {make_block(size, cells), uneven_block(), make_block(size, {2, 5, 3})}) {
    const RestShape shape = build_rest_shape(solid_organ(block, size, Model::volume));
    EXPECT_GT(shape.stiffness_correction, 0.5);
    EXPECT_LT(shape.stiffness_correction, 1.3);
    for (const double strain : {0.1, -0.1}) {
      const double change = std::pow(1.0 + strain, 3) - 1.0;
      const double exact = shape.stiffness_correction * size.prod() *
                           (7.5 * moduli.mu * strain * strain + 0.5 * (moduli.lambda - moduli.mu) * change * change);
      EXPECT_NEAR(elastic_energy(shape, stretched(shape.positions, strain)), exact, 1e-12 * exact);
    }
    constexpr double small = 1e-6;
    const double of_bulk = shape.stiffness_correction * 4.5 * bulk * small * small * size.prod();
    EXPECT_NEAR(elastic_energy(shape, stretched(shape.positions, small)), of_bulk, 1e-5 * of_bulk);
  }
}

TEST(Solid, OfFemHasTheBulkModulusToo) {
  const LameModuli moduli = lame_moduli(5400.0, 0.45);
  const RestShape shape = build_rest_shape(solid_organ(uneven_block(), size, Model::fem));
  constexpr double small = 1e-5;
  const double of_bulk = 4.5 * (moduli.lambda + 2.0 / 3.0 * moduli.mu) * small * small * size.prod();
  EXPECT_NEAR(elastic_energy(shape, stretched(shape.positions, small)), of_bulk, 1e-3 * of_bulk);
}

TEST(Solid, ASliverCostsAtMostTwiceTheSubsteps) {
  for (const Model model : {Model::fem, Model::volume}) {
    Organ organ = solid_organ(uneven_block(), size, model);
    const int surface_vertices = static_cast<int>(organ.mesh.vertices.size());
    const RestShape clean = build_rest_shape(organ);
    const int sliver = make_one_sliver(organ.solid, surface_vertices, 1e-3);
    ASSERT_GE(sliver, 0);
    const std::vector<double> volumes = volumes_of(organ.solid);
    int thin = 0;
    for (const double v : volumes) thin += v < 2e-3 * size.prod() / static_cast<double>(volumes.size()) ? 1 : 0;
    ASSERT_EQ(thin, 1);
    const RestShape shape = build_rest_shape(organ);
    EXPECT_GT(shape.stable_substep, 0.5 * clean.stable_substep);
    testing::Test::RecordProperty(model == Model::fem ? "fem_percent" : "volume_percent",
                                  static_cast<int>(100.0 * clean.stable_substep / shape.stable_substep));
  }
}

TEST(Solid, CarriesAnEmbeddedSurfaceAlong) {
  const Organ organ = embedded_sphere(0.01, 24, 3, Model::fem);
  const RestShape shape = build_rest_shape(organ);
  ASSERT_EQ(shape.first_simulated, static_cast<int>(organ.mesh.vertices.size()));
  ASSERT_EQ(shape.surface_vertices, shape.first_simulated);
  ASSERT_EQ(shape.positions.size(), organ.mesh.vertices.size() + organ.solid.vertices.size());

  Matrix3 stretch;
  stretch << 1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.05, 0.0, 1.2;
  const auto moved = [&](const Vector3& p) { return Vector3(stretch * p + Vector3(0.01, 0.02, 0.03)); };
  std::vector<Vector3> x = shape.positions;
  for (std::size_t v = organ.mesh.vertices.size(); v < x.size(); ++v) x[v] = moved(x[v]);
  carry_surface(shape, x);
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    EXPECT_LT((x[v] - moved(organ.mesh.vertices[v])).norm(), 1e-15);
  }

  // However the bearers go, nothing that they carry goes farther than carried_way times the farthest of them.
  std::mt19937 random(5);
  std::uniform_real_distribution<double> way(-1e-3, 1e-3);
  for (int round = 0; round < 20; ++round) {
    const std::vector<Vector3> before = x;
    double farthest = 0.0;
    for (std::size_t v = organ.mesh.vertices.size(); v < x.size(); ++v) {
      x[v] += Vector3(way(random), way(random), way(random));
      farthest = std::max(farthest, (x[v] - before[v]).norm());
    }
    carry_surface(shape, x);
    for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
      EXPECT_LE((x[v] - before[v]).norm(), shape.carried_way * farthest);
    }
  }
}

TEST(Solid, WhatIsAttachedIsOfTheSolid) {
  Organ organ = embedded_sphere(0.01, 12, 2, Model::fem);
  organ.attached = {0, 5};
  const RestShape shape = build_rest_shape(organ);
  for (int v = 0; v < static_cast<int>(shape.positions.size()); ++v) {
    const int of_solid = v - shape.first_simulated;
    EXPECT_EQ(shape.attached[v] != 0, of_solid == 0 || of_solid == 5);
    EXPECT_EQ(shape.inverse_mass[v] == 0.0, of_solid < 0 || of_solid == 0 || of_solid == 5);
    EXPECT_EQ(shape.mass[v] == 0.0, of_solid < 0) << "what is carried weighs nothing";
  }
  for (const NeoHookeanElement& element : shape.tetrahedra) {
    for (const int v : element.vertices) EXPECT_GE(v, shape.first_simulated);
  }
}

}  // namespace
}  // namespace tissue_sim::solid_test
