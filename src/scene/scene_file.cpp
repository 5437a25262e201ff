#include "tissue_sim/scene/scene_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <iomanip>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/resource_path.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "yaml_mapping.h"

namespace tissue_sim {
namespace {

/// 1/s. Damping along the elements alone leaves an organ swaying for seconds; with this a dent is gone in two. Twice as
/// much lets the soft bending of coarse meshes creep instead.
constexpr double default_drag = 5.0;

/// s. Stamps are whole nanoseconds: a step of less than one never ends, and of a few ends no gap between two poses.
constexpr double shortest_time_step = 1e-6;

/// Objects of one scene whose sizes differ by more than this do not belong together: a mesh in millimetres that is
/// read as metres, for one.
constexpr double size_ratio_limit = 1000.0;

/// The wall's distance and area energies reach no smaller Poisson's ratio.
constexpr double smallest_wall_poisson = 1.0 / 3.0;

/// Distance and volume energies of a solid reach no smaller one.
constexpr double smallest_volume_poisson = 0.25;

/// The largest error of levels that was measured to be about what it says.
constexpr double largest_tolerance = 0.3;

/// Of the surface's mean edge: how far a surface may stand out of the solid that is to carry it.
constexpr double farthest_outside = 3.0;

bool above_zero(double x) {
  return x > 0.0;
}

std::string metres(double length) {
  std::ostringstream text;
  text << std::setprecision(4) << length << " m";
  return text.str();
}

/// Named frames and their poses in the scene's frame.
using Frames = std::map<std::string, Pose>;

Pose read_pose(const YamlMapping& yaml) {
  const Vector3 rpy = yaml.vector("rpy", Vector3::Zero());
  Pose pose;
  pose.position = yaml.vector("xyz", Vector3::Zero());
  pose.orientation =
      turn(rpy.z(), Vector3::UnitZ()) * turn(rpy.y(), Vector3::UnitY()) * turn(rpy.x(), Vector3::UnitX());
  return pose;
}

void check_parent(const YamlMapping& yaml, const std::string& parent, const std::set<std::string>& names) {
  if (names.count(parent) > 0) return;
  std::string allowed;
  for (const std::string& name : names) allowed += (allowed.empty() ? "" : ", ") + name;
  yaml.fail("parent", "is '" + parent + "', allowed are the frames of this scene: " + allowed);
}

/// Frames may stand in any order: those whose parent is placed are placed until none is left.
Frames read_frames(const YamlMapping& yaml, const std::string& root) {
  Frames placed{{root, Pose()}};
  std::vector<YamlMapping> waiting = yaml.list("frames", {"name", "parent", "xyz", "rpy"});
  std::set<std::string> names{root};
  for (const YamlMapping& frame : waiting) {
    const std::string name = frame.name("name");
    if (!names.insert(name).second) frame.fail("name", "is '" + name + "' like another frame, give each its own");
    read_pose(frame);
  }
  while (!waiting.empty()) {
    const auto ready = std::find_if(waiting.begin(), waiting.end(),
                                    [&](const YamlMapping& frame) { return placed.count(frame.text("parent")) > 0; });
    if (ready == waiting.end()) {
      for (const YamlMapping& frame : waiting) check_parent(frame, frame.text("parent"), names);
      waiting.front().fail("parent", "is '" + waiting.front().text("parent") +
                                         "', which leads round in a circle, a chain of parents ends at '" + root + "'");
    }
    placed[ready->name("name")] = placed.at(ready->text("parent")) * read_pose(*ready);
    waiting.erase(ready);
  }
  return placed;
}

Pose read_organ_pose(const YamlMapping& organ, const Frames& frames, const std::string& root) {
  if (!organ.has("pose")) return Pose();
  const YamlMapping yaml = organ.mapping("pose", {"parent", "xyz", "rpy"});
  const std::string parent = yaml.has("parent") ? yaml.text("parent") : root;
  std::set<std::string> names;
  for (const auto& frame : frames) names.insert(frame.first);
  check_parent(yaml, parent, names);
  return frames.at(parent) * read_pose(yaml);
}

Accuracy read_accuracy(const YamlMapping& scene) {
  Accuracy accuracy;
  if (!scene.has("accuracy")) return accuracy;
  const YamlMapping yaml = scene.mapping("accuracy", {"budget_ms", "error"});
  yaml.require_one_of({"budget_ms", "error"});
  if (yaml.has("budget_ms")) {
    accuracy.goal = Accuracy::Goal::budget;
    accuracy.value = 1e-3 * yaml.number("budget_ms", above_zero, "a number above 0, in milliseconds a step");
    accuracy.place = yaml.place("budget_ms");
  } else {
    accuracy.goal = Accuracy::Goal::error;
    accuracy.value = yaml.fraction("error");
    accuracy.place = yaml.place("error");
  }
  return accuracy;
}

Model read_model(const YamlMapping& organ) {
  if (!organ.has("model")) {
    organ.fail("model",
               "is missing, add it (contact_only, surface, volume, fem), or give the scene an "
               "accuracy: {budget_ms: 1} that chooses it");
  }
  return organ.choice<Model>("model", {{"contact_only", Model::contact_only},
                                       {"surface", Model::surface},
                                       {"volume", Model::volume},
                                       {"fem", Model::fem}});
}

/// What an organ that names no model could be, as far as its keys tell.
std::vector<Model> possible_models(const YamlMapping& organ) {
  std::vector<Model> models = {Model::contact_only};
  if (organ.has("wall_thickness")) models.push_back(Model::surface);
  if (organ.has("solid") || is_tetrahedral_mesh(organ.text("mesh"))) {
    models.push_back(Model::volume);
    models.push_back(Model::fem);
  }
  return models;
}

/// What a model's energies reach of Poisson's ratio.
struct PoissonRange {
  double least;
  const char* allowed;
};

PoissonRange poisson_range(Model model) {
  switch (model) {
    case Model::fem:
      return {0.0, "a number from 0 to below 0.5"};
    case Model::volume:
      return {smallest_volume_poisson,
              "a number from 0.25 to below 0.5: distances and volumes reach no other, fem does"};
    default:
      return {smallest_wall_poisson,
              "a number from 1/3 (write 0.3334) to below 0.5: the energies of a wall reach no other"};
  }
}

Material read_material(const YamlMapping& organ, const PoissonRange& range) {
  const YamlMapping yaml = organ.mapping("material", {"young", "poisson", "density", "damping", "drag"});
  Material material;
  material.young = yaml.number("young", above_zero, "a number above 0, in Pa (liver 5400, stomach wall 200000)");
  material.poisson = yaml.number(
      "poisson", [&](double x) { return x >= range.least && x < 0.5; }, range.allowed);
  material.density = yaml.number("density", above_zero, "a number above 0, in kg/m^3 (soft tissue 1060)");
  material.damping = yaml.number(
      "damping", [](double x) { return x >= 0.0 && x <= 1.0; }, "a number from 0 to 1", 0.1);
  material.drag = yaml.number(
      "drag", [](double x) { return x >= 0.0 && x <= 1000.0; }, "a number from 0 to 1000, in 1/s", default_drag);
  return material;
}

/// Distance of a point from the held region, 0 inside.
using DistanceFrom = std::function<double(const Vector3&)>;

DistanceFrom read_attachment(const YamlMapping& yaml) {
  yaml.require_one_of({"sphere", "box"});
  if (yaml.has("sphere")) {
    const YamlMapping sphere = yaml.mapping("sphere", {"center", "radius"});
    const Vector3 center = sphere.vector("center");
    const double radius = sphere.number("radius", above_zero, "a number above 0, in metres");
    return [=](const Vector3& p) { return std::max(0.0, (p - center).norm() - radius); };
  }
  const YamlMapping box = yaml.mapping("box", {"min", "max"});
  const Vector3 low = box.vector("min"), high = box.vector("max");
  if (!(low.array() < high.array()).all())
    box.fail("max", "is not above min in x, y and z, exchange what is turned round");
  return [=](const Vector3& p) { return (p - p.cwiseMax(low).cwiseMin(high)).norm(); };
}

/// Vertices within the attachments, ascending. `vertices` in the organ's own frame.
std::vector<int> read_attachments(const YamlMapping& organ, const std::vector<Vector3>& vertices) {
  std::set<int> attached;
  for (const YamlMapping& yaml : organ.list("attachments", {"sphere", "box"})) {
    const DistanceFrom distance_from = read_attachment(yaml);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const double distance = distance_from(vertices[v]);
      nearest = std::min(nearest, distance);
      if (distance <= 0.0) attached.insert(static_cast<int>(v));
    }
    if (nearest > 0.0) {
      yaml.fail(yaml.has("sphere") ? "sphere" : "box",
                "holds no vertex, the nearest is " + metres(nearest) +
                    " away, move or enlarge it (metres, in the organ's own frame, after its scale)");
    }
  }
  return {attached.begin(), attached.end()};
}

/// What `load` makes of the file that a key names by `reference`; the key's place stands before all that it throws and
/// warns.
template <typename Load>
auto load_from(const YamlMapping& yaml, const std::string& key, const std::string& reference,
               std::vector<std::string>& warnings, Load load) {
  std::vector<std::string> said;
  try {
    auto loaded = load(resolve_path(reference, yaml.file()), said);
    for (const std::string& warning : said) warnings.push_back(yaml.place(key) + warning);
    return loaded;
  } catch (const SceneError& error) {
    yaml.fail(key, error.what());
  }
}

/// The command that makes the solid that is missing, for the message that misses it.
std::string make_solid_command(const TriangleMesh& mesh, const std::string& surface, double scale) {
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  const double edge = 1e3 * mean_edge_length(mesh.vertices, topology.edges);
  const std::string out = surface.substr(0, surface.rfind('.')) + ".msh";
  std::ostringstream command;
  command << "scripts/make_solid " << surface << " " << out << " --edge " << std::setprecision(2) << edge;
  if (scale != 0.001) command << " --scale " << std::setprecision(6) << scale;
  return command.str();
}

/// Tetrahedra for an organ.
struct Solid {
  TetrahedralMesh mesh;
  std::string file;       ///< as the scene file names it
  bool embedded = false;  ///< see Organ::embedded
};

/// What the files of an organ hold.
struct Shape {
  TriangleMesh surface;
  std::vector<Solid> solids;
  std::string path;  ///< of the file of the surface
};

/// Refuses a solid that does not hold the surface which it is to carry.
void check_carried(const YamlMapping& yaml, const Shape& shape, const Solid& solid, double scale) {
  const TriangleMesh& mesh = shape.surface;
  const double outside = embed(mesh.vertices, solid.mesh).farthest_outside;
  const MeshTopology topology = build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles);
  const double allowed = farthest_outside * mean_edge_length(mesh.vertices, topology.edges);
  if (outside <= allowed) return;
  yaml.fail("solid", "leaves vertices of the mesh " + metres(outside) + " outside, allowed are " + metres(allowed) +
                         ": is '" + solid.file + "' made from this mesh? " +
                         make_solid_command(mesh, shape.path, scale));
}

