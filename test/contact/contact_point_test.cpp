#include "tissue_sim/contact/contact_point.h"

#include <limits>
#include <numeric>

#include "contact/test_organ.h"
#include "floating_point_traps.h"
#include "tissue_sim/contact/response.h"
#include "tissue_sim/geometry/embedding.h"

namespace tissue_sim::contact_point_test {
namespace {

std::vector<int> all_vertices(const InstrumentSurface& instrument) {
  std::vector<int> vertices(instrument.vertices.size());
  std::iota(vertices.begin(), vertices.end(), 0);
  return vertices;
}

Clearance new_clearance(const InstrumentSurface& instrument) {
  return Clearance(instrument.vertices.size());
}

std::vector<ContactPoint> pokes(const TestOrgan& organ, const InstrumentSurface& instrument, const Pose& pose,
                                Clearance& clearance) {
  std::vector<ContactPoint> points;
  add_poke_contacts(organ.surface(), instrument, 0, pose, all_vertices(instrument), clearance, points);
  return points;
}

std::vector<ContactPoint> pokes(const TestOrgan& organ, const InstrumentSurface& instrument, const Pose& pose) {
  Clearance clearance = new_clearance(instrument);
  return pokes(organ, instrument, pose, clearance);
}

Vector3 place_of(const ContactPoint& point, const TestOrgan& organ) {
  Vector3 place = Vector3::Zero();
  const Triangle& corners = organ.mesh.triangles[point.triangle];
  for (int i = 0; i < 3; ++i) place += point.weights[i] * organ.mesh.vertices[corners[i]];
  return place;
}

void expect_sound(const ContactPoint& point, const TestOrgan& organ) {
  EXPECT_NEAR(point.weights.sum(), 1.0, 1e-12);
  EXPECT_GE(point.weights.minCoeff(), 0.0);
  EXPECT_LT((at_point(point, organ.mesh.vertices) - place_of(point, organ)).norm(), 1e-15) << "its corners bear it";
  EXPECT_NEAR(point.direction.norm(), 1.0, 1e-12);
}

TEST(VertexContacts, AreTheCollidingVerticesAndTheirPlanes) {
  TestOrgan organ(make_octasphere(0.03, 2));
  const InstrumentSurface instrument = build_instrument_surface(make_octasphere(0.02, 3), true);
  const Pose pose = {Vector3(0.04, 0.003, 0.002), Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3::UnitY()))};
  organ.detect_in(instrument, pose);
  penetrate_exactly(instrument, organ.detection, organ.penetration);
  std::vector<ContactPoint> points;
  std::vector<int> touching;
  add_vertex_contacts(organ.surface(), instrument, 3, pose, organ.penetration, organ.detection, touching, points);
  ASSERT_GT(points.size(), 3u);
  EXPECT_EQ(touching, organ.detection.colliding);
  ASSERT_EQ(points.size(), touching.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    expect_sound(points[i], organ);
    EXPECT_EQ(points[i].piece, 3);
    const int vertex = touching[i];
    EXPECT_EQ(place_of(points[i], organ), organ.mesh.vertices[vertex]);
    const double way = points[i].target - points[i].direction.dot(organ.mesh.vertices[vertex]);
    EXPECT_NEAR(way, organ.penetration.depth[vertex], 1e-15);
    const Vector3 pushed = pose.apply_inverse(organ.mesh.vertices[vertex] + way * points[i].direction);
    EXPECT_LT(distance_to_mesh({instrument.vertices, instrument.triangles}, pushed), undecided);
  }
}

