#include "tissue_sim/study/study_cases.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "tissue_sim/study/refinement.h"

namespace tissue_sim {

namespace {

constexpr std::int64_t millisecond = 1'000'000;  // ns

const Vector3 block_size(0.03, 0.03, 0.015);  // m
constexpr double ball_radius = 0.006;         // m
constexpr int ball_slices = 20;               ///< finer ones only add facets between which a vertex can rest
constexpr double clearance = 0.0002;          // m, before the first contact

StudyMesh own_surface(std::string name, TetrahedralMesh solid) {
  StudyMesh mesh;
  mesh.name = std::move(name);
  sort_vertices_for_locality(solid);
  mesh.surface = take_surface(solid);
  sort_for_locality(solid);
  mesh.solid = std::move(solid);
  return mesh;
}

StudyMesh embedded(std::string name, const TriangleMesh& surface, const TetrahedralMesh& solid) {
  return {std::move(name), surface, solid, true};
}

StudyMesh surface_only(std::string name, const TriangleMesh& surface) {
  return {std::move(name), surface, {}, false};
}

TetrahedralMesh uniform_block(int cells) {
  return make_block(block_size, {2 * cells, 2 * cells, cells});
}

/// From 0 to `end` (m), the cells of `cell` up to `fine` and then growing by a third each.
std::vector<double> growing(double end, double fine, double cell) {
  std::vector<double> widths;
  double at = 0.0;
  for (double width = cell; at < end - 1e-12; width *= at >= fine - 1e-12 ? 4.0 / 3.0 : 1.0) {
    widths.push_back(width);
    at += width;
  }
  std::vector<double> planes = {0.0};
  for (const double width : widths) planes.push_back(planes.back() + width * end / at);
  planes.back() = end;
  return planes;
}

/// Fine under the ball.
TetrahedralMesh graded_block(double cell) {
  const std::vector<double> aside = growing(0.5 * block_size.x(), ball_radius, cell);
  const std::vector<double> down = growing(block_size.z(), 0.6 * ball_radius, cell);
  std::array<std::vector<double>, 3> planes;
  for (std::size_t i = aside.size() - 1; i > 0; --i) planes[0].push_back(-aside[i]);
  planes[0].insert(planes[0].end(), aside.begin(), aside.end());
  planes[1] = planes[0];
  for (std::size_t i = down.size(); i > 0; --i) planes[2].push_back(i == 1 ? 0.0 : -down[i - 1]);
  return make_block(planes);
}

/// Every integrator, time step, depth scheme and restoration with one model.
void add_every_way(std::vector<StudyRun>& runs, int mesh, Model model) {
  StudyRun run;
  run.mesh = mesh;
  run.model = model;
  runs.push_back(run);
  if (model != Model::contact_only) {
    run.finer = 2;
    runs.push_back(run);
    run.finer = 1;
    run.integrator = Integrator::vertex_block_descent;
    for (const double time_step : {0.001, 0.002, 0.005, 0.010, 0.020}) {
      run.time_step = time_step;
      runs.push_back(run);
    }
    run.time_step = 0.001;
    run.integrator = Integrator::explicit_substeps;
    run.restoration = false;
    runs.push_back(run);
    run.restoration = true;
  }
  run.depth = DepthScheme::paper;
  runs.push_back(run);
}

void add_usual_ways(std::vector<StudyRun>& runs, int mesh, Model model, bool descend = true) {
  StudyRun run;
  run.mesh = mesh;
  run.model = model;
  runs.push_back(run);
  if (!descend || model == Model::contact_only) return;
  run.integrator = Integrator::vertex_block_descent;
  runs.push_back(run);
}

int add_mesh(StudyCase& given, StudyMesh mesh) {
  given.meshes.push_back(std::move(mesh));
  return static_cast<int>(given.meshes.size()) - 1;
}

/// The underside, as in config/scenes/demo.yaml.
bool on_underside(const Vector3& p) {
  const double top = p.x() < -0.03 ? -0.032 : p.x() < 0.03 ? -0.022 : -0.014;
  return p.z() < top;
}

double distance_to_line(const Vector3& p, const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double length = along.squaredNorm();
  const double part = length > 0.0 ? std::min(1.0, std::max(0.0, (p - a).dot(along) / length)) : 0.0;
  return (p - a - part * along).norm();
}

/// The bundled probe and liver; where the recording touches first and last.
struct Liver {
  TriangleMesh surface;
  TetrahedralMesh solid_12;
  TetrahedralMesh solid_8;
  ClosestFeature first;
  ClosestFeature last;
};

Liver load_liver(const std::string& config) {
  std::vector<std::string> warnings;
  Liver liver;
  liver.surface = load_organ_mesh(config + "/organs/liver.obj", 0.001, warnings);
  liver.solid_12 = read_tetrahedral_mesh(config + "/organs/liver_12.msh", 0.001, warnings);
  liver.solid_8 = read_tetrahedral_mesh(config + "/organs/liver_8.msh", 0.001, warnings);
  const InstrumentSurface surface = build_instrument_surface(liver.surface, true);
  liver.first = closest_feature(surface, {-0.045, -0.005, 0.05});
  liver.last = closest_feature(surface, {-0.015, -0.005, 0.05});
  return liver;
}

/// The solid of 8 mm, cut down to edges of `edge` (m) within 6 mm of the line that the recording slides along.
TetrahedralMesh refined_liver(const Liver& liver, const Vector3& end, double edge) {
  TetrahedralMesh solid = liver.solid_8;
  refine(solid, [&](const Vector3& p) {
    return edge + 0.5 * std::max(0.0, distance_to_line(p, liver.first.point, end) - 0.006);
  });
  return solid;
}

StudyCase liver_case(const std::string& config, const Liver& liver) {
  std::vector<std::string> warnings;
  StudyCase result;
  result.instrument.name = "probe";
  result.instrument.parts = load_instrument(config + "/instruments/probe.urdf", "tip", warnings);
  result.contact_radius = 0.003;
  result.material = {5400.0, 0.45, 1060.0, 0.1, 20.0};
  result.wall_thickness = 0.004;
  result.attached = on_underside;
  result.contact = liver.first.point;
  result.settling_drag = 70.0;
  return result;
}

void add_liver_runs(StudyCase& result, const Liver& liver, bool quick, const Vector3& end) {
  const int coarse = add_mesh(result, own_surface("solid 12 mm", liver.solid_12));
  result.finest = add_mesh(result, own_surface("solid 8 mm, 2.5 mm at the contact", refined_liver(liver, end, 0.0025)));
  const int wall = add_mesh(result, surface_only("surface", liver.surface));
  add_usual_ways(result.runs, coarse, Model::fem);
  add_usual_ways(result.runs, coarse, Model::volume, !quick);
  add_usual_ways(result.runs, wall, Model::surface, !quick);
  add_usual_ways(result.runs, wall, Model::contact_only);
  const int carried = add_mesh(result, embedded("surface in solid 12 mm", liver.surface, liver.solid_12));
  add_usual_ways(result.runs, carried, Model::fem, !quick);
}

}  // namespace

StudyCase probe_into_organ(bool quick, const std::string& config) {
  const Liver liver = load_liver(config);
  StudyCase result = liver_case(config, liver);
  result.name = "probe_into_organ";
  Pose pose;
  pose.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), -liver.first.direction);
  pose.position = liver.first.point + 0.0005 * liver.first.direction;
  result.path.push_back({0, pose});
  pose.position = liver.first.point - 0.010 * liver.first.direction;
  result.path.push_back({200 * millisecond, pose});
  result.transient_at = 160 * millisecond;
  result.hold = 500 * millisecond;
  add_liver_runs(result, liver, quick, liver.first.point);
  return result;
}

