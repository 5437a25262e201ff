#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "tissue_sim/ros/node.h"
#include "tissue_sim/simulation/threads.h"

namespace tissue_sim {
namespace {

using Value = XmlRpc::XmlRpcValue;

const std::array<const char*, 7> known_parameters{"scene",          "advance",    "state_period", "time_jump_threshold",
                                                  "keep_all_poses", "tf_timeout", "threads"};

/// Letters to insert, remove or change to make one word of the other.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

[[noreturn]] void refuse(const std::string& name, const std::string& what) {
  throw std::runtime_error("parameter ~" + name + ": " + what);
}

void refuse_unknown(Value& all) {
  if (all.getType() != Value::TypeStruct) return;
  for (auto& entry : all) {
    const std::string& name = entry.first;
    if (std::find(known_parameters.begin(), known_parameters.end(), name) != known_parameters.end()) continue;
    const std::string nearest = *std::min_element(
        known_parameters.begin(), known_parameters.end(),
        [&](const char* a, const char* b) { return edit_distance(name, a) < edit_distance(name, b); });
    refuse(name, "there is no such parameter; did you mean ~" + nearest + "?");
  }
}

std::string read_string(Value& all, const std::string& name, const std::string& otherwise) {
  if (!all.hasMember(name)) return otherwise;
  if (all[name].getType() != Value::TypeString) refuse(name, "expected a string");
  return static_cast<std::string>(all[name]);
}

bool read_bool(Value& all, const std::string& name, bool otherwise) {
  if (!all.hasMember(name)) return otherwise;
  if (all[name].getType() != Value::TypeBoolean) refuse(name, "expected true or false");
  return static_cast<bool>(all[name]);
}

double read_seconds(Value& all, const std::string& name, double otherwise, double least, double most) {
  if (!all.hasMember(name)) return otherwise;
  Value& value = all[name];
  double seconds = std::nan("");
  if (value.getType() == Value::TypeInt) seconds = static_cast<int>(value);
  if (value.getType() == Value::TypeDouble) seconds = static_cast<double>(value);
  // Written so that NaN is out of range.
  if (!(seconds >= least && seconds <= most)) {
    std::ostringstream what;
    what << "expected a number of seconds from " << least << " to " << most;
    refuse(name, what.str());
  }
  return seconds;
}

int read_threads(Value& all, int otherwise) {
  if (!all.hasMember("threads")) return otherwise;
  const bool whole = all["threads"].getType() == Value::TypeInt;
  const int threads = whole ? static_cast<int>(all["threads"]) : 0;
  if (threads < 1 || threads > most_threads) {
    refuse("threads", "expected a whole number from 1 to " + std::to_string(most_threads));
  }
  return threads;
}

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

}  // namespace

NodeParameters read_parameters() {
  Value all;
  all["scene"] = std::string();  // makes it a struct even where nothing is set
  Value given;
  if (ros::param::get(ros::this_node::getName(), given)) all = given;
  refuse_unknown(all);

  NodeParameters parameters;
  parameters.scene = read_string(all, "scene", "");
  if (parameters.scene.empty()) refuse("scene", "missing; set it to the path of a scene file");
  const std::string advance = read_string(all, "advance", "on_pose");
  if (advance != "on_pose" && advance != "realtime") {
    refuse("advance", "\"" + advance + "\" is not known; expected on_pose or realtime");
  }
  parameters.realtime = advance == "realtime";
  parameters.keep_all_poses = read_bool(all, "keep_all_poses", false);
  if (parameters.realtime && parameters.keep_all_poses) {
    refuse("keep_all_poses", "a replay does not run with advance: realtime; set advance to on_pose");
  }
  parameters.tf_timeout = read_seconds(all, "tf_timeout", parameters.tf_timeout, 0.0, 10.0);
  parameters.timeline.state_period = nanoseconds(read_seconds(all, "state_period", 0.016, 1e-4, 60.0));
  parameters.timeline.time_jump_threshold = nanoseconds(read_seconds(all, "time_jump_threshold", 0.5, 1e-3, 3600.0));
  parameters.timeline.threads = read_threads(all, parameters.timeline.threads);
  parameters.timeline.newest_only = !parameters.keep_all_poses;
  return parameters;
}

}  // namespace tissue_sim