TEST(VertexContacts, WhatWasTouchingStaysWithinTheMargin) {
  TestOrgan organ(make_octasphere(0.03, 1));
  const InstrumentSurface box = build_instrument_surface(make_box(Vector3::Constant(0.01)), true);
  for (const auto& [gap, stays] :
       {std::pair<double, bool>{0.5 * contact_margin, true}, {1.5 * contact_margin, false}}) {
    const Pose pose = at(0.035 + gap, 0.0012, 0.0007);
    ASSERT_TRUE(organ.detect_in(box, pose).empty());
    std::vector<int> touching = {0};  // the vertex at x = 0.03
    std::vector<ContactPoint> points;
    add_vertex_contacts(organ.surface(), box, 0, pose, organ.penetration, organ.detection, touching, points);
    ASSERT_EQ(points.size(), stays ? 1u : 0u);
    EXPECT_EQ(touching, stays ? std::vector<int>{0} : std::vector<int>{});
    if (!stays) continue;
    EXPECT_LT((points[0].direction + Vector3::UnitX()).norm(), 1e-6);
    EXPECT_NEAR(points[0].target, -0.03 - gap, undecided);
  }
}

TEST(EdgeContacts, AShaftAcrossAnEdgeIsFeltBetweenItsEnds) {
  // One edge of a coarse tetrahedron goes through a thin cylinder, both ends far outside.
  TestOrgan organ({{{-0.02, 0, 0}, {0.02, 0, 0}, {0, 0.03, -0.01}, {0, -0.03, -0.01}},
                   {{0, 1, 2}, {1, 0, 3}, {0, 2, 3}, {1, 3, 2}}});
  ASSERT_TRUE(inspect(organ.mesh).closed_manifold());
  const TriangleMesh mesh = make_cylinder(0.001, 0.05, 16);
  const InstrumentSurface shaft = build_instrument_surface(mesh, true);
  const Pose along_y = {Vector3(0.005, 0, 0.0006),
                        Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitX()))};
  ASSERT_TRUE(organ.detect_in(shaft, along_y).empty());
  std::vector<ContactPoint> points;
  add_edge_contacts(organ.surface(), shaft, 0, along_y, organ.detection, points);
  ASSERT_EQ(points.size(), 1u);
  expect_sound(points[0], organ);
  EXPECT_LT((place_of(points[0], organ) - Vector3(0.005, 0, 0)).norm(), 1e-5);
  EXPECT_LT(points[0].direction.z(), -0.9) << "pushed down, below the shaft";
  const double depth = points[0].target - points[0].direction.dot(place_of(points[0], organ));
  // Half a margin is left.
  EXPECT_NEAR(depth + 0.5 * contact_margin, distance_to_mesh(mesh, along_y.apply_inverse(place_of(points[0], organ))),
              1e-8);
}

TEST(EdgeContacts, AnEdgeIsLeftWhereTheNextPassFindsIt) {
  TestOrgan organ({{{-0.02, 0, 0}, {0.02, 0, 0}, {0, 0.03, -0.01}, {0, -0.03, -0.01}},
                   {{0, 1, 2}, {1, 0, 3}, {0, 2, 3}, {1, 3, 2}}});
  const InstrumentSurface shaft = build_instrument_surface(make_cylinder(0.001, 0.05, 16), true);
  const Pose along_y = {Vector3(0.005, 0, 0.0006),
                        Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitX()))};
  for (int pass = 0; pass < 5; ++pass) {
    organ.detect_in(shaft, along_y);
    std::vector<ContactPoint> points;
    add_edge_contacts(organ.surface(), shaft, 0, along_y, organ.detection, points);
    ASSERT_EQ(points.size(), 1u) << "pass " << pass;
    push_out(points, std::vector<double>(4, 1.0), organ.mesh.vertices, nullptr);
    forget(organ.patches);
  }
}

TEST(EdgeContacts, OfEdgesWithAnEndInsideThereAreNone) {
  TestOrgan organ(make_octasphere(0.03, 1));
  const InstrumentSurface box = build_instrument_surface(make_box(Vector3::Constant(0.01)), true);
  ASSERT_EQ(organ.detect_in(box, at(0.031, 0, 0)).size(), 1u);
  std::vector<ContactPoint> points;
  add_edge_contacts(organ.surface(), box, 0, at(0.031, 0, 0), organ.detection, points);
  EXPECT_TRUE(points.empty());
}