/// The surface, and the solids: the one whose surface it is, or those that `solids` names, which carry it.
Shape read_shape(const YamlMapping& yaml, double scale, const std::vector<std::string>& solids,
                 std::vector<std::string>& warnings) {
  using Warnings = std::vector<std::string>;
  Shape shape;
  const std::string mesh = yaml.text("mesh");
  shape.surface = load_from(yaml, "mesh", mesh, warnings, [&](const std::string& path, Warnings& said) {
    shape.path = path;
    if (!is_tetrahedral_mesh(path)) return load_organ_mesh(path, scale, said);
    Solid solid = {read_tetrahedral_mesh(path, scale, said), mesh, false};
    sort_vertices_for_locality(solid.mesh);
    TriangleMesh surface = take_surface(solid.mesh);
    sort_for_locality(solid.mesh);
    shape.solids.push_back(std::move(solid));
    return surface;
  });
  if (!solids.empty() && !shape.solids.empty()) {
    yaml.fail("solid", "stands beside a mesh that is a solid itself, delete one of them");
  }
  for (const std::string& file : solids) {
    Solid solid = {{}, file, true};
    solid.mesh = load_from(yaml, "solid", file, warnings, [&](const std::string& path, Warnings& said) {
      TetrahedralMesh read = read_tetrahedral_mesh(path, scale, said);
      sort_vertices_for_locality(read);
      sort_for_locality(read);
      return read;
    });
    check_carried(yaml, shape, solid, scale);
    shape.solids.push_back(std::move(solid));
  }
  return shape;
}

