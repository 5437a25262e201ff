#include "tissue_sim/simulation/timeline.h"

#include <algorithm>
#include <cmath>

#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/levels.h"
#include "tissue_sim/simulation/step.h"
#include "tissue_sim/tissue/energy.h"

namespace tissue_sim {

namespace {

constexpr double nanosecond = 1e-9;

std::int64_t in_nanoseconds(double seconds) {
  return std::llround(seconds / nanosecond);
}

const Scene& with_models_chosen(const Scene& scene) {
  for (std::size_t o = 0; o < scene.alternatives.size(); ++o) {
    if (scene.alternatives[o].empty()) continue;
    throw SceneError("organ " + scene.organs[o].name +
                     ": its model is left to the scene's accuracy, choose_models() comes before the first step");
  }
  return scene;
}

template <class Item>
std::size_t bytes(const std::vector<Item>& items) {
  return items.size() * sizeof(Item);
}

std::size_t bytes(const FlatLists& lists) {
  return bytes(lists.first) + bytes(lists.items);
}

std::size_t bytes(const RestShape& rest) {
  return bytes(rest.positions) + bytes(rest.embedding.corners) + bytes(rest.embedding.weights) +
         bytes(rest.embedding.offsets) + bytes(rest.triangles) + bytes(rest.shell) + bytes(rest.topology.edges) +
         bytes(rest.topology.edge_triangles) + bytes(rest.topology.triangle_edges) + bytes(rest.topology.vertex_edges) +
         bytes(rest.topology.vertex_triangles) + bytes(rest.attached) + bytes(rest.mass) + bytes(rest.inverse_mass) +
         bytes(rest.distances) + bytes(rest.areas) + bytes(rest.volumes) + bytes(rest.tetrahedra) +
         bytes(rest.packed.batches) + bytes(rest.constraints.pairs) + bytes(rest.constraints.flaps) +
         bytes(rest.constraints.triangles) + bytes(rest.constraints.distances) + bytes(rest.chunks.seams);
}

std::size_t bytes(const OrganState& state) {
  return bytes(state.positions) + bytes(state.velocities) + bytes(state.forces) + bytes(state.depths) +
         bytes(state.held);
}

/// The way from one stamp to the next, cut into steps that are equal to within a nanosecond.
struct Segment {
  std::int64_t begin = 0;
  std::int64_t end = 0;
  std::int64_t steps = 0;
  std::int64_t done = 0;
  bool ends_on_pose = false;
  std::vector<Pose> from;  ///< one an instrument
  std::vector<Pose> to;

  bool over() const { return done == steps; }
  std::int64_t stamp_after(std::int64_t step) const {
    const std::int64_t length = end - begin;
    return begin + length / steps * step + length % steps * step / steps;
  }
};

}  // namespace

struct Timeline::Impl {
  Impl(const Scene& scene, const TimelineOptions& given)
      : world(build_world(with_models_chosen(scene))),
        options(given),
        workspace(build_workspace(world, given.threads)),
        state(rest_state(world)) {
    longest_step = in_nanoseconds(scene.time_step);
    tracks.resize(static_cast<std::size_t>(world.instruments));
    motion.instruments.resize(tracks.size());
    report.wrenches.resize(tracks.size());
    report.poses.resize(tracks.size());
    report.placed.assign(tracks.size(), 0);
  }

  PoseVerdict take(int instrument, StampedPose pose);
  void start_run(int instrument, const StampedPose& first);
  bool next_segment();
  void begin_segment(std::int64_t end, bool ends_on_pose);
  void make_step();
  void reset_organ(int organ);

