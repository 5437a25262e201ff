#include "tissue_sim/contact/detection.h"

#include <set>

#include "contact/plain_detection.h"
#include "contact/test_organ.h"
#include "floating_point_traps.h"
#include "tissue_sim/geometry/edge_triangle.h"

namespace tissue_sim::detection_test {
namespace {

std::vector<TriangleMesh> instruments() {
  return {make_octasphere(0.02, 2), make_box({0.02, 0.03, 0.01}), make_cylinder(0.004, 0.06, 12),
          make_torus(0.015, 0.004, 12)};
}

TEST(Detection, CrossingsEqualBruteForce) {
  Random random(1);
  TestOrgan organ(make_octasphere(0.03, 2));
  const OrganSurface surface = organ.surface();
  for (const TriangleMesh& mesh : instruments()) {
    const InstrumentSurface instrument = build_instrument_surface(mesh, true);
    int found = 0;
    for (int round = 0; round < 100; ++round) {
      const Pose pose = random_pose(random, 0.04);
      organ.detect_in(instrument, pose);
      std::set<std::pair<int, int>> crossings;
      for (const Crossing& crossing : organ.detection.crossings) {
        EXPECT_TRUE(crossings.insert({crossing.edge, crossing.triangle}).second) << "found twice";
        EXPECT_LT(distance_to_mesh(mesh, crossing.point), 1e-12);
      }
      std::set<std::pair<int, int>> expected;
      for (std::size_t e = 0; e < organ.topology.edges.size(); ++e) {
        const auto& [a, b] = organ.topology.edges[e];
        const Vector3 p = local_position(organ.detection, surface, pose, a);
        const Vector3 q = local_position(organ.detection, surface, pose, b);
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
          const auto& [i, j, k] = mesh.triangles[t];
          const EdgeTriangleHit hit =
              hit_edge_triangle(p, q, {&mesh.vertices[i], &mesh.vertices[j], &mesh.vertices[k]}, mesh.triangles[t]);
          if (hit.direction != 0) expected.insert({static_cast<int>(e), static_cast<int>(t)});
        }
      }
      EXPECT_EQ(crossings, expected);
      found += static_cast<int>(expected.size());
    }
    EXPECT_GT(found, 200);
  }
}

void expect_same(const Detection& found, const PlainDetection& plain) {
  EXPECT_EQ(found.border, plain.border);
  EXPECT_EQ(found.border_outside, plain.border_outside);
  ASSERT_EQ(found.crossed_edges.size(), plain.crossed_edges.size());
  ASSERT_EQ(found.crossings.size(), plain.crossings.size());
  for (std::size_t e = 0; e < plain.crossed_edges.size(); ++e) {
    const CrossedEdge& a = found.crossed_edges[e];
    const CrossedEdge& b = plain.crossed_edges[e];
    ASSERT_EQ(a.edge, b.edge);
    ASSERT_EQ(a.count, b.count);
    for (int i = 0; i < b.count; ++i) {
      const Crossing& x = found.crossings[a.first + i];
      const Crossing& y = plain.crossings[b.first + i];
      EXPECT_EQ(x.edge, y.edge);
      EXPECT_EQ(x.triangle, y.triangle);
      EXPECT_EQ(x.t, y.t);
      EXPECT_EQ(x.direction, y.direction);
      EXPECT_EQ(x.point, y.point);
    }
  }
}

/// What carries over from pass to pass saves time and changes nothing: an organ that is kneaded and an instrument that
/// wanders, now and then somewhere else at once, against every edge and triangle, and against a pass that knows
/// nothing.
TEST(Detection, OfARandomMotionIsToTheBitWhatEveryEdgeAndTriangleGive) {
  Random random(6);
  for (const TriangleMesh& mesh : instruments()) {
    const InstrumentSurface instrument = build_instrument_surface(mesh, true);
    TestOrgan organ(make_octasphere(0.03, 3));
    const TriangleMesh at_rest = organ.mesh;
    Pose pose = random_pose(random, 0.03);
    std::size_t found = 0;
    for (int pass = 0; pass < 150; ++pass) {
      if (pass % 40 == 39) {
        pose = random_pose(random, 0.04);
      } else {
        pose.position += random_point(random, 0.002);
        pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.05, random_direction(random))) * pose.orientation;
      }
      if (pass % 60 == 59) {
        organ.mesh = at_rest;
        forget(organ.patches);
      }
      const double way = pass % 7 == 0 ? 0.0 : 0.001;
      for (Vector3& v : organ.mesh.vertices) v += random_in(random, 0.0, way) * random_direction(random);
      organ.patches.travel += way;
      const std::vector<int> colliding = organ.detect_in(instrument, pose);

      std::vector<Vector3> local;
      for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
        local.push_back(local_position(organ.detection, organ.surface(), pose, v));
      }
      expect_same(organ.detection, detect_plainly(local, organ.topology, instrument));
      found += organ.detection.crossings.size();

