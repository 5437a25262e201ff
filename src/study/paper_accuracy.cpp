#include "tissue_sim/study/paper_accuracy.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/contact/propagation.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

namespace {

constexpr double on_surface = 1e-9;    ///< m
constexpr double shallowest = 0.1e-3;  ///< m; the error of a depth of nothing is no fraction of it
constexpr int path_stride = 5;         ///< of the path's steps: neighbours differ by half a millimetre only

/// The undeformed organ, the instrument, and room for both.
struct Pair {
  explicit Pair(const PaperTest& test)
      : organ(build_rest_shape(paper_scene(test, Approach::contact_only).organs.front())),
        patches(build_patches(organ.positions, organ.triangles, organ.topology)),
        instrument(build_instrument_surface(make_sphere(paper_radius, test.rigid), true)),
        memory(organ.positions.size(), 0) {
    prepare(detection, surface());
    prepare(penetration, surface());
  }
  OrganSurface surface() { return {organ.positions, organ.triangles, organ.topology, organ.component_roots, patches}; }

  RestShape organ;
  SurfacePatches patches;
  InstrumentSurface instrument;
  Detection detection;
  Penetration penetration;
  std::vector<char> memory;
};

void add_error(double depth, const Vector3& direction, const ClosestFeature& exact, DepthError& error) {
  if (!(exact.depth > shallowest)) return;
  const double off = std::abs(depth - exact.depth);
  const double angle = std::atan2(direction.cross(exact.direction).norm(), direction.dot(exact.direction));
  ++error.vertices;
  error.depth_mean += off / exact.depth;
  error.depth_max = std::max(error.depth_max, off / exact.depth);
  error.depth_max_m = std::max(error.depth_max_m, off);
  error.direction_mean += angle;
  error.direction_max = std::max(error.direction_max, angle);
}

void finish(DepthError& error) {
  const double n = std::max(1, error.vertices);
  error.depth_mean /= n;
  error.direction_mean /= n;
}

std::vector<Vector3> along_x(double from, double to, double step) {
  std::vector<Vector3> centres;
  const int steps = static_cast<int>(std::abs(to - from) / step);
  for (int i = 0; i <= steps; ++i) centres.emplace_back(from + (to > from ? step : -step) * i, 0.0, 0.0);
  return centres;
}

}  // namespace

DepthAccuracy measure_depths(const PaperTest& test) {
  Pair pair(test);
  DepthAccuracy accuracy;
  const std::vector<Vector3> path = paper_path();
  for (std::size_t step = 0; step < path.size(); step += path_stride) {
    detect(pair.surface(), pair.instrument, paper_pose(path[step]), CollidingSet::flood, pair.memory, pair.detection);
    penetrate_border(pair.surface(), pair.instrument, pair.detection, pair.penetration);
    propagate(pair.surface(), pair.instrument, pair.detection, pair.penetration);
    for (const int vertex : pair.detection.colliding) {
      const ClosestFeature exact = closest_feature(pair.instrument, pair.detection.local[vertex]);
      const bool border = std::binary_search(pair.detection.border.begin(), pair.detection.border.end(), vertex);
      add_error(pair.penetration.depth[vertex], pair.penetration.direction[vertex], exact,
                border ? accuracy.border : accuracy.inner);
    }
  }
  finish(accuracy.border);
  finish(accuracy.inner);
  return accuracy;
}

std::vector<SetMotion> set_motions() {
  constexpr double near = 0.4 * paper_radius;
  constexpr double far = 2.2 * paper_radius;
  std::vector<SetMotion> motions;
  const auto in_and_out = [&](const char* name, double step) {
    SetMotion motion = {name, along_x(far, near, step)};
    const std::vector<Vector3> out = along_x(near, far, step);
    motion.centres.insert(motion.centres.end(), out.begin(), out.end());
    motions.push_back(motion);
  };
  in_and_out("0.5 mm a step", 0.0005);
  in_and_out("2 mm a step", 0.002);
  in_and_out("5 mm a step", 0.005);
  in_and_out("20 mm a step", 0.020);
  const Vector3 inside(near, 0.0, 0.0);
  const Vector3 outside(far, 0.0, 0.0);
  motions.push_back({"a jump in", {outside, inside, inside}});
  SetMotion away = {"a jump away", along_x(far, near, 0.0005)};
  away.centres.insert(away.centres.end(), {outside, outside});
  motions.push_back(away);
  return motions;
}

SetError measure_set(const PaperTest& test, CollidingSet set, const SetMotion& motion) {
  Pair pair(test);
  SetError error;
  for (const Vector3& centre : motion.centres) {
    const Pose pose = paper_pose(centre);
    detect(pair.surface(), pair.instrument, pose, set, pair.memory, pair.detection);
    const std::vector<int>& found = pair.detection.colliding;
    for (int vertex = 0; vertex < static_cast<int>(pair.organ.positions.size()); ++vertex) {
      const double depth = closest_feature(pair.instrument, pose.apply_inverse(pair.organ.positions[vertex])).depth;
      if (std::abs(depth) < on_surface) continue;
      const bool is_found = std::binary_search(found.begin(), found.end(), vertex);
      error.colliding += depth > 0.0 ? 1 : 0;
      error.falsely += is_found && depth < 0.0 ? 1 : 0;
      error.missed += !is_found && depth > 0.0 ? 1 : 0;
    }
  }
  return error;
}

}  // namespace tissue_sim
