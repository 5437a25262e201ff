#include "tissue_sim/scene/instrument_file.h"

#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "one_line.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/resource_path.h"
#include "xml_tags.h"

namespace tissue_sim {
namespace {

/// Gathers what urdfdom has to say while it lives, instead of letting it go to the console.
class ParserMessages : public console_bridge::OutputHandler {
 public:
  ParserMessages() { console_bridge::useOutputHandler(this); }
  ~ParserMessages() override { console_bridge::useOutputHandler(previous_); }
  ParserMessages(const ParserMessages&) = delete;
  ParserMessages& operator=(const ParserMessages&) = delete;

  void log(const std::string& message, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) text += (text.empty() ? "" : "; ") + message;
  }

  std::string text;

 private:
  console_bridge::OutputHandler* previous_ = console_bridge::getOutputHandler();
};

/// Where the tags of an XML text stop matching: "12: <link> is never closed". Empty if they all match.
/// urdfdom's own message for this has no line.
std::string unbalanced_tag(const std::string& text) {
  XmlTags tags(text);
  XmlTag tag;
  while (tags.next(tag)) {
  }
  return tags.fault();
}

Pose to_pose(const urdf::Pose& pose) {
  return {{pose.position.x, pose.position.y, pose.position.z},
          Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z).normalized()};
}

/// Poses of all links in the root's frame, every joint at zero. urdfdom lets several joints lead to one link: round in
/// a circle, or by ways that double at every link.
std::map<std::string, Pose> place_links(const std::string& path, const urdf::ModelInterface& model) {
  std::map<std::string, Pose> poses{{model.getRoot()->name, Pose()}};
  std::vector<urdf::LinkConstSharedPtr> waiting{model.getRoot()};
  while (!waiting.empty()) {
    const urdf::LinkConstSharedPtr link = waiting.back();
    waiting.pop_back();
    for (const auto& child : link->child_links) {
      const Pose pose = poses.at(link->name) * to_pose(child->parent_joint->parent_to_joint_origin_transform);
      if (!poses.emplace(child->name, pose).second) {
        throw SceneError(path + ": several joints lead to link '" + child->name +
                         "', a link is the child of one joint");
      }
      waiting.push_back(child);
    }
  }
  return poses;
}

struct LinkShape {
  urdf::GeometrySharedPtr geometry;
  Pose origin;
};

std::vector<LinkShape> shapes_of(const urdf::Link& link, bool& fell_back) {
  std::vector<LinkShape> shapes;
  for (const auto& c : link.collision_array) {
    if (c && c->geometry) shapes.push_back({c->geometry, to_pose(c->origin)});
  }
  fell_back = shapes.empty();
  if (!fell_back) return shapes;
  for (const auto& v : link.visual_array) {
    if (v && v->geometry) shapes.push_back({v->geometry, to_pose(v->origin)});
  }
  return shapes;
}

bool all_positive(std::initializer_list<double> sizes, const std::string& where) {
  bool positive = true;
  for (const double size : sizes) {
    if (!(size >= 0.0) || !std::isfinite(size)) {
      throw SceneError(where + "a size is " + std::to_string(size) + ", allowed are numbers above 0, in metres");
    }
    positive = positive && size > 0.0;
  }
  return positive;
}

/// The surface of a geometry in its own frame; no triangles for a primitive of zero size.
InstrumentMesh tessellate(const urdf::Geometry& geometry, const std::string& urdf_path, const std::string& where,
                          std::vector<std::string>& warnings) {
  switch (geometry.type) {
    case urdf::Geometry::SPHERE: {
      const auto& sphere = static_cast<const urdf::Sphere&>(geometry);
      if (!all_positive({sphere.radius}, where)) return {};
      return {make_sphere(sphere.radius, sphere_slices), true};
    }
    case urdf::Geometry::BOX: {
      const auto& box = static_cast<const urdf::Box&>(geometry).dim;
      if (!all_positive({box.x, box.y, box.z}, where)) return {};
      return {make_box({box.x, box.y, box.z}), true};
    }
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      if (!all_positive({cylinder.radius, cylinder.length}, where)) return {};
      return {make_cylinder(cylinder.radius, cylinder.length, cylinder_segments), true};
    }
    case urdf::Geometry::MESH: {
      const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
      return load_instrument_mesh(resolve_path(mesh.filename, urdf_path), {mesh.scale.x, mesh.scale.y, mesh.scale.z},
                                  warnings);
    }
  }
  return {};
}

urdf::ModelInterfaceSharedPtr parse(const std::string& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file && text.empty()) throw SceneError(path + ": cannot be read, check that it is a file you may read");
  const std::string unbalanced = unbalanced_tag(text);
  if (!unbalanced.empty()) throw SceneError(path + ":" + one_line(unbalanced) + ", mend the XML");
  ParserMessages messages;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    messages.text += (messages.text.empty() ? "" : "; ") + std::string(error.what());
  }
  // urdfdom goes on without what it cannot read: the tip could be missing.
  if (!model || !model->getRoot() || !messages.text.empty()) {
    throw SceneError(path +
                     ": is not a URDF: " + (messages.text.empty() ? "it has no <robot>" : one_line(messages.text)));
  }
  return model;
}

}  // namespace

std::vector<InstrumentPart> load_instrument(const std::string& path, const std::string& tip_link,
                                            std::vector<std::string>& warnings) {
  const urdf::ModelInterfaceSharedPtr model = parse(path);
  const std::map<std::string, Pose> poses = place_links(path, *model);
  const auto tip = poses.find(tip_link);
  if (tip == poses.end()) {
    std::string names;
    for (const auto& link : poses) names += (names.empty() ? "" : ", ") + one_line(link.first);
    throw SceneError(path + ": there is no link '" + tip_link + "' to be the tip_link, there are: " + names);
  }
  std::vector<InstrumentPart> parts;
  for (const auto& [name, pose] : poses) {
    const std::string where = path + ": link '" + one_line(name) + "': ";
    bool fell_back = false;
    const std::vector<LinkShape> shapes = shapes_of(*model->getLink(name), fell_back);
    if (fell_back && !shapes.empty()) warnings.push_back(where + "has no <collision>, its <visual> is used");
    for (const LinkShape& shape : shapes) {
      std::vector<std::string> mended;
      InstrumentMesh piece;
      try {
        piece = tessellate(*shape.geometry, path, where, mended);
      } catch (const SceneError& error) {
        throw SceneError(one_line(shape.geometry->type == urdf::Geometry::MESH ? where + error.what() : error.what()));
      }
      for (const std::string& warning : mended) warnings.push_back(one_line(where + warning));
      if (piece.mesh.triangles.empty()) {
        warnings.push_back(where + "a primitive of zero size is skipped");
        continue;
      }
      for (Vector3& p : piece.mesh.vertices) p = tip->second.apply_inverse(pose.apply(shape.origin.apply(p)));
      for (const Vector3& p : piece.mesh.vertices) {
        if (!p.allFinite()) throw SceneError(where + "its origin is not finite, check xyz and rpy up to the tip link");
      }
      parts.push_back({name, std::move(piece.mesh), piece.closed});
    }
  }
  if (parts.empty()) {
    throw SceneError(path +
                     ": no link has a geometry of any size, give one a <collision> (mesh, box, cylinder, sphere)");
  }
  return parts;
}

}  // namespace tissue_sim
