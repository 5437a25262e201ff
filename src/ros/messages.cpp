#include "tissue_sim/ros/messages.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstring>

namespace tissue_sim {
namespace {

constexpr double full_red_depth = 0.010;         // m; deeper is as red
constexpr double contact_radius = 0.0030;        // m; small beside a dent, visible beside an organ
constexpr double arrow_length_per_newton = 0.4;  // m/N; soft tissue answers a probe with about 0.1 N
constexpr double longest_arrow = 0.15;           // m; a larger force is drawn no longer

geometry_msgs::Point to_point(const Vector3& v) {
  geometry_msgs::Point point;
  point.x = v.x();
  point.y = v.y();
  point.z = v.z();
  return point;
}

geometry_msgs::Vector3 to_vector(const Vector3& v) {
  geometry_msgs::Vector3 vector;
  vector.x = v.x();
  vector.y = v.y();
  vector.z = v.z();
  return vector;
}

void append(std::vector<float>& numbers, const Vector3& v) {
  for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<float>(v[axis]));
}

std_msgs::ColorRGBA colour(float r, float g, float b, float a = 1.0F) {
  std_msgs::ColorRGBA c;
  c.r = r;
  c.g = g;
  c.b = b;
  c.a = a;
  return c;
}

/// From the blue-grey of untouched tissue to red.
std_msgs::ColorRGBA depth_colour(double depth, float bright) {
  const auto t = static_cast<float>(std::min(1.0, std::max(0.0, depth / full_red_depth)));
  return colour(bright * (0.62F + 0.33F * t), bright * (0.69F - 0.61F * t), bright * (0.78F - 0.70F * t));
}

std::uint32_t fnv1a(std::uint32_t hash, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 16777619U;
  return hash;
}

visualization_msgs::Marker marker(const std_msgs::Header& header, const std::string& name, int id, int type) {
  visualization_msgs::Marker m;
  m.header = header;
  m.ns = name;
  m.id = id;
  m.type = type;
  m.action = visualization_msgs::Marker::ADD;
  m.pose.orientation.w = 1.0;
  m.scale.x = m.scale.y = m.scale.z = 1.0;
  m.color = colour(1.0F, 1.0F, 1.0F);
  return m;
}

/// How bright each vertex is. rviz does not light triangles with colours of their own, and without shading a dent
/// cannot be seen: so the light is put into the colours.
std::vector<float> brightness(const TriangleMesh& mesh, const Span<Vector3>& positions) {
  const auto at = [&](int vertex) -> const Vector3& { return positions[static_cast<std::size_t>(vertex)]; };
  std::vector<Vector3> normals(positions.size(), Vector3::Zero());
  for (const Triangle& triangle : mesh.triangles) {
    const Vector3 normal = area_normal(at(triangle[0]), at(triangle[1]), at(triangle[2]));
    for (const int vertex : triangle) normals[static_cast<std::size_t>(vertex)] += normal;
  }
  const Vector3 light = Vector3(0.75, -0.35, 0.55).normalized();
  std::vector<float> bright(positions.size());
  for (std::size_t i = 0; i < bright.size(); ++i) {
    const double length = normals[i].norm();
    const double cosine = length > 0.0 ? normals[i].dot(light) / length : 1.0;
    bright[i] = static_cast<float>(0.62 + 0.38 * cosine);
  }
  return bright;
}

visualization_msgs::Marker organ_marker(const std_msgs::Header& header, const Organ& organ, const OrganView& view) {
  auto m = marker(header, "organ/" + organ.name, 0, visualization_msgs::Marker::TRIANGLE_LIST);
  const std::vector<float> bright = brightness(organ.mesh, view.positions);
  m.points.reserve(3 * organ.mesh.triangles.size());
  m.colors.reserve(3 * organ.mesh.triangles.size());
  for (const Triangle& triangle : organ.mesh.triangles) {
    for (const int corner : triangle) {
      const auto vertex = static_cast<std::size_t>(corner);
      m.points.push_back(to_point(view.positions[vertex]));
      m.colors.push_back(depth_colour(view.depths[vertex], bright[vertex]));
    }
  }
  return m;
}

visualization_msgs::Marker contacts_marker(const std_msgs::Header& header, const std::vector<OrganContact>& contacts) {
  auto m = marker(header, "contacts", 0, visualization_msgs::Marker::SPHERE_LIST);
  // rviz refuses a list without points.
  if (contacts.empty()) m.action = visualization_msgs::Marker::DELETE;
  m.scale.x = m.scale.y = m.scale.z = 2.0 * contact_radius;
  m.color = colour(1.0F, 0.85F, 0.1F);
  for (const OrganContact& contact : contacts) m.points.push_back(to_point(contact.point));
  return m;
}

visualization_msgs::Marker force_marker(const std_msgs::Header& header, const Instrument& instrument, const Pose& tip,
                                        const Vector3& force) {
  auto m = marker(header, "force/" + instrument.name, 0, visualization_msgs::Marker::ARROW);
  const double newtons = force.norm();
  if (!(newtons > 0.0)) {
    m.action = visualization_msgs::Marker::DELETE;
    return m;
  }
  const double length = std::min(longest_arrow, newtons * arrow_length_per_newton);
  m.points = {to_point(tip.position), to_point(tip.position + force * (length / newtons))};
  m.scale.x = 0.002;  // shaft diameter, head diameter, head length, m
  m.scale.y = 0.007;
  m.scale.z = std::min(0.012, 0.4 * length);
  m.color = colour(0.1F, 0.8F, 0.2F);
  return m;
}

visualization_msgs::Marker part_marker(const std_msgs::Header& header, const Instrument& instrument, int part,
                                       const Pose& tip) {
  auto m = marker(header, "instrument/" + instrument.name, part, visualization_msgs::Marker::TRIANGLE_LIST);
  m.color = colour(0.85F, 0.87F, 0.92F, 0.35F);
  m.pose.position = to_point(tip.position);
  m.pose.orientation.x = tip.orientation.x();
  m.pose.orientation.y = tip.orientation.y();
  m.pose.orientation.z = tip.orientation.z();
  m.pose.orientation.w = tip.orientation.w();
  const TriangleMesh& mesh = instrument.parts[static_cast<std::size_t>(part)].mesh;
  m.points.reserve(3 * mesh.triangles.size());
  for (const Triangle& triangle : mesh.triangles) {
    for (const int vertex : triangle) m.points.push_back(to_point(mesh.vertices[static_cast<std::size_t>(vertex)]));
  }
  return m;
}

}  // namespace