  const World world;
  const TimelineOptions options;
  Workspace workspace;
  State state;
  StepReport report;
  TimelineCounters counters;
  std::vector<PoseTrack> tracks;
  Segment segment;
  Motion motion;
  std::int64_t longest_step = 0;
  std::int64_t now = 0;  ///< ns; 0: no pose yet
  std::int64_t last_state = 0;
  std::uint64_t hash = 0;
};

PoseVerdict Timeline::Impl::take(int instrument, StampedPose pose) {
  bool normalised = false;
  const PoseVerdict verdict = judge_pose(pose, normalised);
  if (verdict != PoseVerdict::used) return verdict;
  if (normalised) ++counters.normalised_quaternions;

  PoseTrack& track = tracks[instrument];
  const std::int64_t before = std::max(track.newest, track.newest > 0 ? now : 0);
  if (now == 0) {
    start_run(instrument, pose);
    return PoseVerdict::used;
  }
  if (before - pose.stamp > options.time_jump_threshold || pose.stamp - now > options.longest_gap) {
    start_run(instrument, pose);
    return PoseVerdict::new_run;
  }
  if (pose.stamp <= before) return PoseVerdict::stale;
  track.newest = pose.stamp;
  if (pose.stamp <= now) {  // an instrument that joins late: it is there from now on
    track.placed = true;
    track.pose = pose.pose;
    return PoseVerdict::used;
  }
  if (options.newest_only) {
    counters.poses_superseded += track.ahead.size();
    track.ahead.clear();
  }
  track.ahead.push_back(pose);
  return PoseVerdict::used;
}

/// The first step of a run ends on its first pose, with the instrument standing there.
void Timeline::Impl::start_run(int instrument, const StampedPose& first) {
  if (now != 0) {
    for (std::size_t organ = 0; organ < state.organs.size(); ++organ) reset_organ(static_cast<int>(organ));
    for (PoseTrack& track : tracks) track = PoseTrack();
  }
  tracks[instrument].placed = true;
  tracks[instrument].pose = first.pose;
  tracks[instrument].newest = first.stamp;
  now = std::max<std::int64_t>(first.stamp - longest_step, 1);
  last_state = 0;
  begin_segment(std::max(first.stamp, now + 1), true);
}

/// The next stamp to go to is the earliest that lies ahead, once every instrument has said where it will be or is too
/// late to wait for.
bool Timeline::Impl::next_segment() {
  std::int64_t earliest = 0;
  std::int64_t newest = 0;
  for (const PoseTrack& track : tracks) {
    newest = std::max(newest, track.newest);
    if (track.ahead.empty()) continue;
    if (earliest == 0 || track.ahead.front().stamp < earliest) earliest = track.ahead.front().stamp;
  }
  if (earliest == 0) return false;
  for (const PoseTrack& track : tracks) {
    if (track.placed && track.ahead.empty() && newest - track.newest < options.pose_timeout) return false;
  }
  begin_segment(earliest, true);
  return true;
}

void Timeline::Impl::begin_segment(std::int64_t end, bool ends_on_pose) {
  segment.ends_on_pose = ends_on_pose;
  segment.begin = now;
  segment.end = end;
  segment.steps = (end - now + longest_step - 1) / longest_step;
  segment.done = 0;
  segment.from.clear();
  segment.to.clear();
  for (const PoseTrack& track : tracks) {
    segment.from.push_back(track.pose);
    // Part of the way to a pose that lies behind the end of the segment.
    Pose to = track.pose;
    if (track.placed && !track.ahead.empty()) {
      const StampedPose& next = track.ahead.front();
      const double part = static_cast<double>(end - now) / static_cast<double>(next.stamp - now);
      to = interpolate(track.pose, next.pose, part);
    }
    segment.to.push_back(to);
  }
}

void Timeline::Impl::make_step() {
  const double before = static_cast<double>(segment.done) / static_cast<double>(segment.steps);
  ++segment.done;
  const double after = static_cast<double>(segment.done) / static_cast<double>(segment.steps);
  const std::int64_t stamp = segment.stamp_after(segment.done);
  motion.duration = static_cast<double>(stamp - now) * nanosecond;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    motion.instruments[i].placed = tracks[i].placed;
    motion.instruments[i].from = interpolate(segment.from[i], segment.to[i], before);
    motion.instruments[i].to = interpolate(segment.from[i], segment.to[i], after);
    tracks[i].pose = motion.instruments[i].to;
  }
  now = stamp;
  ++report.step;
  report.stamp = stamp;
  tissue_sim::step(world, motion, state, workspace, report);
  if (report.recovered) ++counters.recoveries;

  report.pose_reached = segment.over() && segment.ends_on_pose;
  for (std::size_t i = 0; segment.over() && i < tracks.size(); ++i) {
    PoseTrack& track = tracks[i];
    if (track.ahead.empty() || track.ahead.front().stamp > stamp) continue;
    track.placed = true;
    track.pose = track.ahead.front().pose;
    track.ahead.pop_front();
  }

  // Tied to a pose wherever poses come often enough; between poses that are far apart, where another state still fits
  // before the next.
  const bool period_over = last_state == 0 || stamp - last_state >= options.state_period;
  const bool fits_before_pose = segment.end - stamp >= options.state_period;
  report.state_due = period_over && (segment.over() || fits_before_pose);
  if (report.state_due) last_state = stamp;

  hash = hash_word(report.step, hash);
  hash = hash_word(static_cast<std::uint64_t>(stamp), hash);
  for (std::size_t o = 0; o < state.organs.size(); ++o) {
    const OrganState& organ = state.organs[o];
    if (!organ.asleep || !report.contacts.empty()) hash = hash_state(world.organs[o], organ, hash);
  }
}

void Timeline::Impl::reset_organ(int organ) {
  state.organs[organ] = rest_state(world, organ);
  workspace.organs[organ].last_good = state.organs[organ];
  workspace.organs[organ].bad_steps = 0;
  forget(workspace.organs[organ]);
  hash = hash_state(world.organs[organ], state.organs[organ], hash);
  ++counters.resets;
}

Timeline::Timeline(const Scene& scene, const TimelineOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}
Timeline::~Timeline() = default;

PoseVerdict Timeline::add_pose(int instrument, const StampedPose& pose) {
  const PoseVerdict verdict = impl_->take(instrument, pose);
  ++impl_->counters.poses[static_cast<std::size_t>(verdict)];
  return verdict;
}

bool Timeline::step() {
  if (impl_->segment.over() && !impl_->next_segment()) return false;
  impl_->make_step();
  return true;
}

