#include "tissue_sim/study/loading.h"

#include <malloc.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/step.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/measuring.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim {

namespace {

namespace fs = std::filesystem;

const Vector3 semi_axes = {0.09, 0.06, 0.04};  // m, about a liver

/// Enough for a wall of a million triangles; what a step would cost is not what is measured here.
constexpr int substeps = 10000;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What `work` returns, and how long it took.
template <class Work>
auto timed(double& seconds, Work work) {
  const auto start = std::chrono::steady_clock::now();
  auto result = work();
  seconds = seconds_since(start);
  return result;
}

/// Makes the most that was resident so far what is resident now. Linux 4.0 and later; elsewhere it stays the most since
/// the program's start.
void forget_most_resident() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

void append(const void* data, std::size_t size, std::string& bytes) {
  bytes.append(static_cast<const char*>(data), size);
}

void write_probe(const fs::path& folder) {
  write_text(
      "<robot name=\"probe\"><link name=\"tip\"><collision><geometry><sphere radius=\"0.004\"/></geometry></collision>"
      "</link></robot>\n",
      (folder / "probe.urdf").string());
}

std::string write_scene(const fs::path& folder, const std::string& mesh, Model model) {
  std::string text = "frame: world\ntime_step: 0.001\nmax_substeps: " + std::to_string(substeps) +
                     "\norgans:\n  - name: organ\n    mesh: " + mesh +
                     "\n    scale: 0.001\n    model: " + to_string(model) + "\n";
  if (model == Model::surface) {
    text += "    wall_thickness: 0.004\n    material: {young: 5400, poisson: 0.45, density: 1060}\n";
  }
  text += "instruments:\n  - name: probe\n    urdf: probe.urdf\n    tip_link: tip\n    pose_topic: PSM1/measured_cp\n";
  const std::string path = (folder / "scene.yaml").string();
  write_text(text, path);
  return path;
}

/// Everything at once, as the node does it.
void time_whole(const std::string& scene_file, LoadCost& cost) {
  forget_most_resident();
  std::vector<std::string> warnings;
  const auto start = std::chrono::steady_clock::now();
  const Scene scene = load_scene(scene_file, warnings);
  const Timeline timeline(scene);
  cost.whole = seconds_since(start);
  cost.memory = most_resident();
  cost.triangles = timeline.summary(0).triangles;
}

/// The parts one by one.
void time_parts(const std::string& scene_file, const std::string& mesh_file, LoadCost& cost) {
  std::vector<std::string> warnings;
  Scene scene = load_scene(scene_file, warnings);
  TriangleMesh mesh = timed(cost.read, [&] { return read_mesh(mesh_file, Vector3::Constant(0.001)); });
  scene.organs[0].mesh = timed(cost.mend, [&] { return mend_organ_mesh(mesh_file, std::move(mesh), warnings); });
  const TriangleMesh& mended = scene.organs[0].mesh;
  timed(cost.topology,
        [&] { return build_topology(static_cast<int>(mended.vertices.size()), mended.triangles).edges.size(); });
  const World world = timed(cost.rest_shape, [&] { return build_world(scene); });
  cost.rest_shape = std::max(0.0, cost.rest_shape - cost.topology);
  const Workspace workspace = timed(cost.tree, [&] { return build_workspace(world); });
}

}  // namespace

TriangleMesh make_ellipsoid(const Vector3& axes, int n) {
  const double golden = 0.5 * (1.0 + std::sqrt(5.0));
  const std::array<Vector3, 12> corners = {Vector3(-1, golden, 0),  Vector3(1, golden, 0),   Vector3(-1, -golden, 0),
                                           Vector3(1, -golden, 0),  Vector3(0, -1, golden),  Vector3(0, 1, golden),
                                           Vector3(0, -1, -golden), Vector3(0, 1, -golden),  Vector3(golden, 0, -1),
                                           Vector3(golden, 0, 1),   Vector3(-golden, 0, -1), Vector3(-golden, 0, 1)};
  const std::array<Triangle, 20> sides = {Triangle{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                          {1, 5, 9},          {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                          {3, 9, 4},          {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                          {4, 9, 5},          {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  TriangleMesh mesh;
  for (const Triangle& side : sides) {
    const auto at = [&](int i, int j) {  // i steps to the second corner, j to the third
      const Vector3 flat = (n - i - j) * corners[side[0]] + i * corners[side[1]] + j * corners[side[2]];
      return Vector3(axes.cwiseProduct(flat.normalized()));
    };
    const auto add = [&](const Vector3& a, const Vector3& b, const Vector3& c) {
      const int first = static_cast<int>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
      mesh.triangles.push_back({first, first + 1, first + 2});
    };
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n - j; ++i) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }
  weld(mesh, 1e-9 * axes.maxCoeff());  // rounding parts the sides
  return mesh;
}

void write_obj(const TriangleMesh& mesh, const std::string& path) {
  std::string text;
  std::array<char, 128> line{};
  for (const Vector3& p : mesh.vertices) {
    std::snprintf(line.data(), line.size(), "v %.9g %.9g %.9g\n", p.x(), p.y(), p.z());
    text += line.data();
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    std::snprintf(line.data(), line.size(), "f %d %d %d\n", a + 1, b + 1, c + 1);
    text += line.data();
  }
  write_text(text, path);
}

void write_stl(const TriangleMesh& mesh, const std::string& path) {
  std::string bytes(80, ' ');
  const std::uint32_t count = static_cast<std::uint32_t>(mesh.triangles.size());
  append(&count, sizeof count, bytes);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 normal = area_normal(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]).stableNormalized();
    for (const Vector3& v : {normal, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}) {
      const Eigen::Vector3f single = v.cast<float>();
      append(single.data(), 3 * sizeof(float), bytes);
    }
    bytes.append(2, '\0');
  }
  write_text(bytes, path);
}

std::vector<LoadCost> time_loading(int triangles) {
  const TemporaryFolder folder;
  write_probe(folder.path);
  {
    const int n = std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / 20.0))));
    const TriangleMesh mesh = make_ellipsoid(1e3 * semi_axes, n);  // mm, as most files are
    write_obj(mesh, (folder.path / "organ.obj").string());
    write_stl(mesh, (folder.path / "organ.stl").string());
  }
  std::vector<LoadCost> costs;
  for (const std::string file : {"obj", "stl"}) {
    for (const Model model : {Model::contact_only, Model::surface}) {
      LoadCost cost;
      cost.file = file;
      cost.model = model;
      const std::string scene_file = write_scene(folder.path, "organ." + file, model);
      time_whole(scene_file, cost);
      time_parts(scene_file, (folder.path / ("organ." + file)).string(), cost);
      costs.push_back(cost);
    }
  }
  return costs;
}

}  // namespace tissue_sim