/// The solid that a model which the scene file names works on.
std::vector<std::string> named_solids(const YamlMapping& yaml, Model model) {
  if (!yaml.has("solid")) return {};
  if (!is_solid(model)) yaml.fail("solid", "is used by the models volume and fem only, delete it");
  if (yaml.is_list("solid")) {
    yaml.fail("solid", std::string("is a list, from which the scene's accuracy would choose, but model is ") +
                           to_string(model) + ": name one file, or delete model");
  }
  return {yaml.text("solid")};
}

std::optional<double> read_levels(const YamlMapping& organ) {
  if (!organ.has("levels")) return std::nullopt;
  const YamlMapping yaml = organ.mapping("levels", {"tolerance"});
  const double tolerance = yaml.fraction("tolerance");
  if (tolerance > largest_tolerance) {
    yaml.fail("tolerance",
              "is '" + yaml.text("tolerance") + "', allowed is at most 30%: beyond it nothing was measured");
  }
  return tolerance;
}

/// Why a solid has no levels, and the cure; empty: it can have them.
std::string why_no_levels(const Organ& organ) {
  if (organ.integrator == Integrator::vertex_block_descent) {
    return "are moved explicitly, and integrator is vertex_block_descent: delete one of the two";
  }
  if (!organ.restoration) {
    return "put what sleeps back where the elastic organ has it, and restoration is false: delete one of the two";
  }
  if (organ.embedded) {
    return "are of a solid that is touched itself, and this one carries a mesh: delete levels, or name the solid as "
           "the mesh";
  }
  return "";
}