      TestOrgan fresh(organ.mesh);
      EXPECT_EQ(fresh.detect_in(instrument, pose), colliding);
      penetrate_exactly(instrument, organ.detection, organ.penetration);
      penetrate_exactly(instrument, fresh.detection, fresh.penetration);
      for (const int v : colliding) {
        EXPECT_EQ(organ.penetration.depth[v], fresh.penetration.depth[v]);
        EXPECT_EQ(organ.penetration.direction[v], fresh.penetration.direction[v]);
      }
    }
    EXPECT_GT(found, 1000u);
  }
}

TEST(Detection, CrossingsOfAnEdgeStandInOrder) {
  Random random(2);
  TestOrgan organ(make_octasphere(0.03, 1));
  const InstrumentSurface thin = build_instrument_surface(make_cylinder(0.002, 0.06, 12), true);
  int crossed_twice = 0;
  for (int round = 0; round < 200; ++round) {
    organ.detect_in(thin, random_pose(random, 0.03));
    for (const CrossedEdge& crossed : organ.detection.crossed_edges) {
      for (int i = crossed.first; i < crossed.first + crossed.count; ++i) {
        EXPECT_EQ(organ.detection.crossings[i].edge, crossed.edge);
        if (i == crossed.first) continue;
        EXPECT_GE(organ.detection.crossings[i].t, organ.detection.crossings[i - 1].t);
        EXPECT_EQ(organ.detection.crossings[i].direction, -organ.detection.crossings[i - 1].direction);
        ++crossed_twice;
      }
    }
  }
  EXPECT_GT(crossed_twice, 50);
}

TEST(Detection, FloodEqualsAnInsideTest) {
  Random random(3);
  TestOrgan organ(make_octasphere(0.03, 3));
  for (const TriangleMesh& mesh : instruments()) {
    const InstrumentSurface instrument = build_instrument_surface(mesh, true);
    std::size_t inside = 0;
    for (int round = 0; round < 60; ++round) {
      const Pose pose = random_pose(random, 0.04);
      inside += organ.detect_in(instrument, pose).size();
      EXPECT_EQ(count_wrong(organ, mesh, pose), 0);
      for (const int v : organ.detection.border) EXPECT_TRUE(organ.collides(v));
      for (const int v : organ.detection.border_outside) EXPECT_FALSE(organ.collides(v));
    }
    EXPECT_GT(inside, 50u);
  }
}

TEST(Detection, OrganWhollyInsideCollidesWhole) {
  TestOrgan organ(make_octasphere(0.01, 2));
  const InstrumentSurface instrument = build_instrument_surface(make_box(Vector3::Constant(0.05)), true);
  EXPECT_EQ(organ.detect_in(instrument).size(), organ.mesh.vertices.size());
  EXPECT_TRUE(organ.detection.border.empty());
  EXPECT_TRUE(organ.detect_in(instrument, at(0.2, 0, 0)).empty());
}

