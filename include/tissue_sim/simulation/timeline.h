#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/pose_track.h"
#include "tissue_sim/simulation/step_report.h"

namespace tissue_sim {

struct TimelineOptions {
  std::int64_t state_period = 16'000'000;          ///< ns
  std::int64_t time_jump_threshold = 500'000'000;  ///< ns
  std::int64_t pose_timeout = 500'000'000;    ///< ns; an instrument this far behind the others is held, not waited for
  std::int64_t longest_gap = 10'000'000'000;  ///< ns; poses farther apart than this start a new run
  int threads = 1;           ///< 1 to most_threads, for large organs; the states are the same bits for any number
  bool newest_only = false;  ///< true: steps go to the newest pose and the ones before it are passed over
};

struct TimelineCounters {
  std::array<std::uint64_t, pose_verdicts> poses{};  ///< by PoseVerdict
  std::uint64_t poses_superseded = 0;                ///< passed over by newest_only
  std::uint64_t normalised_quaternions = 0;
  std::uint64_t recoveries = 0;  ///< by the health check
  std::uint64_t resets = 0;
};

/// Part of an array that somebody else owns.
template <class Item>
struct Span {
  const Item* first = nullptr;
  std::size_t count = 0;

  const Item* begin() const { return first; }
  const Item* end() const { return first + count; }
  std::size_t size() const { return count; }
  const Item& operator[](std::size_t i) const { return first[i]; }
};

/// What an organ shows, one entry a vertex of its surface. Valid until the next step.
struct OrganView {
  Span<Vector3> positions;  ///< m, scene frame
  Span<double> depths;      ///< m, 0 where the instrument does not press
};

/// One level of a `fem` organ.
struct LevelSummary {
  double edge = 0.0;  ///< m
  int tetrahedra = 0;
  double radius = 0.0;  ///< m, of what is awake around a contact; 0: all of it is
};

/// What will be modelled of one organ, and what it takes.
struct OrganSummary {
  int vertices = 0;
  int triangles = 0;
  int simulated_vertices = 0;  ///< what is integrated: of the surface, of the solid; 0 for contact_only
  int tetrahedra = 0;
  bool embedded = false;             ///< the surface is carried by the tetrahedra or by a coarse shell
  int shell_triangles = 0;           ///< of the coarse shell; 0: there is none
  double shell_edge = 0.0;           ///< m, its mean edge
  std::vector<LevelSummary> levels;  ///< the organ's own tetrahedra first; empty: all of them are awake
  bool plastic = false;              ///< what the instrument moved stays moved
  int attached = 0;
  int distance_elements = 0;
  int area_elements = 0;
  int volume_elements = 0;  ///< flaps of a wall, tetrahedra of a solid
  bool enclosed_volume = false;
  double mass = 0.0;            ///< kg
  double added_mass = 0.0;      ///< kg, by the mass floor
  double stable_substep = 0.0;  ///< s; 0 where nothing is integrated
  int substeps = 1;             ///< in a step of the scene's time step, motion of the instruments aside
  Integrator integrator = Integrator::explicit_substeps;  ///< never automatic
  std::string integrator_reason;
  std::size_t memory = 0;  ///< bytes of the rest shape and of the state
};

/// Stamped poses in, steps out: the time rules of the simulation, shared by the node and the replay.
///
/// Time is that of the stamps, in whole nanoseconds. From one pose to the next the way is cut into equal
/// steps no longer than the scene's time step, so that a step always ends on a pose's stamp.
class Timeline {
 public:
  /// Throws SceneError, which names the organ and the time step or stiffness that would do, when a step would need
  /// more than the scene's max_substeps; and when the scene still leaves a model open (choose_models()).
  explicit Timeline(const Scene& scene, const TimelineOptions& options = {});
  ~Timeline();

  /// Takes a pose or says why not. A stamp that goes back by more than time_jump_threshold starts a new run:
  /// organs at rest, poses forgotten, this pose the first.
  PoseVerdict add_pose(int instrument, const StampedPose& pose);

  /// Makes the next step if the poses given so far allow one. False: nothing to do until the next pose.
  bool step();

  /// Makes the next step towards `until` (ns) with the last poses held. False once `until` is reached.
  bool step_holding(std::int64_t until);

  /// From the next step on: false leaves the forces of contacts and wrenches zero, which spares their time. Positions,
  /// depths and the hash are the same either way.
  void set_forces_wanted(bool wanted);

  /// Puts one organ, or all for -1, back to its rest shape.
  void reset(int organ);

  const StepReport& report() const;
  OrganView organ(int index) const;
  OrganSummary summary(int organ) const;
  const TimelineCounters& counters() const;
  std::uint64_t hash() const;     ///< of every state since construction, over positions, velocities and depths
  std::int64_t now() const;       ///< ns, the stamp of the last step or of the first pose; 0 before that
  double kinetic_energy() const;  ///< J, with levels that of the coarsest
  double elastic_energy() const;  ///< J
  int active_vertices() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tissue_sim