/// What all models of an organ share.
Organ read_common(const YamlMapping& yaml) {
  Organ organ;
  organ.name = yaml.name("name");
  organ.restoration = yaml.flag("restoration", true);
  organ.colliding_set = yaml.choice<CollidingSet>(
      "colliding_set", {{"flood", CollidingSet::flood}, {"paper", CollidingSet::paper}}, CollidingSet::flood);
  organ.depth = yaml.choice<DepthScheme>("depth", {{"exact", DepthScheme::exact}, {"paper", DepthScheme::paper}},
                                         DepthScheme::exact);
  organ.integrator = yaml.choice<Integrator>("integrator",
                                             {{"auto", Integrator::automatic},
                                              {"explicit", Integrator::explicit_substeps},
                                              {"vertex_block_descent", Integrator::vertex_block_descent}},
                                             Integrator::automatic);
  organ.levels_tolerance = read_levels(yaml);
  return organ;
}

double read_scale(const YamlMapping& yaml) {
  return yaml.number("scale", above_zero, "a number above 0: file units to metres, 0.001 for millimetres");
}

double read_wall(const YamlMapping& yaml) {
  return yaml.number("wall_thickness", above_zero, "a number above 0, in metres");
}

/// An organ that names its model; its mesh still in its own frame and nothing attached.
Alternative read_named(const YamlMapping& yaml, std::vector<std::string>& warnings) {
  Alternative read = {read_common(yaml), ""};
  Organ& organ = read.organ;
  organ.model = read_model(yaml);
  if (organ.model == Model::surface) {
    organ.wall_thickness = read_wall(yaml);
  } else if (yaml.has("wall_thickness")) {
    yaml.fail("wall_thickness", "is used by the model surface only, delete it");
  }
  if (organ.levels_tolerance && organ.model == Model::contact_only) {
    yaml.fail("levels", "simulates less of an organ, and contact_only simulates none of it: delete it");
  }
  if (organ.levels_tolerance && organ.model == Model::volume) {
    yaml.fail("levels",
              "is used by the models surface and fem only: delete it, or take fem, which is more accurate too");
  }
  if (organ.model != Model::contact_only || yaml.has("material")) {
    organ.material = read_material(yaml, poisson_range(organ.model));
  }
  const double scale = read_scale(yaml);
  Shape shape = read_shape(yaml, scale, named_solids(yaml, organ.model), warnings);
  organ.mesh = std::move(shape.surface);
  if (!is_solid(organ.model)) return read;
  if (shape.solids.empty()) {
    yaml.fail("mesh", std::string("is a surface, and model ") + to_string(organ.model) +
                          " needs a solid: name the file that this command makes: " +
                          make_solid_command(organ.mesh, shape.path, scale));
  }
  organ.solid = std::move(shape.solids[0].mesh);
  organ.embedded = shape.solids[0].embedded;
  const std::string why = organ.levels_tolerance && organ.model == Model::fem ? why_no_levels(organ) : "";
  if (!why.empty()) yaml.fail("levels", why);
  read.solid = shape.solids[0].file;
  return read;
}