StudyCase demo_recording(bool quick, const std::string& config, std::vector<StampedPose> poses) {
  const Liver liver = load_liver(config);
  StudyCase result = liver_case(config, liver);
  result.name = "demo_recording";
  const std::int64_t start = poses.empty() ? 0 : poses.front().stamp;
  for (StampedPose& pose : poses) pose.stamp -= start;
  result.path = std::move(poses);
  result.transient_at = 2000 * millisecond;
  add_liver_runs(result, liver, quick, liver.last.point);
  return result;
}

StudyCase sphere_into_block(bool quick) {
  StudyCase result;
  result.name = "sphere_into_block";
  result.instrument.name = "ball";
  result.instrument.parts.push_back({"ball", make_sphere(ball_radius, ball_slices), true});
  result.contact_radius = ball_radius;
  result.material = {5400.0, 0.45, 1060.0, 0.1, 20.0};
  result.wall_thickness = 0.004;
  result.attached = [](const Vector3& p) { return p.z() < -block_size.z() + 1e-9; };
  Pose pose;  // turned and a little aside, so that no grid lines fall together
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3(1.0, 2.0, 3.0).normalized()));
  pose.position = {0.0003, 0.0002, ball_radius + clearance};
  result.path.push_back({0, pose});
  pose.position.z() = ball_radius - 0.002;
  result.path.push_back({60 * millisecond, pose});
  result.transient_at = 40 * millisecond;
  result.hold = 240 * millisecond;
  result.settling_drag = 150.0;
  result.finest_is_proven = true;

  if (quick) {
    const int small = add_mesh(result, own_surface("uniform 3.75 mm", uniform_block(4)));
    result.finest = add_mesh(result, own_surface("graded 1.5 mm", graded_block(0.0015)));
    for (const Model model : {Model::fem, Model::volume, Model::surface, Model::contact_only}) {
      add_usual_ways(result.runs, small, model);
    }
    add_usual_ways(result.runs, result.finest, Model::fem);
    return result;
  }
  result.finest = add_mesh(result, own_surface("graded 0.6 mm", graded_block(0.0006)));
  const int design = add_mesh(result, own_surface("uniform 1.5 mm", uniform_block(10)));
  for (const Model model : {Model::fem, Model::volume, Model::surface, Model::contact_only}) {
    add_every_way(result.runs, design, model);
  }
  for (const int cells : {4, 8}) {
    const int mesh =
        add_mesh(result, own_surface(cells == 4 ? "uniform 3.75 mm" : "uniform 1.9 mm", uniform_block(cells)));
    for (const Model model : {Model::fem, Model::volume, Model::surface, Model::contact_only}) {
      add_usual_ways(result.runs, mesh, model);
    }
  }
  return result;
}

}  // namespace tissue_sim
