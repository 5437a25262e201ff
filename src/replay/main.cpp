#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "tissue_sim/geometry/instruction_set.h"
#include "tissue_sim/replay/replay.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/simulation/accuracy.h"
#include "tissue_sim/simulation/threads.h"

namespace {

using tissue_sim::InstructionSet;
using tissue_sim::ModelChoice;
using tissue_sim::PoseVerdict;
using tissue_sim::ReplayOrgan;
using tissue_sim::ReplaySummary;

constexpr const char* usage =
    "usage: tissue_sim_replay SCENE IN.bag OUT.bag [--json FILE] [--state-period S] [--hold S] [--threads N]\n"
    "                         [--hashes FILE] [--instructions baseline|avx2|avx512]\n"
    "  SCENE             scene file; its pose topics are read from IN.bag\n"
    "  OUT.bag           gets topology, state, contacts and measured_cf under /tissue_sim\n"
    "  --json FILE       write the summary, with a row for each pose\n"
    "  --state-period S  simulated seconds between two states (0.016)\n"
    "  --hold S          step on for S seconds after the last pose (0)\n"
    "  --threads N       for the elements of large organs; the result is the same bits for any number (1)\n"
    "  --hashes FILE     write a line a step: its number, its stamp in ns, a hash of all states up to it\n"
    "  --instructions S  compute in these registers, not in the widest there are; the result is the same bits\n";

struct Arguments {
  std::string scene, json;
  tissue_sim::ReplayOptions options;
};

/// False where the usage has to be shown.
bool read_seconds(const char* text, double least, double& seconds) {
  char* end = nullptr;
  seconds = std::strtod(text, &end);
  return end != text && *end == '\0' && seconds >= least && seconds <= 1e6;
}

bool read_threads(const std::string& text, int& threads) {
  if (text.empty() || text.size() > 2 || text.find_first_not_of("0123456789") != std::string::npos) return false;
  threads = std::stoi(text);
  return threads >= 1 && threads <= tissue_sim::most_threads;
}

/// Taken at once: it holds for the whole program.
bool read_instructions(const std::string& text) {
  for (const auto set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (text != name(set)) continue;
    tissue_sim::use_instruction_set(set);
    return true;
  }
  return false;
}

bool read_arguments(int argc, char** argv, Arguments& arguments) {
  std::vector<std::string> files;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--", 0) != 0) {
      files.push_back(word);
      continue;
    }
    if (++i == argc) return false;
    double seconds = 0.0;
    if (word == "--json") {
      arguments.json = argv[i];
    } else if (word == "--state-period" && read_seconds(argv[i], 1e-4, seconds)) {
      arguments.options.timeline.state_period = std::llround(seconds * 1e9);
    } else if (word == "--hold" && read_seconds(argv[i], 0.0, seconds)) {
      arguments.options.hold = seconds;
    } else if (word == "--hashes") {
      arguments.options.hashes = argv[i];
    } else if (word == "--instructions") {
      if (!read_instructions(argv[i])) return false;
    } else if (word == "--threads") {
      if (!read_threads(argv[i], arguments.options.timeline.threads)) return false;
    } else {
      return false;
    }
  }
  if (files.size() != 3) return false;
  arguments.scene = files[0];
  arguments.options.input = files[1];
  arguments.options.output = files[2];
  return true;
}

std::uint64_t count(const ReplaySummary& summary, PoseVerdict verdict) {
  return summary.counters.poses[static_cast<std::size_t>(verdict)];
}

void print(const ReplaySummary& s, const std::vector<ModelChoice>& choices) {
  for (const ModelChoice& choice : choices) {
    std::printf("chosen             %s\n", tissue_sim::to_text(choice).c_str());
    for (const std::string& rejected : choice.rejected) std::printf("  not              %s\n", rejected.c_str());
  }
  for (const ReplayOrgan& organ : s.organs) {
    std::printf("organ %-12s %s, %s: %s; %.3g kg of %.3g kg added by the mass floor\n", organ.name.c_str(),
                to_string(organ.model), to_string(organ.summary.integrator), organ.summary.integrator_reason.c_str(),
                organ.summary.added_mass, organ.summary.mass);
  }
  std::printf("steps              %llu in %.3f simulated seconds\n", static_cast<unsigned long long>(s.steps),
              s.sim_seconds);
  std::printf("poses              %llu used, %llu dropped", static_cast<unsigned long long>(s.poses_used),
              static_cast<unsigned long long>(s.poses_dropped()));
  for (const PoseVerdict verdict : tissue_sim::dropped_verdicts) {
    if (count(s, verdict) > 0) {
      std::printf("; %s %llu", to_string(verdict), static_cast<unsigned long long>(count(s, verdict)));
    }
  }
  if (s.poses_missing_transform > 0) {
    std::printf("; missing transform %llu", static_cast<unsigned long long>(s.poses_missing_transform));
  }
  std::printf("\ncontact            in %llu steps, at most %llu points\n",
              static_cast<unsigned long long>(s.contact_steps), static_cast<unsigned long long>(s.contacts_max));
  std::printf("largest depth      %.3f mm\n", s.depth_max * 1e3);
  std::printf("largest force      %.4f N\n", s.force_max);
  std::printf("non-finite values  %llu\n", static_cast<unsigned long long>(s.non_finite));
  std::printf("recoveries         %llu\n", static_cast<unsigned long long>(s.counters.recoveries));
  std::printf("ms per step        %.3f median, %.3f at the 99th percentile, %.3f median in contact\n",
              s.ms_per_step_p50, s.ms_per_step_p99, s.ms_per_contact_step_p50);
  std::printf("real-time factor   %.2f\n", s.real_time_factor);
  std::printf("hash               %s\n", tissue_sim::hash_text(s.hash).c_str());
}