/// The ways to model an organ that names no model: contact_only, surface if it has a wall, and volume and fem on each
/// of its solids; of these what its Poisson's ratio allows.
std::vector<Alternative> read_alternatives(const YamlMapping& yaml, std::vector<std::string>& warnings) {
  const Organ common = read_common(yaml);
  const std::vector<Model> models = possible_models(yaml);
  const bool wall = yaml.has("wall_thickness");
  const double thickness = wall ? read_wall(yaml) : 0.0;
  Material material;
  if (models.size() > 1 || yaml.has("material")) material = read_material(yaml, poisson_range(models.back()));
  const double scale = read_scale(yaml);
  const Shape shape =
      read_shape(yaml, scale, yaml.has("solid") ? yaml.texts("solid") : std::vector<std::string>(), warnings);

  std::vector<Alternative> alternatives;
  for (const Model model : models) {
    if (model != Model::contact_only && material.poisson < poisson_range(model).least) {
      warnings.push_back(yaml.place("model") + "accuracy does without " + to_string(model) + ", whose poisson is " +
                         poisson_range(model).allowed);
      continue;
    }
    Organ organ = common;
    organ.model = model;
    organ.mesh = shape.surface;
    organ.material = material;
    if (model == Model::surface) organ.wall_thickness = thickness;
    if (!is_solid(model)) alternatives.push_back({organ, ""});
    for (const Solid& solid : shape.solids) {
      if (!is_solid(model)) break;
      organ.solid = solid.mesh;
      organ.embedded = solid.embedded;
      organ.levels_tolerance = common.levels_tolerance;
      const std::string why = organ.levels_tolerance && model == Model::fem ? why_no_levels(organ) : "";
      if (!why.empty()) {
        organ.levels_tolerance.reset();
        warnings.push_back(yaml.place("levels") + "accuracy tries fem on " + solid.file + " without levels: they " +
                           why);
      }
      alternatives.push_back({organ, solid.file});
    }
  }
  return alternatives;
}

/// Attaches an organ and carries it into the scene's frame.
void place_organ(const YamlMapping& yaml, const Pose& pose, Organ& organ) {
  organ.attached = read_attachments(yaml, organ.solid.empty() ? organ.mesh.vertices : organ.solid.vertices);
  const double volume = enclosed_volume(organ.mesh);
  for (Vector3& p : organ.mesh.vertices) p = pose.apply(p);
  for (Vector3& p : organ.solid.vertices) p = pose.apply(p);
  if (!(std::abs(enclosed_volume(organ.mesh) - volume) <= 1e-6 * volume)) {
    yaml.fail("pose", "moves the organ so far that rounding changes its shape, is xyz in metres?");
  }
}

Instrument read_instrument(const YamlMapping& yaml, std::vector<std::string>& warnings) {
  Instrument instrument;
  instrument.name = yaml.name("name");
  instrument.tip_link = yaml.text("tip_link");
  instrument.pose_topic = yaml.text("pose_topic");
  const std::string& topic = instrument.pose_topic;
  const auto part = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '/'; };
  if (!(std::isalpha(static_cast<unsigned char>(topic[0])) || topic[0] == '/' || topic[0] == '~') ||
      !std::all_of(topic.begin() + 1, topic.end(), part) || topic.find("//") != std::string::npos ||
      topic.back() == '/' || topic == "~") {
    yaml.fail("pose_topic", "is '" + topic + "', allowed is the name of a ROS topic such as PSM1/measured_cp");
  }
  const auto load = [&](const std::string& path, std::vector<std::string>& said) {
    return load_instrument(path, instrument.tip_link, said);
  };
  instrument.parts = load_from(yaml, "urdf", yaml.text("urdf"), warnings, load);
  return instrument;
}

