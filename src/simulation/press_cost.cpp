#include "tissue_sim/simulation/press_cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {

/// m/s. As a hand moves an instrument; the demonstration's recording has 0.045 at most.
constexpr double timed_speed = 0.05;

/// Of the depth: from here on steps count, and this far to either side the instrument slides once it is in.
constexpr double timed_part = 0.5;

constexpr int least_timed_steps = 5;
constexpr int most_timed_steps = 4000;

constexpr std::int64_t first_stamp = 1'000'000'000;  // ns

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Where an instrument presses: a vertex of an organ, and the way out of the surface there.
struct FreePlace {
  Vector3 point;
  Vector3 normal;
};

/// The vertex farthest from what is attached.
FreePlace find_free_place(const Organ& organ) {
  const std::vector<Vector3>& bearers = organ.solid.empty() ? organ.mesh.vertices : organ.solid.vertices;
  Vector3 held = Vector3::Zero();
  for (const int v : organ.attached) held += bearers[v] / static_cast<double>(organ.attached.size());
  const std::vector<Vector3>& vertices = organ.mesh.vertices;
  int farthest = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if ((vertices[v] - held).norm() > (vertices[farthest] - held).norm()) farthest = static_cast<int>(v);
  }
  FreePlace place = {vertices[farthest], Vector3::Zero()};
  for (const Triangle& t : organ.mesh.triangles) {
    if (std::count(t.begin(), t.end(), farthest))
      place.normal += area_normal(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  }
  place.normal.normalize();
  return place;
}

/// How an instrument presses into an organ.
struct Press {
  FreePlace place;
  Vector3 along;  ///< unit, in the surface
  Eigen::Quaterniond orientation;
  double reach = 0.0;  ///< m, how far the instrument stands out before its tip

  Pose at(double above, double aside) const {
    return {place.point + (above + reach) * place.normal + aside * along, orientation};
  }
};

/// The body along the normal, so that the tip leads into the organ.
Press plan_press(const Scene& scene, int organ) {
  Vector3 body = Vector3::Zero();
  for (const InstrumentPart& part : scene.instruments[0].parts) {
    for (const Vector3& p : part.mesh.vertices) body += p;
  }
  Press press;
  press.place = find_free_place(scene.organs[organ]);
  press.along = press.place.normal.unitOrthogonal();
  press.orientation = Eigen::Quaterniond::FromTwoVectors(body, press.place.normal);
  for (const InstrumentPart& part : scene.instruments[0].parts) {
    for (const Vector3& p : part.mesh.vertices) {
      press.reach = std::max(press.reach, -(press.orientation * p).dot(press.place.normal));
    }
  }
  return press;
}

}  // namespace

PressCost time_press(const Scene& scene, int organ, double seconds, Timeline& timeline) {
  const Press press = plan_press(scene, organ);
  const double depth = std::min(timed_press, 0.25 * bounds_of(scene.organs[organ].mesh.vertices).size().minCoeff());
  const std::int64_t step = std::llround(scene.time_step * 1e9);
  const double way_a_step = timed_speed * scene.time_step;
  const auto start = std::chrono::steady_clock::now();
  PressCost cost;
  std::vector<double> spent;
  std::vector<double> all;
  double above = 0.1 * depth;
  double slid = 0.0;  // s, since it is in
  for (int i = 0; i < most_timed_steps; ++i) {
    const double so_far = seconds_since(start);
    if (so_far > seconds && static_cast<int>(spent.size()) >= least_timed_steps) break;
    if (above > -depth) {
      above -= way_a_step;
    } else {
      slid += scene.time_step;
    }
    const double aside = timed_part * depth * sine(timed_speed / (timed_part * depth) * slid);
    // Where a step takes long, those on the way in have to do.
    const bool counts = above <= -timed_part * depth || so_far > 0.5 * seconds;
    timeline.add_pose(0, {first_stamp + i * step, press.at(above, aside)});
    for (;;) {
      const auto before = std::chrono::steady_clock::now();
      if (!timeline.step()) break;
      all.push_back(seconds_since(before));
      if (!counts || timeline.report().contacts.empty()) continue;
      spent.push_back(all.back());
      add(timeline.report().profile, 1.0, cost.profile);
    }
  }
  cost.steps = static_cast<int>(spent.size());
  cost.step = median(spent.empty() ? all : spent);
  StepProfile sum;
  std::swap(sum, cost.profile);
  if (cost.steps > 0) add(sum, 1.0 / cost.steps, cost.profile);
  return cost;
}

double time_apart(const Scene& scene, double seconds, Timeline& timeline) {
  const Press press = plan_press(scene, 0);
  Box all;
  for (const Organ& organ : scene.organs) {
    for (const Vector3& p : organ.mesh.vertices) all.add(p);
  }
  const double far = 10.0 * (all.size().norm() + 1.0);
  const std::int64_t step = std::llround(scene.time_step * 1e9);
  const auto start = std::chrono::steady_clock::now();
  std::vector<double> spent;
  for (int i = 0; i < most_timed_steps; ++i) {
    if (seconds_since(start) > seconds && i >= least_timed_steps) break;
    timeline.add_pose(0, {first_stamp + i * step, press.at(far, 0.0)});
    const auto before = std::chrono::steady_clock::now();
    while (timeline.step()) spent.push_back(seconds_since(before));
  }
  return median(spent);
}

}  // namespace tissue_sim