ros::Time to_ros_time(std::int64_t nanoseconds) {
  ros::Time time;
  return time.fromNSec(static_cast<std::uint64_t>(std::max<std::int64_t>(0, nanoseconds)));
}

Pose to_pose(const geometry_msgs::Pose& message) {
  return {{message.position.x, message.position.y, message.position.z},
          {message.orientation.w, message.orientation.x, message.orientation.y, message.orientation.z}};
}

std::string hash_text(std::uint64_t hash) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, hash);
  return text.data();
}

TissueTopology topology_message(const Scene& scene, int organ) {
  const Organ& source = scene.organs[static_cast<std::size_t>(organ)];
  TissueTopology message;
  message.header.frame_id = scene.frame;
  message.organ = source.name;
  message.triangles.reserve(3 * source.mesh.triangles.size());
  for (const Triangle& triangle : source.mesh.triangles) {
    for (const int vertex : triangle) message.triangles.push_back(static_cast<std::uint32_t>(vertex));
  }
  message.rest_positions.reserve(3 * source.mesh.vertices.size());
  for (const Vector3& vertex : source.mesh.vertices) append(message.rest_positions, vertex);

  std::uint32_t id = 2166136261U;
  id = fnv1a(id, message.triangles.data(), message.triangles.size() * sizeof(message.triangles[0]));
  id = fnv1a(id, message.rest_positions.data(), message.rest_positions.size() * sizeof(message.rest_positions[0]));
  message.topology_id = id;
  return message;
}