TEST(BearBy, TheSolidAroundASurfaceBearsItsPoints) {
  Random random(3);
  const TriangleMesh surface = make_octasphere(0.01, 2);
  TetrahedralMesh solid = make_block(Vector3::Constant(0.022), {3, 3, 3});
  for (Vector3& v : solid.vertices) v.z() += 0.011;
  const Embedding embedding = embed(surface.vertices, solid);
  std::vector<ContactPoint> points;
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); ++t) {
    ContactPoint point;
    point.triangle = t;
    point.weights = t % 3 == 0 ? Vector3(Vector3::UnitY()) : Vector3(random_point(random).cwiseAbs());
    point.weights /= point.weights.sum();
    point.bearers.add(99, 1.0);  // of the surface, to be forgotten
    points.push_back(point);
  }
  bear_by(embedding, surface.triangles, surface.vertices, points);

  for (Vector3& v : solid.vertices) v += random_point(random, 0.001);
  int most = 0;
  for (const ContactPoint& point : points) {
    Vector3 place = Vector3::Zero();
    for (int i = 0; i < 3; ++i) {
      place +=
          point.weights[i] *
          embedded_point(embedding, static_cast<std::size_t>(surface.triangles[point.triangle][i]), solid.vertices);
    }
    EXPECT_LT((at_point(point, solid.vertices) - place).norm(), 1e-15);
    double sum = 0.0;
    for (int i = 0; i < point.bearers.count; ++i) {
      sum += point.bearers.weights[i];
      for (int j = 0; j < i; ++j) EXPECT_NE(point.bearers.vertices[i], point.bearers.vertices[j]);
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
    EXPECT_LE(point.bearers.count, point.triangle % 3 == 0 ? 4 : Bearers::most);
    most = std::max(most, point.bearers.count);
  }
  EXPECT_GT(most, 6);
}

TEST(BearBy, AShellBearsPointsThatLieAboveIt) {
  // Surface vertices first, then the shell's: as in a rest shape.
  Random random(5);
  const TriangleMesh surface = make_octasphere(0.05, 4);
  const TriangleMesh shell = make_octasphere(0.05, 2);
  std::vector<Vector3> normals = surface.vertices;
  Embedding embedding = embed(surface.vertices, normals, shell);
  const int first = static_cast<int>(surface.vertices.size());
  for (Tetrahedron& corners : embedding.corners) {
    for (int& corner : corners) corner += first;
  }
  std::vector<Vector3> positions = surface.vertices;
  for (const Vector3& v : shell.vertices) positions.push_back(v + random_point(random, 0.002));
  const auto carry = [&] {
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) positions[v] = embedded_point(embedding, v, positions);
  };
  const std::vector<double> inverse_mass(positions.size(), 1.0);
  for (int t = 0; t < static_cast<int>(surface.triangles.size()); t += 7) {
    ContactPoint point;
    point.triangle = t;
    point.weights = t % 2 == 0 ? Vector3(Vector3::UnitY()) : Vector3(random_point(random).cwiseAbs());
    point.weights /= point.weights.sum();
    const auto place = [&] {
      Vector3 sum = Vector3::Zero();
      for (int i = 0; i < 3; ++i) sum += point.weights[i] * positions[surface.triangles[t][i]];
      return sum;
    };
    carry();
    point.direction = -(place().normalized() + 0.3 * random_direction(random)).normalized();
    const double wanted = point.direction.dot(place()) + 0.001;
    // What one pass leaves is of second order, and the next finds it.
    double left = 0.001;
    for (int pass = 0; pass < 3; ++pass) {
      point.target = wanted;
      std::vector<ContactPoint> points = {point};
      bear_by(embedding, surface.triangles, positions, points);
      EXPECT_NEAR(points[0].target + points[0].lift, wanted, 1e-15);
      push_out(points, inverse_mass, positions, nullptr);
      carry();
      const double now_left = wanted - point.direction.dot(place());
      EXPECT_LT(now_left, 0.1 * left + 1e-9);
      left = std::max(now_left, 1e-9);
    }
    EXPECT_LT(left, 1e-6);
  }
}

