#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "tissue_sim/geometry/aabb_tree.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/simulation/timeline.h"

namespace {

using namespace tissue_sim;

constexpr const char* usage =
    "usage: tissue_sim_check SCENE\n"
    "  Loads a scene file and says what will be modelled, what is off and what it costs.\n"
    "  Answers 0; 1 with the error on one line if the scene cannot be used; 2 if the arguments are wrong.\n";

constexpr int timed_steps = 100;
constexpr double timed_press = 0.005;  // m

void row(const char* name, const std::string& value) {
  std::printf("  %-22s %s\n", name, value.c_str());
}

template <typename... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

std::string size_text(const TriangleMesh& mesh) {
  const Vector3 size = bounds_of(mesh.vertices).size();
  return text("%.4g x %.4g x %.4g m", size.x(), size.y(), size.z());
}

std::string count_or_off(int count) {
  return count > 0 ? std::to_string(count) : "off";
}

void print_organ(const Organ& organ, const OrganSummary& summary) {
  const bool stepped = organ.model != Model::contact_only;
  std::printf("organ %s\n", organ.name.c_str());
  row("model", to_string(organ.model));
  row("restoration", !stepped ? "off (no deformation)" : organ.restoration ? "on (elastic)" : "off (plastic)");
  row("colliding set", to_string(organ.colliding_set));
  row("depth", to_string(organ.depth));
  row("mesh", text("%d vertices, %d triangles, %d surface(s)", summary.vertices, summary.triangles,
                   inspect(organ.mesh).components));
  row("size", size_text(organ.mesh));
  row("volume", text("%.4g litres", 1000.0 * enclosed_volume(organ.mesh)));
  row("attached vertices", summary.attached > 0 ? std::to_string(summary.attached) : "none, the organ can drift");
  row("distance elements", count_or_off(summary.distance_elements));
  row("area elements", count_or_off(summary.area_elements));
  row("volume elements", count_or_off(summary.volume_elements));
  if (!stepped) return;
  row("material", text("young %.4g Pa, poisson %.4g, density %.4g kg/m^3, wall %.4g m", organ.material.young,
                       organ.material.poisson, organ.material.density, organ.wall_thickness));
  row("damping, drag", text("%.4g of critical, %.4g 1/s", organ.material.damping, organ.material.drag));
  row("mass", text("%.4g kg, of it %.3g kg (%.2f %%) added by the mass floor", summary.mass, summary.added_mass,
                   summary.mass > 0.0 ? 100.0 * summary.added_mass / summary.mass : 0.0));
  row("stable substep", text("%.3g s, %d substep(s) a step", summary.stable_substep, summary.substeps));
}

void print_instrument(const Instrument& instrument) {
  std::printf("instrument %s\n", instrument.name.c_str());
  row("pose", "link " + instrument.tip_link + " by topic " + instrument.pose_topic);
  for (const InstrumentPart& part : instrument.parts) {
    row(("part " + part.link).c_str(),
        text("%zu triangles, %s, ", part.mesh.triangles.size(), part.closed ? "closed" : "open or non-manifold") +
            size_text(part.mesh));
  }
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Mean wall time of a step, s, while `tip(i)` leads the first instrument; `contacts` counts the steps with any. Where
/// there are some, the mean is over them: before the touch an organ sleeps and costs nothing.
template <typename Tip>
double time_steps(const Scene& scene, Tip tip, int& contacts) {
  const std::int64_t step = std::llround(scene.time_step * 1e9);
  Timeline timeline(scene);
  std::int64_t stamp = 1'000'000'000;
  timeline.add_pose(0, {stamp, tip(0)});
  timeline.step_holding(stamp + step);
  double spent = 0.0;
  double spent_in_contact = 0.0;
  int steps = 0;
  contacts = 0;
  for (int i = 1; i <= timed_steps; ++i) {
    stamp = timeline.now() + step;
    timeline.add_pose(0, {stamp, tip(i)});
    auto start = std::chrono::steady_clock::now();
    while (timeline.step_holding(stamp)) {
      const double seconds = seconds_since(start);
      ++steps;
      spent += seconds;
      if (!timeline.report().contacts.empty()) {
        ++contacts;
        spent_in_contact += seconds;
      }
      start = std::chrono::steady_clock::now();
    }
  }
  if (contacts > 0) return spent_in_contact / contacts;
  return steps > 0 ? spent / steps : 0.0;
}

/// The vertex of an organ farthest from what is attached, and the way out of the surface there.
void free_vertex(const Organ& organ, Vector3& place, Vector3& normal) {
  Vector3 held = Vector3::Zero();
  for (const int v : organ.attached) held += organ.mesh.vertices[v] / static_cast<double>(organ.attached.size());
  int farthest = 0;
  for (std::size_t v = 0; v < organ.mesh.vertices.size(); ++v) {
    if ((organ.mesh.vertices[v] - held).norm() > (organ.mesh.vertices[farthest] - held).norm()) {
      farthest = static_cast<int>(v);
    }
  }
  place = organ.mesh.vertices[farthest];
  normal = Vector3::Zero();
  for (const Triangle& t : organ.mesh.triangles) {
    if (!std::count(t.begin(), t.end(), farthest)) continue;
    normal += area_normal(organ.mesh.vertices[t[0]], organ.mesh.vertices[t[1]], organ.mesh.vertices[t[2]]);
  }
  normal.normalize();
}

void print_cost(const Scene& scene) {
  // Body along the normal, so that the tip leads into the organ.
  Vector3 body = Vector3::Zero();
  for (const InstrumentPart& part : scene.instruments[0].parts) {
    for (const Vector3& p : part.mesh.vertices) body += p;
  }
  Vector3 place, normal;
  free_vertex(scene.organs[0], place, normal);
  const Eigen::Quaterniond orientation = Eigen::Quaterniond::FromTwoVectors(body, normal);
  double reach = 0.0;  // how far the instrument stands out before its tip
  for (const InstrumentPart& part : scene.instruments[0].parts) {
    for (const Vector3& p : part.mesh.vertices) reach = std::max(reach, -(orientation * p).dot(normal));
  }
  const auto height = [&](double above) { return Pose{place + (above + reach) * normal, orientation}; };

  int apart_contacts = 0, press_contacts = 0;
  const double far = 10.0 * (bounds_of(scene.organs[0].mesh.vertices).size().norm() + 1.0);
  const double apart = time_steps(
      scene, [&](int) { return height(far); }, apart_contacts);
  const double press = time_steps(
      scene, [&](int i) { return height(timed_press * (1.0 - 2.0 * i / timed_steps)); }, press_contacts);
  std::printf("cost on this machine, measured over %d steps of %.4g s\n", timed_steps, scene.time_step);
  const auto cost = [&](double seconds) {
    return text("%.3f ms a step, %.2f of real time", 1e3 * seconds, seconds / scene.time_step);
  };
  row("instrument away", cost(apart));
  row("instrument pressing", cost(press));
  std::printf("  (%s from %.0f mm above to %.0f mm below the free side of %s; over the %d steps with contact)\n",
              scene.instruments[0].name.c_str(), 1e3 * timed_press, 1e3 * timed_press, scene.organs[0].name.c_str(),
              press_contacts);
}

void check(const std::string& path) {
  std::vector<std::string> warnings;
  const Scene scene = load_scene(path, warnings);
  for (const std::string& warning : warnings) std::printf("warning: %s\n", warning.c_str());
  const Timeline timeline = [&] {
    try {
      return Timeline(scene);
    } catch (const SceneError& error) {
      throw SceneError(path + ": " + error.what());
    }
  }();
  std::printf("scene %s\n", path.c_str());
  row("frame", scene.frame);
  row("gravity", scene.gravity.isZero()
                     ? "off"
                     : text("%.4g %.4g %.4g m/s^2", scene.gravity.x(), scene.gravity.y(), scene.gravity.z()));
  row("time step", text("%.4g s, at most %d substeps", scene.time_step, scene.max_substeps));
  for (std::size_t o = 0; o < scene.organs.size(); ++o) {
    print_organ(scene.organs[o], timeline.summary(static_cast<int>(o)));
  }
  for (const Instrument& instrument : scene.instruments) print_instrument(instrument);
  print_cost(scene);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string argument = argc == 2 ? argv[1] : "";
  if (argument == "--help" || argument == "-h") {
    std::fputs(usage, stdout);
    return 0;
  }
  if (argument.empty() || argument[0] == '-') {
    std::fputs(usage, stderr);
    return 2;
  }
  try {
    check(argument);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
