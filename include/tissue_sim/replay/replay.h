#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim {

struct ReplayOptions {
  std::string input;   ///< bag with the poses; its /tf and /tf_static are used where it has them
  std::string output;  ///< bag to write
  std::string
      hashes;  ///< text file to write, a line a step: its number, its stamp (ns), Timeline::hash() after it; or empty
  double hold = 0.0;  ///< s to step on after the last pose, with every instrument held where it is
  TimelineOptions timeline;
};

/// What the step that ended on a pose's stamp found.
struct ReplayRow {
  double t = 0.0;      ///< s, the stamp
  double depth = 0.0;  ///< m, the deepest contact
  double force = 0.0;  ///< N, the largest on an instrument
  std::uint64_t contacts = 0;
};

/// What an organ was modelled as.
struct ReplayOrgan {
  std::string name;
  Model model = Model::contact_only;
  OrganSummary summary;
};

struct ReplaySummary {
  std::uint64_t steps = 0;
  double sim_seconds = 0.0;
  std::uint64_t poses_used = 0;
  std::uint64_t poses_missing_transform = 0;
  TimelineCounters counters;
  std::uint64_t contact_steps = 0;  ///< steps with a contact
  std::uint64_t contacts_max = 0;   ///< in one step
  double depth_max = 0.0;           ///< m
  double force_max = 0.0;           ///< N
  std::uint64_t non_finite = 0;     ///< values in the contacts, forces and states
  double ms_per_step_p50 = 0.0;
  double ms_per_step_p99 = 0.0;
  double ms_per_contact_step_p50 = 0.0;  ///< over the steps with a contact
  std::vector<ReplayOrgan> organs;
  double real_time_factor = 0.0;  ///< simulated seconds by the seconds that the steps took
  std::uint64_t hash = 0;         ///< Timeline::hash() at the end: of every step's state
  std::vector<ReplayRow> rows;    ///< one for each stamp on which a pose was reached
  std::vector<std::string> warnings;

  std::uint64_t poses_dropped() const;
};

/// Runs the poses of a bag through a scene and writes /tissue_sim/<organ>/{topology,state}, /tissue_sim/contacts and
/// /tissue_sim/<instrument>/measured_cf. The output appears under its name only once it is whole.
/// Throws SceneError, and std::runtime_error with one line that names the bag, what is wrong and the cure.
ReplaySummary replay(const Scene& scene, const ReplayOptions& options);

}  // namespace tissue_sim