TEST(Detection, EachSurfaceOfAnOrganIsFound) {
  TriangleMesh two = make_octasphere(0.01, 1);
  const TriangleMesh other = moved(two, at(0.1, 0, 0));
  const int count = static_cast<int>(two.vertices.size());
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) two.triangles.push_back({a + count, b + count, c + count});
  TestOrgan organ(two);
  const InstrumentSurface box = build_instrument_surface(make_box(Vector3::Constant(0.05)), true);
  organ.detect_in(box, at(0.1, 0, 0));
  ASSERT_EQ(static_cast<int>(organ.detection.colliding.size()), count);
  EXPECT_EQ(organ.detection.colliding.front(), count);
}

TEST(Detection, InstrumentWhollyInsideAnOrganTouchesNoVertex) {
  TestOrgan organ(make_octasphere(0.05, 2));
  const InstrumentSurface instrument = build_instrument_surface(make_octasphere(0.01, 2), true);
  EXPECT_TRUE(organ.detect_in(instrument).empty());
  EXPECT_TRUE(organ.detection.crossings.empty());
}

/// Grids that fall together: faces, edges and vertices of the one exactly in those of the other.
TEST(Detection, AlignedGridsAreDecided) {
  const TriangleMesh box = make_grid_box(Vector3::Constant(0.02), 4);  // cells of 5 mm
  const InstrumentSurface instrument = build_instrument_surface(box, true);
  TestOrgan organ(box);
  constexpr double cell = 0.005;
  const std::vector<Vector3> steps = {{0, 0, 0},     {1, 0, 0},       {0, 2, 0},   {0, 0, 4}, {1, 1, 0},
                                      {2, 0, -2},    {4, 4, 0},       {1, 1, 1},   {4, 4, 4}, {0.5, 0, 0},
                                      {0.5, 0.5, 0}, {0.5, 0.5, 0.5}, {3, -0.5, 4}};
  for (const Vector3& step : steps) {
    const Pose pose = {cell * step, Eigen::Quaterniond::Identity()};
    organ.detect_in(instrument, pose);
    EXPECT_EQ(count_wrong(organ, box, pose), 0) << step.transpose();
    const Pose quarter = {cell * step, Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitZ()))};
    organ.detect_in(instrument, quarter);
    EXPECT_EQ(count_wrong(organ, box, quarter), 0) << step.transpose() << " and a quarter turn";
  }
}

TEST(Detection, AVertexOnATriangleAnEdgeOrAVertexSpoilsNoOther) {
  const TriangleMesh box = make_grid_box(Vector3::Constant(0.02), 2);
  const InstrumentSurface instrument = build_instrument_surface(box, true);
  const TriangleMesh sphere = make_octasphere(0.008, 2);
  for (const Vector3& place : {Vector3(0.01, 0.002, 0.001), Vector3(0.01, 0.002, 0.0), Vector3(0.01, 0.01, 0.003),
                               Vector3(0.01, 0.0, 0.0), Vector3(0.01, 0.01, 0.01)}) {
    for (const int v : {0, 1, 5, 20, 40}) {
      TestOrgan organ(moved(sphere, {place - sphere.vertices[v], Eigen::Quaterniond::Identity()}));
      organ.detect_in(instrument);
      EXPECT_EQ(count_wrong(organ, box, Pose()), 0);
    }
  }
}

TEST(Detection, DegenerateTrianglesOfAnInstrumentAreNoHole) {
  // A face split at a point of its rim: one triangle of the two has no area.
  TriangleMesh box = make_box(Vector3::Constant(0.02));
  const Triangle cut = box.triangles[0];
  const int middle = static_cast<int>(box.vertices.size());
  box.vertices.push_back(0.5 * (box.vertices[cut[0]] + box.vertices[cut[1]]));
  box.triangles[0] = {cut[0], middle, cut[2]};
  box.triangles.push_back({middle, cut[1], cut[2]});
  box.triangles.push_back({cut[0], cut[1], middle});
  ASSERT_EQ(inspect(box).boundary_edges, 0);
  const InstrumentSurface instrument = build_instrument_surface(box, true);
  EXPECT_EQ(instrument.normals.back(), Vector3::Zero());
  Random random(4);
  TestOrgan organ(make_octasphere(0.012, 2));
  for (int round = 0; round < 100; ++round) {
    const Pose pose = random_pose(random, 0.015);
    organ.detect_in(instrument, pose);
    EXPECT_EQ(count_wrong(organ, box, pose), 0);
  }
}