/// A needle of 0.4 mm that points down, its tip at the frame's origin.
TriangleMesh needle() {
  TriangleMesh mesh = moved(make_cylinder(0.0002, 0.03, 8), at(0, 0, 0.0155));
  mesh.vertices[16].z() = 0.0;
  return mesh;
}

/// A roof whose two upper triangles are large: nothing of it but their faces is near (0.02, 0.01, 0).
TriangleMesh slab() {
  return moved(make_box({0.1, 0.1, 0.02}), at(0, 0, -0.01));
}

TEST(PokeContacts, ATipInTheMiddleOfABigTriangleIsFelt) {
  TestOrgan organ(slab());
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  for (const double height : {-0.004, -0.0001, 0.0, 0.5 * contact_margin, 1.5 * contact_margin}) {
    const Pose pose = at(0.02, 0.01, height);
    EXPECT_TRUE(organ.detect_in(tip, pose).empty());
    EXPECT_TRUE(organ.detection.crossings.empty());
    const std::vector<ContactPoint> points = pokes(organ, tip, pose);
    ASSERT_FALSE(points.empty()) << height;
    double lowest = 1.0;
    for (const ContactPoint& point : points) {
      expect_sound(point, organ);
      EXPECT_LT((point.direction + Vector3::UnitZ()).norm(), 1e-9);
      lowest = std::min(lowest, -point.target);
      EXPECT_LT(place_of(point, organ).head<2>().norm() - Vector3(0.02, 0.01, 0).norm(), 0.0003);
    }
    EXPECT_NEAR(lowest, height - contact_margin, 1e-12) << "just below the tip";
  }
  EXPECT_TRUE(pokes(organ, tip, at(0.02, 0.01, 1.1 * poke_reach)).empty());
  EXPECT_TRUE(pokes(organ, tip, at(0.2, 0.01, -0.004)).empty()) << "beside the organ";
}

TEST(PokeContacts, WhatRestsOnTheInstrumentIsStillFound) {
  TestOrgan organ(slab());
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  const Pose pose = at(0.02, 0.01, -0.001);
  Clearance clearance = new_clearance(tip);
  for (int pass = 0; pass < 5; ++pass) {
    const std::vector<ContactPoint> points = pokes(organ, tip, pose, clearance);
    ASSERT_FALSE(points.empty()) << "pass " << pass;
    push_out(points, std::vector<double>(organ.mesh.vertices.size(), 1.0), organ.mesh.vertices, nullptr);
    forget(organ.patches);
  }
}

TEST(PokeContacts, AFineBallOnABigTriangleMakesThreePointsAtEachOfItsCornersAtMost) {
  TestOrgan organ(slab());
  const InstrumentSurface round = build_instrument_surface(make_octasphere(0.01, 5), true);
  const Pose pose = at(0.001, 0.002, 0.0095);  // on the diagonal of the roof
  const std::vector<ContactPoint> points = pokes(organ, round, pose);
  ASSERT_FALSE(points.empty());
  std::vector<std::pair<int, int>> corners;
  for (const ContactPoint& point : points) {
    int corner = 0;
    point.weights.maxCoeff(&corner);
    corners.emplace_back(point.triangle, corner);
    EXPECT_GE(point.poking, 0);
  }
  std::sort(corners.begin(), corners.end());
  for (const auto& corner : corners) EXPECT_LE(std::count(corners.begin(), corners.end(), corner), 3);
  double lowest = 0.0;
  for (const Vector3& v : round.vertices) lowest = std::min(lowest, pose.apply(v).z());
  double target = 0.0;
  for (const ContactPoint& point : points) target = std::min(target, -point.target);
  EXPECT_NEAR(target, lowest - contact_margin, 1e-12) << "the deepest of all is one of them";
}