double size_of(const std::vector<const TriangleMesh*>& meshes) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const TriangleMesh* mesh : meshes) {
    for (const Vector3& p : mesh->vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  return (high - low).norm();
}

/// An organ far larger or smaller than an instrument, or than the organ before it, has the wrong scale.
void check_sizes(const Scene& scene, const std::vector<YamlMapping>& organs) {
  struct Sized {
    std::string name;
    double size;
  };
  std::vector<Sized> others;
  for (const Instrument& instrument : scene.instruments) {
    std::vector<const TriangleMesh*> meshes;
    for (const InstrumentPart& part : instrument.parts) meshes.push_back(&part.mesh);
    others.push_back({"instrument " + instrument.name, size_of(meshes)});
  }
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    const double size = size_of({&scene.organs[o].mesh});
    for (const Sized& other : others) {
      if (std::max(size / other.size, other.size / size) <= size_ratio_limit) continue;
      organs[o].fail("scale", "makes this organ " + metres(size) + " in size, but " + other.name + " is " +
                                  std::to_string(other.size) +
                                  " m: more than 1000 times apart, 0.001 is the scale of a mesh in millimetres");
    }
    others.push_back({"organ " + scene.organs[o].name, size});
  }
}

}  // namespace

Scene load_scene(const std::string& path, std::vector<std::string>& warnings) {
  const YamlMapping yaml(
      path, {"frame", "gravity", "time_step", "max_substeps", "accuracy", "frames", "organs", "instruments"});
  Scene scene;
  scene.frame = yaml.name("frame");
  scene.gravity = yaml.vector("gravity", Vector3::Zero());
  scene.time_step = yaml.number(
      "time_step", [](double x) { return x >= shortest_time_step && x <= 0.1; },
      "a number from 1e-6 to 0.1, in seconds");
  scene.max_substeps = yaml.whole_number("max_substeps", 1, 10000, scene.max_substeps);
  scene.accuracy = read_accuracy(yaml);
  const Frames frames = read_frames(yaml, scene.frame);

  const std::vector<YamlMapping> organs =
      yaml.list("organs", {"name", "mesh", "solid", "scale", "pose", "model", "restoration", "wall_thickness",
                           "material", "attachments", "colliding_set", "depth", "integrator", "levels"});
  const std::vector<YamlMapping> instruments = yaml.list("instruments", {"name", "urdf", "tip_link", "pose_topic"});
  if (organs.empty()) yaml.fail("organs", "is missing or empty, a scene has at least one organ");
  if (instruments.empty()) yaml.fail("instruments", "is missing or empty, a scene has at least one instrument");

  std::set<std::string> names;
  for (const std::vector<YamlMapping>* objects : {&organs, &instruments}) {
    for (const YamlMapping& object : *objects) {
      const std::string name = object.name("name");
      if (!names.insert(name).second) object.fail("name", "is '" + name + "' like another object, give each its own");
    }
  }
  const bool dial = scene.accuracy.goal != Accuracy::Goal::none;
  for (const YamlMapping& organ : organs) {
    const bool open = dial && !organ.has("model");
    scene.alternatives.push_back(open ? read_alternatives(organ, warnings) : std::vector<Alternative>());
    scene.organs.push_back(open ? scene.alternatives.back().front().organ : read_named(organ, warnings).organ);
  }
  for (const YamlMapping& instrument : instruments) scene.instruments.push_back(read_instrument(instrument, warnings));
  check_sizes(scene, organs);
  for (std::size_t o = 0; o < organs.size(); ++o) {
    const Pose pose = read_organ_pose(organs[o], frames, scene.frame);
    place_organ(organs[o], pose, scene.organs[o]);
    for (Alternative& alternative : scene.alternatives[o]) place_organ(organs[o], pose, alternative.organ);
  }
  if (dial && std::all_of(organs.begin(), organs.end(), [](const YamlMapping& organ) { return organ.has("model"); })) {
    warnings.push_back(yaml.place("accuracy") + "chooses nothing, every organ names its model");
  }
  return scene;
}

}  // namespace tissue_sim
