#include "tissue_sim/study/study_cases.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "tissue_sim/study/json_rows.h"
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
  liver.solid_8 = liver.solid_12;
  refine(liver.solid_8, [](const Vector3&) { return 0.012; });  // the longest edge; the mean is 8 mm
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

void add_coarse_liver(StudyCase& result, const Liver& liver, bool quick) {
  const int wall = add_mesh(result, surface_only("surface 4 mm", liver.surface));
  const int solid_12 = add_mesh(result, own_surface("solid 12 mm", liver.solid_12));
  const int in_12 = add_mesh(result, embedded("surface 4 mm in solid 12 mm", liver.surface, liver.solid_12));
  add_usual_ways(result.runs, wall, Model::contact_only);
  add_usual_ways(result.runs, wall, Model::surface, !quick);
  for (const Model model : {Model::volume, Model::fem}) {
    if (quick && model == Model::volume) continue;
    add_usual_ways(result.runs, solid_12, model);
    add_usual_ways(result.runs, in_12, model, !quick);
  }
}

void add_fine_liver(StudyCase& result, const Liver& liver, const Vector3& end) {
  const int solid_8 = add_mesh(result, own_surface("solid 8 mm", liver.solid_8));
  const int in_8 = add_mesh(result, embedded("surface 4 mm in solid 8 mm", liver.surface, liver.solid_8));
  const int refined =
      add_mesh(result, own_surface("solid 8 mm, 2.5 mm at the contact", refined_liver(liver, end, 0.0025)));
  for (const Model model : {Model::volume, Model::fem}) {
    add_usual_ways(result.runs, solid_8, model);
    add_usual_ways(result.runs, in_8, model);
    add_usual_ways(result.runs, refined, model);
  }
}

/// Larger surfaces cost detection and embedding only.
void add_large_surfaces(StudyCase& result, const Liver& liver) {
  const TriangleMesh surface_2 = subdivide(liver.surface);
  const TriangleMesh surface_1 = subdivide(surface_2);
  const int wall = add_mesh(result, surface_only("surface 2 mm", surface_2));
  add_usual_ways(result.runs, wall, Model::surface);
  for (const TriangleMesh* surface : {&surface_2, &surface_1}) {
    const std::string size = surface == &surface_2 ? "surface 2 mm" : "surface 1 mm";
    add_usual_ways(result.runs, add_mesh(result, surface_only(size, *surface)), Model::contact_only);
    add_usual_ways(result.runs, add_mesh(result, embedded(size + " in solid 8 mm", *surface, liver.solid_8)),
                   Model::fem);
  }
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
  add_coarse_liver(result, liver, quick);
  const double edge = quick ? 0.004 : 0.0012;
  result.reference.mesh = add_mesh(result, own_surface(text("solid 8 mm, %g mm at the contact", 1e3 * edge),
                                                       refined_liver(liver, liver.first.point, edge)));
  // Explicit integration does not bear what the probe makes of elements as small as these.
  result.reference.integrator = Integrator::vertex_block_descent;
  if (quick) return result;
  add_fine_liver(result, liver, liver.first.point);
  add_large_surfaces(result, liver);
  add_usual_ways(result.runs, result.reference.mesh, Model::fem);
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
  add_coarse_liver(result, liver, quick);
  if (quick) {
    const auto end = std::find_if(result.path.begin(), result.path.end(),
                                  [](const StampedPose& pose) { return pose.stamp > 3000 * millisecond; });
    result.path.erase(end, result.path.end());
    result.reference.mesh =
        add_mesh(result, own_surface("solid 8 mm, 4 mm at the contact", refined_liver(liver, liver.last.point, 0.004)));
  } else {
    add_fine_liver(result, liver, liver.last.point);
    result.reference.mesh = static_cast<int>(result.meshes.size()) - 1;
  }
  result.reference.finer = 2;
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
  result.hold = 500 * millisecond;
  result.settling_drag = 150.0;
  result.reference_is_proven = true;

  const auto models = {Model::contact_only, Model::surface, Model::volume, Model::fem};
  if (quick) {
    const int coarse = add_mesh(result, own_surface("uniform 3.75 mm", uniform_block(4)));
    result.reference.mesh = add_mesh(result, own_surface("graded 1.25 mm", graded_block(0.00125)));
    for (const Model model : models) add_usual_ways(result.runs, coarse, model);
    StudyRun descent = result.reference;
    descent.integrator = Integrator::vertex_block_descent;
    result.runs.push_back(descent);
    return result;
  }
  result.reference.mesh = add_mesh(result, own_surface("graded 0.6 mm", graded_block(0.0006)));
  const int design = add_mesh(result, own_surface("uniform 1.5 mm", uniform_block(10)));
  for (const Model model : {Model::fem, Model::volume}) add_every_way(result.runs, design, model);
  for (const auto& [name, solid] :
       {std::make_pair("uniform 3.75 mm", uniform_block(4)), std::make_pair("uniform 1.9 mm", uniform_block(8)),
        std::make_pair("graded 1.5 mm", graded_block(0.0015)), std::make_pair("graded 1 mm", graded_block(0.001))}) {
    const int mesh = add_mesh(result, own_surface(name, solid));
    for (const Model model : models) add_usual_ways(result.runs, mesh, model);
  }

  // A fine surface in coarser solids.
  const TriangleMesh surface_1 = own_surface("", uniform_block(14)).surface;
  const TriangleMesh surface_half = subdivide(surface_1);
  const TriangleMesh surface_quarter = subdivide(surface_half);
  for (const auto& [name, surface, solid] :
       {std::make_tuple("surface 1.1 mm in 3.75 mm", &surface_1, uniform_block(4)),
        std::make_tuple("surface 1.1 mm in 1.9 mm", &surface_1, uniform_block(8)),
        std::make_tuple("surface 0.5 mm in 1.9 mm", &surface_half, uniform_block(8)),
        std::make_tuple("surface 0.5 mm in 1.5 mm", &surface_half, uniform_block(10)),
        std::make_tuple("surface 0.27 mm in 1.5 mm", &surface_quarter, uniform_block(10))}) {
    add_usual_ways(result.runs, add_mesh(result, embedded(name, *surface, solid)), Model::fem);
  }
  const int large = add_mesh(result, surface_only("surface 0.27 mm", surface_quarter));
  add_usual_ways(result.runs, large, Model::contact_only);
  for (const Model model : {Model::contact_only, Model::surface}) add_every_way(result.runs, design, model);
  const int fine = add_mesh(result, own_surface("uniform 0.94 mm", uniform_block(16)));
  for (const Model model : models) add_usual_ways(result.runs, fine, model);
  for (const Model model : {Model::volume, Model::fem}) add_usual_ways(result.runs, result.reference.mesh, model);
  return result;
}

}  // namespace tissue_sim
