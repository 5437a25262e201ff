#include "tissue_sim/study/growing_organ.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double radius = 0.03;                  // m
constexpr double edge = 0.002;                   // m
const double row = edge * std::sqrt(3.0) / 2.0;  // m, between rings of equilateral triangles
const int around = static_cast<int>(std::lround(2.0 * pi * radius / edge));  // vertices of a ring of the tube
constexpr double ball_radius = 0.005;                                        // m
constexpr double press_depth = 0.004;                                        // m
constexpr int steps_down = 100;

struct Ring {
  int first = 0;
  int count = 0;
  double turn = 0.0;  ///< of its first vertex, in turns
};

Ring add_ring(double x, double ring_radius, int count, double turn, TriangleMesh& mesh) {
  const Ring ring = {static_cast<int>(mesh.vertices.size()), count, turn};
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * pi * (turn + static_cast<double>(i) / count);
    mesh.vertices.emplace_back(x, ring_radius * std::cos(angle), ring_radius * std::sin(angle));
  }
  return ring;
}

/// Triangles between two rings, the second towards +x: goes around and always takes the vertex that comes next.
void join(const Ring& a, const Ring& b, TriangleMesh& mesh) {
  int i = 0;
  int j = 0;
  while (i < a.count || j < b.count) {
    const int at_a = a.first + i % a.count;
    const int at_b = b.first + j % b.count;
    const double next_a = a.turn + (i + 0.5) / a.count;
    const double next_b = b.turn + (j + 0.5) / b.count;
    if (j == b.count || (i < a.count && next_a <= next_b)) {
      mesh.triangles.push_back({at_a, a.first + (i + 1) % a.count, at_b});
      ++i;
    } else {
      mesh.triangles.push_back({at_a, b.first + (j + 1) % b.count, at_b});
      ++j;
    }
  }
}

}  // namespace

TriangleMesh make_tube(int triangles) {
  const int cap_rings = static_cast<int>(std::lround(0.5 * pi * radius / row));  // from the tube to the end
  const double cap_triangles = 2.0 * pi * radius * radius / (0.5 * edge * row);
  // By fours: then a ring lies at x = 0, turned alike at every size.
  const int tube_rings =
      4 * std::max(1, static_cast<int>(std::lround((triangles - 2.0 * cap_triangles) / (8.0 * around))));
  const double half = 0.5 * row * tube_rings;

  TriangleMesh mesh;
  const auto cap_ring = [&](int i, double sign) {
    const double angle = 0.5 * pi * i / cap_rings;  // 0 at the tube
    const int count = std::max(6, static_cast<int>(std::lround(around * std::cos(angle))));
    return add_ring(sign * (half + radius * std::sin(angle)), radius * std::cos(angle), count, 0.0, mesh);
  };
  const auto close = [&](const Ring& ring, double x) {
    const int end = static_cast<int>(mesh.vertices.size());
    mesh.vertices.emplace_back(x, 0.0, 0.0);
    for (int i = 0; i < ring.count; ++i) {
      const int a = ring.first + i;
      const int b = ring.first + (i + 1) % ring.count;
      x < 0.0 ? mesh.triangles.push_back({b, a, end}) : mesh.triangles.push_back({a, b, end});
    }
  };

  Ring last = cap_ring(cap_rings - 1, -1.0);
  close(last, -half - radius);
  const auto go_on = [&](const Ring& next) {
    join(last, next, mesh);
    last = next;
  };
  for (int i = cap_rings - 2; i > 0; --i) go_on(cap_ring(i, -1.0));
  for (int i = 0; i <= tube_rings; ++i)
    go_on(add_ring(row * i - half, radius, around, i % 2 == 0 ? 0.0 : 0.5 / around, mesh));
  for (int i = 1; i < cap_rings; ++i) go_on(cap_ring(i, 1.0));
  close(last, half + radius);
  return mesh;
}

Scene growing_scene(int triangles) {
  Organ organ;
  organ.name = "tube";
  organ.mesh = make_tube(triangles);
  organ.model = Model::surface;
  organ.levels_tolerance = 0.02;
  organ.wall_thickness = 0.004;
  organ.material = {10000.0, 0.45, 1060.0, 0.1, 20.0};
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    if (organ.mesh.vertices[v].z() < -0.25 * radius) organ.attached.push_back(static_cast<int>(v));
  }
  Instrument ball;
  ball.name = "ball";
  ball.parts.push_back({"ball", make_sphere(ball_radius, 24), true});
  Scene scene;
  scene.frame = "world";
  scene.time_step = 0.001;
  scene.organs.push_back(std::move(organ));
  scene.instruments.push_back(std::move(ball));
  return scene;
}

Pose press_pose(int step) {
  const double down = std::min(1.0, static_cast<double>(step) / steps_down);
  // Half a millimetre above the tube at first; turned, and off the grid, so that no lines of the two fall together.
  const double z = radius + ball_radius + 0.0005 - (press_depth + 0.0005) * down;
  return {Vector3(0.0003, 0.0004, z), Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3(1.0, 2.0, 3.0).normalized()))};
}

}  // namespace tissue_sim