// JSON has no infinity and no NaN.
std::string number(double value) {
  if (!std::isfinite(value)) return "null";
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

// A stamp since 1970 needs all digits that a double has.
std::string stamp(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9f", value);
  return text;
}

// In quotes, as JSON has them.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + "\"";
}

void write_organs(const ReplaySummary& s, const std::vector<ModelChoice>& choices, std::ostream& out) {
  out << "  \"organs\": [";
  const char* separator = "\n";
  for (const ReplayOrgan& organ : s.organs) {
    out << separator << "    {\"organ\": " << quoted(organ.name) << ", \"model\": \"" << to_string(organ.model)
        << "\", \"integrator\": \"" << to_string(organ.summary.integrator)
        << "\", \"integrator_reason\": " << quoted(organ.summary.integrator_reason)
        << ", \"tetrahedra\": " << organ.summary.tetrahedra << ", \"mass_kg\": " << number(organ.summary.mass)
        << ", \"added_mass_kg\": " << number(organ.summary.added_mass) << "}";
    separator = ",\n";
  }
  out << "\n  ],\n  \"choices\": [";
  separator = "\n";
  for (const ModelChoice& choice : choices) {
    out << separator << "    {\"organ\": " << quoted(choice.organ) << ", \"model\": \"" << to_string(choice.model)
        << "\", \"solid\": " << quoted(choice.solid) << ", \"integrator\": \"" << to_string(choice.integrator)
        << "\", \"expected_error\": " << number(choice.expected_error)
        << ", \"measured_ms\": " << number(1e3 * choice.measured) << ", \"why\": " << quoted(choice.why)
        << ", \"rejected\": [";
    for (std::size_t i = 0; i < choice.rejected.size(); ++i) out << (i > 0 ? ", " : "") << quoted(choice.rejected[i]);
    out << "]}";
    separator = ",\n";
  }
  out << (choices.empty() ? "],\n" : "\n  ],\n");
}

void write_json(const ReplaySummary& s, const std::vector<ModelChoice>& choices, const std::string& path) {
  std::ofstream out(path);
  out << "{\n"
      << "  \"steps\": " << s.steps << ",\n"
      << "  \"sim_seconds\": " << number(s.sim_seconds) << ",\n"
      << "  \"poses_used\": " << s.poses_used << ",\n"
      << "  \"poses_dropped\": " << s.poses_dropped() << ",\n"
      << "  \"dropped_zero_stamp\": " << count(s, PoseVerdict::zero_stamp) << ",\n"
      << "  \"dropped_late_stamp\": " << count(s, PoseVerdict::late_stamp) << ",\n"
      << "  \"dropped_non_finite\": " << count(s, PoseVerdict::non_finite) << ",\n"
      << "  \"dropped_too_far\": " << count(s, PoseVerdict::too_far) << ",\n"
      << "  \"dropped_zero_quaternion\": " << count(s, PoseVerdict::zero_quaternion) << ",\n"
      << "  \"dropped_stale\": " << count(s, PoseVerdict::stale) << ",\n"
      << "  \"dropped_missing_transform\": " << s.poses_missing_transform << ",\n"
      << "  \"new_runs\": " << count(s, PoseVerdict::new_run) << ",\n"
      << "  \"contact_steps\": " << s.contact_steps << ",\n"
      << "  \"contacts_max\": " << s.contacts_max << ",\n"
      << "  \"depth_max_m\": " << number(s.depth_max) << ",\n"
      << "  \"force_max_n\": " << number(s.force_max) << ",\n"
      << "  \"non_finite\": " << s.non_finite << ",\n"
      << "  \"recoveries\": " << s.counters.recoveries << ",\n"
      << "  \"ms_per_step_p50\": " << number(s.ms_per_step_p50) << ",\n"
      << "  \"ms_per_step_p99\": " << number(s.ms_per_step_p99) << ",\n"
      << "  \"ms_per_contact_step_p50\": " << number(s.ms_per_contact_step_p50) << ",\n"
      << "  \"real_time_factor\": " << number(s.real_time_factor) << ",\n"
      << "  \"hash\": \"" << tissue_sim::hash_text(s.hash) << "\",\n";
  write_organs(s, choices, out);
  out << "  \"rows\": [";
  const char* separator = "\n";
  for (const tissue_sim::ReplayRow& row : s.rows) {
    out << separator << "    {\"t\": " << stamp(row.t) << ", \"depth_m\": " << number(row.depth)
        << ", \"force_n\": " << number(row.force) << ", \"contacts\": " << row.contacts << "}";
    separator = ",\n";
  }
  out << "\n  ]\n}\n";
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Arguments arguments;
    if (!read_arguments(argc, argv, arguments)) {
      std::cerr << usage;
      return 2;
    }
    std::vector<std::string> warnings;
    std::vector<ModelChoice> choices;
    const tissue_sim::Scene scene = tissue_sim::load_chosen_scene(arguments.scene, warnings, choices);
    const ReplaySummary summary = tissue_sim::replay(scene, arguments.options);
    for (const std::string& warning : warnings) std::cerr << "warning: " << warning << "\n";
    for (const std::string& warning : summary.warnings) std::cerr << "warning: " << warning << "\n";
    print(summary, choices);
    if (!arguments.json.empty()) write_json(summary, choices, arguments.json);
  } catch (const std::exception& error) {
    std::cerr << "tissue_sim_replay: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
