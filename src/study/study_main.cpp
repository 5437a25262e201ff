#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>
#include <fstream>
#include <tuple>

#include "tissue_sim/scene/resource_path.h"
#include "tissue_sim/study/stability_map.h"
#include "tissue_sim/study/study_cases.h"
#include "tissue_sim/study/study_report.h"

namespace {

using namespace tissue_sim;

constexpr const char* usage =
    "usage: tissue_sim_study --out DIR [--quick] [--case NAME]\n"
    "       tissue_sim_study --out DIR --stability [--quick]\n"
    "  --out DIR    gets study.json, tables.md, accuracy.yaml and plots (SVG)\n"
    "  --quick      small meshes, under a minute\n"
    "  --case NAME  only this one: sphere_into_block, probe_into_organ or demo_recording\n"
    "  --stability  small organs at the extremes instead: DIR gets stability.json, stability.md and pictures (PNG);\n"
    "               status 1 with a list of the cells that are neither stable nor refused with a cure\n";

const std::string case_names[] = {"sphere_into_block", "probe_into_organ", "demo_recording"};

struct Arguments {
  std::string out;
  std::string only;
  bool quick = false;
  bool stability = false;
};

bool read_arguments(int argc, char** argv, Arguments& arguments) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick") {
      arguments.quick = true;
    } else if (word == "--stability") {
      arguments.stability = true;
    } else if (word == "--out" && i + 1 < argc) {
      arguments.out = argv[++i];
    } else if (word == "--case" && i + 1 < argc) {
      arguments.only = argv[++i];
    } else {
      return false;
    }
  }
  bool known = arguments.only.empty();
  for (const std::string& name : case_names) known = known || name == arguments.only;
  if (arguments.stability && !arguments.only.empty()) return false;
  return known && !arguments.out.empty();
}

std::string this_program() {
  char path[PATH_MAX + 1] = {};
  return readlink("/proc/self/exe", path, PATH_MAX) > 0 ? path : "";
}

std::string machine() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(": ") + 2);
  }
  return "unknown processor";
}

/// The poses of a recording whose frame is the scene's own.
std::vector<StampedPose> read_poses(const std::string& path) {
  std::vector<StampedPose> poses;
  rosbag::Bag bag(path, rosbag::bagmode::Read);
  for (const rosbag::MessageInstance& instance : rosbag::View(bag)) {
    const auto message = instance.instantiate<geometry_msgs::PoseStamped>();
    if (!message) continue;
    const auto& [position, orientation] = std::tie(message->pose.position, message->pose.orientation);
    StampedPose pose;
    pose.stamp = static_cast<std::int64_t>(message->header.stamp.toNSec());
    pose.pose.position = {position.x, position.y, position.z};
    pose.pose.orientation = Eigen::Quaterniond(orientation.w, orientation.x, orientation.y, orientation.z).normalized();
    if (poses.empty() || pose.stamp > poses.back().stamp) poses.push_back(pose);
  }
  return poses;
}

void write(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written: check the folder and its rights");
}

void run_cases(const Arguments& arguments, const std::string& config,
               const std::function<void(const StudyRow&)>& done) {
  for (const std::string& name : case_names) {
    if (!arguments.only.empty() && name != arguments.only) continue;
    StudyCase given;
    if (name == case_names[0]) given = sphere_into_block(arguments.quick);
    if (name == case_names[1]) given = probe_into_organ(arguments.quick, config);
    if (name == case_names[2]) given = demo_recording(arguments.quick, config, read_poses(config + "/demo.bag"));
    run_study(given, stderr, done);
  }
}

bool run(const std::vector<std::string>& words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    execv(pointers[0], pointers.data());
    _exit(127);
  }
  int status = 0;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

/// By the script that stands beside this program.
void draw_plots(const std::string& script_name, const std::string& json, const std::string& out) {
  const std::string program = this_program();
  const std::string script = program.substr(0, program.rfind('/') + 1) + script_name;
  if (access(script.c_str(), R_OK) == 0 && run({"/usr/bin/python3", script, json, "--out", out})) return;
  std::fprintf(stderr, "tissue_sim_study: no plots; draw them with: scripts/%s %s --out %s\n", script_name.c_str(),
               json.c_str(), out.c_str());
}

void make_folder(const std::string& out) {
  if (mkdir(out.c_str(), 0777) == 0 || access(out.c_str(), W_OK) == 0) return;
  throw std::runtime_error(out + ": cannot be made or written: give a folder whose parent exists");
}

/// Throws where a cell is neither stable nor refused with a cure.
void study_stability(const Arguments& arguments) {
  make_folder(arguments.out);
  const std::string command =
      std::string("tissue_sim_study --out DIR --stability") + (arguments.quick ? " --quick" : "");
  const std::vector<StabilityRow> rows = map_stability(stability_cells(arguments.quick), stderr);
  const std::string json = arguments.out + "/stability.json";
  const std::string table = stability_table(rows, command);
  write(json, stability_json(rows, command));
  write(arguments.out + "/stability.md", table);
  std::fputs(table.c_str(), stdout);
  draw_plots("plot_stability.py", json, arguments.out);
  const auto neither = std::count_if(rows.begin(), rows.end(),
                                     [](const StabilityRow& row) { return row.outcome == Outcome::neither_of_these; });
  if (neither == 0) return;
  throw std::runtime_error(std::to_string(neither) + " cells are neither stable nor refused with a cure, see above");
}

void study(const Arguments& arguments) {
  make_folder(arguments.out);
  const std::string program = this_program();
  const std::string scene = resolve_path("package://tissue_sim/config/scenes/demo.yaml", program);
  const std::string config = scene.substr(0, scene.rfind("/scenes/"));
  const std::string command = std::string("tissue_sim_study --out DIR") + (arguments.quick ? " --quick" : "") +
                              (arguments.only.empty() ? "" : " --case " + arguments.only);
  const std::string json = arguments.out + "/study.json";
  std::vector<StudyRow> rows;
  run_cases(arguments, config, [&](const StudyRow& row) {  // an hour's work is not lost with its end
    rows.push_back(row);
    write(json, study_json(rows, command, machine()));
  });
  const std::string tables = study_tables(rows, command, machine());
  write(arguments.out + "/tables.md", tables);
  write(arguments.out + "/accuracy.yaml", accuracy_table(rows, command, machine()));
  std::fputs(tables.c_str(), stdout);
  draw_plots("plot_study.py", json, arguments.out);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--help") {
    std::fputs(usage, stdout);
    return 0;
  }
  Arguments arguments;
  if (!read_arguments(argc, argv, arguments)) {
    std::fputs(usage, stderr);
    return 2;
  }
  try {
    arguments.stability ? study_stability(arguments) : study(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tissue_sim_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
