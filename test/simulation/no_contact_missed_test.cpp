#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "simulation/test_scenes.h"
#include "tissue_sim/geometry/closest_point.h"

namespace tissue_sim::no_contact_missed_test {
namespace {

constexpr double probe_radius = 0.001;  // m
constexpr double shaft_length = 0.040;  // m
constexpr double pushed = 0.005;        // m
constexpr double allowed = 0.1e-3;      // m
constexpr double speed = 0.25e-3;       // m a step of 1 ms
constexpr unsigned seed = 20;

/// A round tip around the origin that looks along +z, and the shaft behind it.
Instrument thin_probe() {
  Instrument probe;
  probe.name = "probe";
  probe.parts.push_back({"tip", make_sphere(probe_radius, 12), true});
  TriangleMesh shaft = make_cylinder(probe_radius, shaft_length, 24);
  for (Vector3& v : shaft.vertices) v.z() -= 0.5 * shaft_length;
  probe.parts.push_back({"shaft", shaft, true});
  return probe;
}

/// Vertices, and points along every edge at most `spacing` apart. Tip frame.
std::vector<Vector3> sample(const World& world, double spacing) {
  std::vector<Vector3> samples;
  for (const InstrumentPiece& piece : world.pieces) {
    const std::vector<Vector3>& x = piece.surface.vertices;
    samples.insert(samples.end(), x.begin(), x.end());
    for (const auto& [a, b] : piece.surface.topology.edges) {
      const int parts = std::max(2, static_cast<int>(std::ceil((x[b] - x[a]).norm() / spacing)));
      for (int i = 1; i < parts; ++i) samples.push_back(x[a] + (x[b] - x[a]) * i / parts);
    }
  }
  return samples;
}

/// How deep points are below the surface of an organ, whatever its shape.
class Inside {
 public:
  Inside(const RestShape& rest, const std::vector<Vector3>& positions) : rest_(rest), x_(positions) {
    std::vector<Box> boxes(rest.triangles.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      for (const int v : rest.triangles[t]) boxes[t].add(x_[v]);
    }
    tree_.build(boxes);
  }

  /// m; 0 outside.
  double depth(const Vector3& p) const {
    if (winding_number(p) <= 0) return 0.0;
    return std::sqrt(closest_on_mesh(x_, rest_.triangles, tree_, p, 1.0).squared_distance);
  }

 private:
  /// Signed count of the triangles that the ray from p along +z goes through.
  int winding_number(const Vector3& p) const {
    Box ray;
    ray.add(p);
    ray.add({p.x(), p.y(), std::max(p.z(), tree_.bounds().upper.z())});
    int sum = 0;
    if (!ray.overlaps(tree_.bounds())) return sum;
    tree_.for_each_near(ray, [&](int t) {
      const auto& [a, b, c] = rest_.triangles[t];
      const Vector3 n = area_normal(x_[a], x_[b], x_[c]);
      if (!(n.dot(x_[a] - p) * n.z() > 0.0)) return;  // below p
      const auto left = [&](int i, int j) {
        const Vector3 e = x_[j] - x_[i];
        return e.x() * (p.y() - x_[i].y()) - e.y() * (p.x() - x_[i].x());
      };
      const double ab = left(a, b);
      const double bc = left(b, c);
      const double ca = left(c, a);
      if (ab > 0.0 && bc > 0.0 && ca > 0.0) ++sum;
      if (ab < 0.0 && bc < 0.0 && ca < 0.0) --sum;
    });
    return sum;
  }