TEST(PokeContacts, PushedOutTheTipIsAMarginAboveTheSurface) {
  Random random(1);
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  for (int round = 0; round < 100; ++round) {
    TestOrgan organ(slab());
    const Vector3 place(random_in(random, -0.04, 0.04), random_in(random, -0.04, 0.04), -random_in(random, 0.0, 0.002));
    const Pose pose = {place, Eigen::Quaterniond::Identity()};
    const std::vector<ContactPoint> points = pokes(organ, tip, pose);
    ASSERT_FALSE(points.empty());
    push_out(points, std::vector<double>(organ.mesh.vertices.size(), 1.0), organ.mesh.vertices, nullptr);
    EXPECT_FALSE(is_inside(organ.mesh, place)) << place.transpose();
    EXPECT_GT(distance_to_mesh(organ.mesh, place), 0.5 * contact_margin);
  }
}

TEST(PokeContacts, ClearanceSkipsAndNeverMisses) {
  Random random(2);
  TestOrgan organ(make_octasphere(0.03, 2));
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  int touches = 0;
  for (int round = 0; round < 100; ++round) {
    // From outside to the surface by steps of any size, turning on the way.
    const Vector3 from = 0.05 * random_direction(random);
    const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), from);
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(random_in(random, -0.5, 0.5), random_direction(random)));
    const Pose start = {from, turned * upright};
    const Pose end = {0.026 / 0.05 * from, upright};
    Clearance clearance = new_clearance(tip);
    Pose before = start;
    for (double fraction = 0.0; fraction < 1.0; fraction += random_in(random, 0.001, 0.05)) {
      const Pose pose = interpolate(start, end, fraction);
      clearance.shift += (pose.position - before.position).norm();
      clearance.turn += pose.orientation.angularDistance(before.orientation);
      before = pose;
      const std::vector<ContactPoint> found = pokes(organ, tip, pose, clearance);
      const std::vector<ContactPoint> exhaustive = pokes(organ, tip, pose);
      ASSERT_EQ(found.empty(), exhaustive.empty());
      if (found.empty()) continue;
      ++touches;
      // The deepest push is the same: what is looked at again later only faces away.
      const auto way = [&](const ContactPoint& p) { return p.target - p.direction.dot(place_of(p, organ)); };
      const auto less = [&](const ContactPoint& a, const ContactPoint& b) { return way(a) < way(b); };
      EXPECT_EQ(way(*std::max_element(found.begin(), found.end(), less)),
                way(*std::max_element(exhaustive.begin(), exhaustive.end(), less)));
      break;
    }
  }
  EXPECT_GT(touches, 80);
}

TEST(PokeContacts, WhatIsFarIsLookedAtOnce) {
  TestOrgan organ(make_octasphere(0.03, 2));
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  Clearance clearance = new_clearance(tip);
  EXPECT_TRUE(pokes(organ, tip, at(0, 0, 0.05), clearance).empty());
  for (const double free : clearance.free_until) EXPECT_GT(free, 0.019);
  organ.mesh.vertices[0].x() = std::nan("");  // would be found by a search
  const std::vector<double> before = clearance.free_until;
  clearance.shift = 0.01;
  EXPECT_TRUE(pokes(organ, tip, at(0, 0, 0.04), clearance).empty());
  EXPECT_EQ(clearance.free_until, before);
}

TEST(PokeContacts, PositionsThatAreNoNumbersTouchNothing) {
  const WithoutTraps off;  // a NaN is compared
  TestOrgan organ(slab());
  const InstrumentSurface tip = build_instrument_surface(needle(), true);
  EXPECT_TRUE(pokes(organ, tip, at(0.02, std::nan(""), 0.0)).empty());
}

}  // namespace
}  // namespace tissue_sim::contact_point_test
