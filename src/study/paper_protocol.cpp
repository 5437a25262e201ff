#include "tissue_sim/study/paper_protocol.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

namespace {

constexpr double time_step = 0.001;  // s
constexpr double attached_area = 0.1;

std::vector<int> farthest_tenth(const TriangleMesh& mesh, const Vector3& from) {
  std::vector<double> area(mesh.vertices.size(), 0.0);
  double total = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const double third = area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]).norm() / 6.0;
    for (const int v : {a, b, c}) area[v] += third;
    total += 3.0 * third;
  }
  std::vector<int> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const double to_a = (mesh.vertices[a] - from).squaredNorm();
    const double to_b = (mesh.vertices[b] - from).squaredNorm();
    return to_a > to_b || (to_a == to_b && a < b);
  });
  std::vector<int> attached;
  double covered = 0.0;
  for (const int vertex : order) {
    if (covered >= attached_area * total) break;
    covered += area[vertex];
    attached.push_back(vertex);
  }
  std::sort(attached.begin(), attached.end());
  return attached;
}

/// Frequency grows with the root of Young's modulus, so the stable substep of any modulus gives that of all.
void soften_to_one_substep(Organ& organ) {
  if (organ.model != Model::surface) return;
  const double ratio = build_rest_shape(organ).stable_substep / time_step;
  organ.material.young *= 0.98 * ratio * ratio;
}

}  // namespace

const std::array<PaperTest, 9> paper_tests = {{
    {16, 16, {0.02219318, 0.02886455, 0.03093863}},
    {16, 32, {0.02643189, 0.04148911, 0.04729691}},
    {16, 64, {0.042459626, 0.10129949, 0.11541373}},
    {32, 16, {0.025458446, 0.03340169, 0.03589672}},
    {32, 32, {0.030800238, 0.05244825, 0.05515859}},
    {32, 64, {0.047078356, 0.12458907, 0.13218986}},
    {64, 16, {0.037333984, 0.05318061, 0.0537442}},
    {64, 32, {0.04425557, 0.07724302, 0.08916327}},
    {64, 64, {0.064828948, 0.1787737, 0.18106284}},
}};

const char* to_string(Approach approach) {
  switch (approach) {
    case Approach::contact_only:
      return "contact_only";
    case Approach::without_restoration:
      return "without_restoration";
    case Approach::with_restoration:
      return "with_restoration";
  }
  return "";
}

std::vector<Vector3> paper_path() {
  constexpr double near = 0.4 * paper_radius;
  constexpr double far = 2.2 * paper_radius;
  constexpr double high = 1.131 * paper_radius;
  std::vector<Vector3> path;
  for (int i = 0; i <= 200; ++i) path.emplace_back(far + (near - far) * i / 200.0, 0.0, 0.0);
  for (int i = 1; i <= 100; ++i) path.emplace_back(near, 0.0, high * i / 100.0);
  for (int i = 1; i <= 200; ++i) path.emplace_back(near, 0.0, high - 2.0 * high * i / 200.0);
  for (int i = 1; i <= 100; ++i) path.emplace_back(near, 0.0, -high + high * i / 100.0);
  return path;
}

Pose paper_pose(const Vector3& centre) {
  return {centre, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vector3(1.0, 2.0, 3.0).normalized()))};
}

Scene paper_scene(const PaperTest& test, Approach approach) {
  Scene scene;
  scene.frame = "world";
  scene.time_step = time_step;
  Organ organ;
  organ.name = "sphere";
  organ.mesh = make_sphere(paper_radius, test.deformable);
  organ.model = approach == Approach::contact_only ? Model::contact_only : Model::surface;
  organ.restoration = approach != Approach::without_restoration;
  organ.depth = DepthScheme::paper;
  organ.material = {1000.0, 0.45, 1060.0, 0.1, 10.0};
  organ.wall_thickness = 0.001;
  organ.attached = farthest_tenth(organ.mesh, paper_path().front());
  soften_to_one_substep(organ);
  scene.organs.push_back(organ);
  Instrument instrument;
  instrument.name = "rigid_sphere";
  instrument.parts.push_back({"sphere", make_sphere(paper_radius, test.rigid), true});
  scene.instruments.push_back(instrument);
  return scene;
}

StepProfile divided(const StepProfile& sum, int steps) {
  StepProfile mean;
  add(sum, 1.0 / std::max(1, steps), mean);
  return mean;
}

PaperResult run_paper_test(const PaperTest& test, Approach approach) {
  Timeline timeline(paper_scene(test, approach));
  PaperResult result;
  StepProfile sum;
  std::int64_t stamp = 1'000'000'000;
  for (const Vector3& centre : paper_path()) {
    timeline.add_pose(0, {stamp, paper_pose(centre)});
    stamp += 1'000'000;
    while (timeline.step()) {
      const StepReport& report = timeline.report();
      result.substeps = std::max(result.substeps, report.substeps);
      if (report.contacts.empty()) continue;
      ++result.steps_with_contact;
      result.contacts += static_cast<std::int64_t>(report.contacts.size());
      add(report.profile, 1.0, sum);
    }
  }
  result.mean = divided(sum, result.steps_with_contact);
  result.recoveries = static_cast<int>(timeline.counters().recoveries);
  result.hash = timeline.hash();
  return result;
}

}  // namespace tissue_sim