bool Timeline::step_holding(std::int64_t until) {
  if (step()) return true;
  if (impl_->now == 0 || impl_->now + impl_->longest_step > until) return false;
  impl_->begin_segment(impl_->now + impl_->longest_step, false);
  impl_->make_step();
  return true;
}

void Timeline::set_forces_wanted(bool wanted) {
  impl_->motion.forces_wanted = wanted;
}

void Timeline::reset(int organ) {
  for (std::size_t i = 0; i < impl_->state.organs.size(); ++i) {
    if (organ < 0 || organ == static_cast<int>(i)) impl_->reset_organ(static_cast<int>(i));
  }
}

const StepReport& Timeline::report() const {
  return impl_->report;
}

OrganView Timeline::organ(int index) const {
  OrganState& state = impl_->state.organs[index];
  place_surface(impl_->world.organs[index], state);
  return {{state.positions.data(), state.depths.size()}, {state.depths.data(), state.depths.size()}};
}

OrganSummary Timeline::summary(int organ) const {
  const OrganModel& model = impl_->world.organs[organ];
  const RestShape& rest = model.rest;
  OrganSummary summary;
  summary.vertices = rest.surface_vertices;
  summary.triangles = static_cast<int>(rest.triangles.size());
  if (rest.elastic()) summary.simulated_vertices = static_cast<int>(rest.positions.size()) - rest.first_simulated;
  summary.tetrahedra = static_cast<int>(rest.tetrahedra.size() + (rest.areas.empty() ? rest.volumes.size() : 0));
  summary.embedded = rest.first_simulated > 0;
  summary.shell_triangles = static_cast<int>(rest.shell.size());
  summary.shell_edge = mean_edge_length(rest.positions, rest.shell_topology.edges);
  for (std::size_t level = 0; !model.levels.empty() && level <= model.levels.size(); ++level) {
    const bool own = level == 0;
    const RestShape& shape = own ? rest : model.levels[level - 1].shape;
    summary.levels.push_back({own ? model.fine_edge : model.levels[level - 1].edge,
                              static_cast<int>(shape.tetrahedra.size()),
                              level < model.regions.size() ? model.regions[level].radius : 0.0});
  }
  summary.plastic = rest.elastic() && !model.restoration;
  summary.attached = static_cast<int>(std::count(rest.attached.begin(), rest.attached.end(), 1));
  summary.distance_elements = static_cast<int>(rest.distances.size());
  summary.area_elements = static_cast<int>(rest.areas.size());
  summary.volume_elements = static_cast<int>(rest.volumes.size());
  summary.enclosed_volume = rest.enclosed.stiffness > 0.0;
  summary.mass = rest.total_mass;
  summary.added_mass = rest.added_mass;
  summary.stable_substep = rest.stable_substep;
  summary.substeps = model.integrator == Integrator::explicit_substeps ? substeps_for(rest, impl_->world.time_step) : 1;
  summary.integrator = model.integrator;
  summary.integrator_reason = model.integrator_reason;
  summary.memory = bytes(rest) + bytes(impl_->state.organs[organ]);
  return summary;
}

const TimelineCounters& Timeline::counters() const {
  return impl_->counters;
}
std::uint64_t Timeline::hash() const {
  return impl_->hash;
}
std::int64_t Timeline::now() const {
  return impl_->now;
}

double Timeline::kinetic_energy() const {
  double energy = 0.0;
  const auto add = [&energy](const RestShape& shape, const std::vector<Vector3>& velocities) {
    for (std::size_t v = 0; v < velocities.size(); ++v) energy += 0.5 * shape.mass[v] * velocities[v].squaredNorm();
  };
  for (std::size_t o = 0; o < impl_->state.organs.size(); ++o) {
    const OrganModel& model = impl_->world.organs[o];
    const OrganState& organ = impl_->state.organs[o];
    if (model.levels.empty()) {
      add(model.rest, organ.velocities);
    } else {
      add(model.levels.back().shape, organ.levels.back().velocities);
    }
  }
  return energy;
}

double Timeline::elastic_energy() const {
  double energy = 0.0;
  for (std::size_t o = 0; o < impl_->state.organs.size(); ++o) {
    place_all(impl_->world.organs[o], impl_->state.organs[o]);
    energy += tissue_sim::elastic_energy(impl_->world.organs[o].rest, impl_->state.organs[o].positions);
  }
  return energy;
}

int Timeline::active_vertices() const {
  int active = 0;
  for (std::size_t o = 0; o < impl_->state.organs.size(); ++o) {
    const OrganState& organ = impl_->state.organs[o];
    const RestShape& rest = impl_->world.organs[o].rest;
    if (organ.asleep) continue;
    active += organ.wakes_in_parts() ? static_cast<int>(organ.region.free.size())
                                     : static_cast<int>(organ.positions.size()) - rest.first_simulated;
    for (const LevelState& level : organ.levels) active += static_cast<int>(level.region.free.size());
  }
  return active;
}

}  // namespace tissue_sim