void fill_state(const Scene& scene, const Timeline& timeline, int organ, std::uint32_t topology_id,
                TissueState& message) {
  const OrganView view = timeline.organ(organ);
  message.header.frame_id = scene.frame;
  message.header.stamp = to_ros_time(timeline.report().stamp);
  message.organ = scene.organs[static_cast<std::size_t>(organ)].name;
  message.topology_id = topology_id;
  message.step = timeline.report().step;
  message.positions.resize(3 * view.positions.size());
  float* out = message.positions.data();
  for (const Vector3& position : view.positions) {
    for (int axis = 0; axis < 3; ++axis) *out++ = static_cast<float>(position[axis]);
  }
  message.depths.resize(view.depths.size());
  for (std::size_t i = 0; i < view.depths.size(); ++i) message.depths[i] = static_cast<float>(view.depths[i]);
}

TissueState state_message(const Scene& scene, const Timeline& timeline, int organ, std::uint32_t topology_id) {
  TissueState message;
  fill_state(scene, timeline, organ, topology_id, message);
  return message;
}

void fill_contacts(const Scene& scene, const StepReport& report, Contacts& message) {
  message.header.frame_id = scene.frame;
  message.header.stamp = to_ros_time(report.stamp);
  message.step = report.step;
  message.contacts.resize(report.contacts.size());
  for (std::size_t i = 0; i < report.contacts.size(); ++i) {
    const OrganContact& contact = report.contacts[i];
    const Instrument& instrument = scene.instruments[static_cast<std::size_t>(contact.instrument)];
    Contact& out = message.contacts[i];
    out.organ = scene.organs[static_cast<std::size_t>(contact.organ)].name;
    out.instrument = instrument.name;
    out.link = instrument.parts[static_cast<std::size_t>(contact.part)].link;
    out.triangle = static_cast<std::uint32_t>(contact.triangle);
    for (int corner = 0; corner < 3; ++corner) {
      out.barycentric[static_cast<std::size_t>(corner)] = static_cast<float>(contact.barycentric[corner]);
    }
    out.position = to_point(contact.point);
    out.direction = to_vector(contact.direction);
    out.depth = contact.depth;
    out.force = to_vector(contact.force);
  }
}

Contacts contacts_message(const Scene& scene, const StepReport& report) {
  Contacts message;
  fill_contacts(scene, report, message);
  return message;
}

geometry_msgs::WrenchStamped wrench_message(const Wrench& wrench, std::int64_t stamp, const std::string& frame,
                                            const Eigen::Quaterniond& frame_to_scene) {
  geometry_msgs::WrenchStamped message;
  message.header.frame_id = frame;
  message.header.stamp = to_ros_time(stamp);
  message.wrench.force = to_vector(frame_to_scene.conjugate() * wrench.force);
  message.wrench.torque = to_vector(frame_to_scene.conjugate() * wrench.torque);
  return message;
}

visualization_msgs::MarkerArray markers_message(const Scene& scene, const Timeline& timeline) {
  const StepReport& report = timeline.report();
  std_msgs::Header header;
  header.frame_id = scene.frame;
  header.stamp = to_ros_time(report.stamp);

  visualization_msgs::MarkerArray array;
  for (std::size_t i = 0; i < scene.organs.size(); ++i) {
    array.markers.push_back(organ_marker(header, scene.organs[i], timeline.organ(static_cast<int>(i))));
  }
  array.markers.push_back(contacts_marker(header, report.contacts));
  for (std::size_t i = 0; i < scene.instruments.size() && i < report.placed.size(); ++i) {
    if (!report.placed[i]) continue;
    const Instrument& instrument = scene.instruments[i];
    array.markers.push_back(force_marker(header, instrument, report.poses[i], report.wrenches[i].force));
    for (std::size_t part = 0; part < instrument.parts.size(); ++part) {
      array.markers.push_back(part_marker(header, instrument, static_cast<int>(part), report.poses[i]));
    }
  }
  return array;
}

void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue entry;
  entry.key = key;
  entry.value = value;
  status.values.push_back(entry);
}

void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  add_value(status, key, std::string(text.data()));
}

void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, std::uint64_t value) {
  add_value(status, key, std::to_string(value));
}

}  // namespace tissue_sim