TEST(Detection, AnOpenInstrumentCollidesAtItsSurfaceOnly) {
  TriangleMesh open = make_cylinder(0.01, 0.04, 16);
  open.triangles.resize(open.triangles.size() - 1);  // a wedge of a cap is missing
  const InstrumentSurface instrument = build_instrument_surface(open, false);
  Random random(5);
  TestOrgan organ(make_octasphere(0.02, 3));
  for (int round = 0; round < 100; ++round) {
    const Pose pose = random_pose(random, 0.025);
    for (const int v : organ.detect_in(instrument, pose)) {
      EXPECT_TRUE(instrument.bounds.grown(undecided).contains(pose.apply_inverse(organ.mesh.vertices[v])));
    }
  }
}

TEST(Detection, PositionsThatAreNoNumbersCollideWithNothing) {
  const WithoutTraps off;  // a NaN is compared
  TestOrgan organ(make_octasphere(0.02, 1));
  organ.mesh.vertices[3].y() = std::nan("");
  forget(organ.patches);
  const InstrumentSurface instrument = build_instrument_surface(make_octasphere(0.02, 2), true);
  organ.detect_in(instrument, at(0.02, 0.0, 0.0));
  for (const Crossing& crossing : organ.detection.crossings) EXPECT_TRUE(crossing.point.allFinite());
}

TEST(Detection, ThePapersMemoryKeepsWhatItHasSeenInside) {
  TestOrgan organ(make_octasphere(0.03, 3));
  const TriangleMesh mesh = make_octasphere(0.02, 2);
  const InstrumentSurface instrument = build_instrument_surface(mesh, true);
  // Slowly in: what was border once stays colliding while it goes inward, and that is the truth.
  for (double x = 0.052; x > 0.0401; x -= 0.0002) {
    organ.detect_in(instrument, at(x, 0, 0), CollidingSet::paper);
  }
  const std::vector<int> by_memory = organ.detection.colliding;
  EXPECT_EQ(count_wrong(organ, mesh, at(0.0402, 0, 0)), 0);
  EXPECT_GT(by_memory.size(), organ.detection.border.size());

  // Away at once: nobody has seen them outside, so they go on colliding.
  EXPECT_EQ(organ.detect_in(instrument, at(1.0, 0, 0), CollidingSet::paper), by_memory);

  // Back, and slowly out: each is a border vertex outside at some time, but for the last, whose edges nothing crosses
  // any more.
  std::vector<int> last;
  for (double x = 0.0402; x < 0.06; x += 0.0002) {
    organ.detect_in(instrument, at(x, 0, 0), CollidingSet::paper);
    if (organ.detection.border.empty()) break;
    last = organ.detection.colliding;
    EXPECT_EQ(count_wrong(organ, mesh, at(x, 0, 0)), 0);
  }
  EXPECT_EQ(organ.detection.colliding, last);
  EXPECT_LT(last.size(), 5u);
}

TEST(Detection, ThePapersMemoryMissesAJumpInAndTheFloodDoesNot) {
  TestOrgan organ(make_octasphere(0.03, 3));
  const TriangleMesh mesh = make_octasphere(0.02, 2);
  const InstrumentSurface instrument = build_instrument_surface(mesh, true);
  organ.detect_in(instrument, at(0.03, 0, 0), CollidingSet::paper);
  EXPECT_EQ(organ.detection.colliding, organ.detection.border);
  EXPECT_GT(count_wrong(organ, mesh, at(0.03, 0, 0)), 0);
  organ.detect_in(instrument, at(0.03, 0, 0));
  EXPECT_EQ(count_wrong(organ, mesh, at(0.03, 0, 0)), 0);
}

}  // namespace
}  // namespace tissue_sim::detection_test
