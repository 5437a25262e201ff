#include "tissue_sim/contact/instrument_surface.h"

#include <gtest/gtest.h>

#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::instrument_surface_test {
namespace {

TEST(InstrumentSurface, KnowsItsNormalsAndReach) {
  const InstrumentSurface box = build_instrument_surface(moved(make_box({2, 2, 2}), {{0, 0, 3}, {1, 0, 0, 0}}), true);
  EXPECT_DOUBLE_EQ(box.reach, Vector3(1, 1, 4).norm());
  EXPECT_EQ(box.bounds.lower, Vector3(-1, -1, 2));
  for (std::size_t t = 0; t < box.triangles.size(); ++t) {
    EXPECT_NEAR(box.normals[t].norm(), 1.0, 1e-15);
    EXPECT_NEAR(box.normals[t].dot(box.vertices[box.triangles[t][0]] - Vector3(0, 0, 3)), 1.0, 1e-15);
  }
  for (std::size_t v = 0; v < box.vertices.size(); ++v) {
    EXPECT_LT((box.vertex_normals[v] - (box.vertices[v] - Vector3(0, 0, 3)).normalized()).norm(), 1e-12);
  }
}

TEST(ClosestFeature, EqualsBruteForceAndTheWindingNumber) {
  Random random(2);
  for (const TriangleMesh& mesh : {make_octasphere(1.0, 2), make_torus(0.7, 0.25, 9), make_box({1.0, 0.5, 1.4})}) {
    const InstrumentSurface surface = build_instrument_surface(mesh, true);
    for (int round = 0; round < 1000; ++round) {
      const Vector3 p = random_point(random, 1.2);
      const ClosestFeature closest = closest_feature(surface, p);
      EXPECT_NEAR(std::abs(closest.depth), distance_to_mesh(mesh, p), 1e-12);
      EXPECT_EQ(closest.depth > 0.0, is_inside(mesh, p));
      EXPECT_NEAR(closest.direction.norm(), 1.0, 1e-12);
      EXPECT_LT((p + closest.depth * closest.direction - closest.point).norm(), 1e-12);
    }
  }
}

TEST(ClosestFeature, OnTheSurfaceItsDirectionIsTheNormal) {
  const InstrumentSurface box = build_instrument_surface(make_box({2, 2, 2}), true);
  for (const double off : {0.0, 1e-12, -1e-12}) {
    EXPECT_LT((closest_feature(box, {1.0 + off, 0.3, 0.2}).direction - Vector3::UnitX()).norm(), 1e-12);
    if (off < 0.0) continue;  // below an edge a face is nearer
    EXPECT_LT((closest_feature(box, {1.0 + off, 1.0 + off, 0.2}).direction - Vector3(1, 1, 0).normalized()).norm(),
              1e-12);
    EXPECT_LT((closest_feature(box, (1.0 + off) * Vector3::Ones()).direction - Vector3::Ones().normalized()).norm(),
              1e-12);
  }
}

TEST(ClosestFeature, WhatIsNoNumberIsFarOutside) {
  const InstrumentSurface box = build_instrument_surface(make_box({2, 2, 2}), true);
  const ClosestFeature closest = closest_feature(box, {0.0, std::nan(""), 0.0});
  EXPECT_LT(closest.depth, -1e100);
  EXPECT_TRUE(closest.direction.allFinite());
}

}  // namespace
}  // namespace tissue_sim::instrument_surface_test