  const RestShape& rest_;
  const std::vector<Vector3>& x_;
  AabbTree tree_;
};

double deepest(const Inside& inside, const std::vector<Vector3>& samples, const Pose& pose) {
  double depth = 0.0;
  for (const Vector3& p : samples) depth = std::max(depth, inside.depth(pose.apply(p)));
  return depth;
}

struct Place {
  Vector3 point;
  Vector3 normal;  ///< unit, out of the organ
  double turn;     ///< rad, about the normal
};

/// Evenly over the area.
std::vector<Place> random_places(const RestShape& rest, int count) {
  std::vector<double> areas;
  for (const auto& [a, b, c] : rest.triangles) {
    areas.push_back(area_normal(rest.positions[a], rest.positions[b], rest.positions[c]).norm());
  }
  std::mt19937 random(seed);
  std::discrete_distribution<std::size_t> triangle(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Place> places;
  for (int i = 0; i < count; ++i) {
    const auto& [a, b, c] = rest.triangles[triangle(random)];
    const double root = std::sqrt(unit(random));
    const double v = root * unit(random);
    const Vector3& p = rest.positions[a];
    const Vector3& q = rest.positions[b];
    const Vector3& r = rest.positions[c];
    places.push_back({(1.0 - root) * p + (root - v) * q + v * r, area_normal(p, q, r).normalized(),
                      6.283185307179586 * unit(random)});
  }
  return places;
}

enum class Way { tip_first, lying_across };

/// The probe's lowest point `depth` below the place.
Pose pose_at(const Place& place, Way way, double depth) {
  const Eigen::Quaterniond down = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), -place.normal);
  const Eigen::Quaterniond about(Eigen::AngleAxisd(place.turn, place.normal));
  Pose pose;
  pose.orientation = about * down;
  if (way == Way::lying_across) {
    pose.orientation = pose.orientation * Eigen::Quaterniond(Eigen::AngleAxisd(1.5707963267948966, Vector3::UnitX()));
  }
  const Vector3 lowest = place.point + (probe_radius - depth) * place.normal;
  const Vector3 over_place = way == Way::tip_first ? Vector3::Zero() : Vector3(0.0, 0.0, -0.5 * shaft_length);
  pose.position = lowest - pose.orientation * over_place;
  return pose;
}

/// An attached vertex is a wall that no instrument pushes down; a place is free of it when none is within two organ
/// edges of where the probe ends.
bool free_of_attachments(const RestShape& rest, const Pose& end) {
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    if (!rest.attached[v]) continue;
    const Vector3 p = end.apply_inverse(rest.positions[v]);
    const Vector3 on_axis(0.0, 0.0, std::min(0.0, std::max(-shaft_length, p.z())));
    if ((p - on_axis).norm() < 2.0 * rest.mean_edge) return false;
  }
  return true;
}

struct Outcome {
  int pushes = 0;
  int unfelt = 0;
  int recovered = 0;
  double worst = 0.0;  ///< m
  int worst_place = -1;
  int too_deep = 0;
};

Outcome push_everywhere(const Organ& organ, Way way, int places) {
  Simulation simulation(scene_of(organ, {thin_probe()}));
  const RestShape& rest = simulation.rest();
  const Inside at_rest(rest, rest.positions);
  const std::vector<Vector3> coarse = sample(simulation.world, 0.002);
  const std::vector<Vector3> fine = sample(simulation.world, 0.00025);
  Outcome outcome;
  int index = -1;
  for (const Place& place : random_places(rest, 4 * places)) {
    ++index;
    if (!free_of_attachments(rest, pose_at(place, way, pushed))) continue;
    if (outcome.pushes == places) break;
    ++outcome.pushes;
    double start = -0.0005;
    while (deepest(at_rest, coarse, pose_at(place, way, start)) > 0.0) start -= 0.001;
    simulation.start_at(pose_at(place, way, start));
    const int steps = static_cast<int>(std::ceil((pushed - start) / speed));
    bool felt = false;
    for (int i = 1; i <= steps; ++i) {
      simulation.go_to(pose_at(place, way, start + (pushed - start) * i / steps));
      felt = felt || !simulation.report.contacts.empty();
      outcome.recovered += simulation.report.recovered ? 1 : 0;
    }
    const double depth = deepest(Inside(rest, simulation.organ().positions), fine, simulation.poses[0]);
    outcome.unfelt += felt ? 0 : 1;
    outcome.too_deep += depth > allowed ? 1 : 0;
    if (depth > outcome.worst) {
      outcome.worst = depth;
      outcome.worst_place = index;
    }
  }
  return outcome;
}

/// Every place of it can be pressed.
Organ free_liver() {
  Organ organ = demo_liver();
  organ.model = Model::contact_only;
  organ.attached.clear();
  return organ;
}

void expect_none_missed(const Outcome& outcome, int places) {
  EXPECT_EQ(outcome.pushes, places);
  EXPECT_EQ(outcome.unfelt, 0);
  EXPECT_EQ(outcome.recovered, 0);
  EXPECT_EQ(outcome.too_deep, 0);
  EXPECT_LE(outcome.worst, allowed) << "m, at place " << outcome.worst_place;
  testing::Test::RecordProperty("worst_nm", static_cast<int>(1e9 * outcome.worst));
}

TEST(NoContactMissed, TipFirst) {
  expect_none_missed(push_everywhere(free_liver(), Way::tip_first, 1000), 1000);
}

TEST(NoContactMissed, LyingAcross) {
  expect_none_missed(push_everywhere(free_liver(), Way::lying_across, 1000), 1000);
}

TEST(NoContactMissed, TipFirstElastic) {
  expect_none_missed(push_everywhere(demo_liver(), Way::tip_first, 100), 100);
}

TEST(NoContactMissed, LyingAcrossElastic) {
  expect_none_missed(push_everywhere(demo_liver(), Way::lying_across, 100), 100);
}

}  // namespace
}  // namespace tissue_sim::no_contact_missed_test
