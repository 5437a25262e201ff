#include "tissue_sim/simulation/stages.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "tissue_sim/contact/propagation.h"
#include "tissue_sim/simulation/health.h"
#include "tissue_sim/simulation/integrator.h"

namespace tissue_sim {

namespace {

/// More cuts than this for one step, and faster (m/s) than this, is a jump, not a motion: it is not swept. The end of a
/// tool of 0.2 m that turns end over end 100 times a second is slower; in a step of 50 ms 5 m/s are 250 mm.
constexpr int most_cuts = 300;
constexpr double fastest_motion = 130.0;

/// Of the motion limit: what an instrument and the organ may move against each other, by the farthest point of either,
/// before contact is looked for again; and what a contact point may slip along its instrument. Half as much or twice as
/// much of either changed the largest jump of the force on a sliding probe by no more than other triangles do (2.5 to
/// 3.5 %). Without the organ's own motion stiff solids in steps of 50 ms were thrown five times as far as pressed.
constexpr double unseen_way = 0.5;
constexpr double unseen_slip = 0.0625;

/// Of the motion limit: what is farther than this from the organ's box is far from it.
constexpr double far_way = 2.0;

/// m/s, and of the organ's size in a second. An untouched organ whose fastest vertex is slower than both goes to sleep:
/// what is left to move is far below a micrometre, and below a millionth of the size.
constexpr double sleep_speed = 1e-7;
constexpr double sleep_rate = 5e-7;

/// A step after it was measured: what was pressed does not stop being stretched when the instrument is gone. A ball
/// that had flown through at 5 m/s left a block that went bad in every step after it.
constexpr double stiffening_left = 0.95;

/// Substeps of a step from which on it is measured of all tetrahedra, not only at contacts: that takes about as long as
/// ten of them.
constexpr int many_substeps = 64;

/// Bad steps in a row after which the last good state is not good: the organ goes to rest.
constexpr int most_bad_steps = 10;

/// Adds the time from here to the end of the scope to a stage of the profile.
class Lap {
 public:
  explicit Lap(double& stage) : stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~Lap() { stage_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Lap(const Lap&) = delete;
  Lap& operator=(const Lap&) = delete;

 private:
  double& stage_;
  std::chrono::steady_clock::time_point start_;
};

Vector3 corner_of(const Box& box, int corner) {
  Vector3 p;
  for (int axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1) != 0 ? box.upper[axis] : box.lower[axis];
  return p;
}

/// m. How far a turn from one pose to the other moves a point of the box at most: less than by all of its reach where
/// the box lies along the axis, as a shaft that spins about itself.
double way_of_turn(const InstrumentSurface& surface, const Pose& from, const Pose& to) {
  const Eigen::AngleAxisd turn(from.orientation.conjugate() * to.orientation);
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    farthest = std::max(farthest, corner_of(surface.bounds, corner).cross(turn.axis()).norm());
  }
  return std::min(surface.reach, farthest) * angle_between(from, to);
}

Vector3 velocity_of(const Pose& before, const Pose& now, const Vector3& point, double dt) {
  return (point - before.apply(now.apply_inverse(point))) / dt;
}

/// m. The farthest way of a point of a box in the tip's frame from one pose of the tip to the next: that of a corner,
/// since a point's way is linear in the point. Small for a shaft that spins about itself.
double farthest_way(const Box& box, const Pose& from, const Pose& to) {
  const Matrix3 turned = to.orientation.toRotationMatrix() - from.orientation.toRotationMatrix();
  const Vector3 moved = to.position - from.position;
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    farthest = std::max(farthest, (turned * corner_of(box, corner) + moved).squaredNorm());
  }
  return std::sqrt(farthest);
}

/// What of an instrument's piece lies in the organ's box grown by `margin` (m), in the tip's frame.
std::optional<Box> part_near(const StepContext& context, const InstrumentPiece& piece, double margin) {
  const Pose& pose = context.workspace.now[piece.instrument];
  const Pose to_tip = {pose.apply_inverse(Vector3::Zero()), pose.orientation.conjugate()};
  const OrganWorkspace& work = context.workspace.organs[context.organ];
  const Box organ = scene_bounds(bounds_of(work.patches).grown(margin), to_tip);
  const Box& all = piece.surface.bounds;
  if (!organ.overlaps(all)) return std::nullopt;
  return Box{organ.lower.cwiseMax(all.lower), organ.upper.cwiseMin(all.upper)};
}

/// Whether an instrument's piece and the organ can have moved against each other by more than goes unseen. What of the
/// piece was far from the organ does not count before it can have come near: else a long shaft, whose far end swings,
/// would be looked at again and again.
bool has_moved(const StepContext& context, const LastLook& last) {
  const double limit = context.model().motion_limit;
  const double of_organ = context.workspace.organs[context.organ].patches.travel - last.travel;
  const bool unseen = of_organ + last.way_of_near <= unseen_way * limit;
  const bool rest_is_far = of_organ + last.way_of_all <= far_way * limit;
  return !(unseen && rest_is_far);  // a NaN has
}

void find_instrument_velocities(StepContext& context) {
  for (ContactPoint& point : context.work().points) {
    const int instrument = context.world.pieces[point.piece].instrument;
    const Vector3 place = at_point(point, context.state.positions);
    point.instrument_velocity =
        velocity_of(context.workspace.before[instrument], context.workspace.now[instrument], place, context.dt);
  }
}

/// The same place of the organ has the same number in every substep of a step: its vertex; the corner of a triangle
/// that a poke is nearest to; the side of a triangle, by the corner opposite.
std::size_t place_of(const ContactPoint& point, const RestShape& rest) {
  const std::size_t first = static_cast<std::size_t>(rest.surface_vertices);
  const std::size_t of_triangle = 3 * static_cast<std::size_t>(point.triangle);
  int corner = 0;
  if (point.poking >= 0) {
    point.weights.maxCoeff(&corner);
    return first + of_triangle + static_cast<std::size_t>(corner);
  }
  for (int i = 0; i < 3; ++i) {
    if (point.weights[i] >= 1.0) return static_cast<std::size_t>(rest.triangles[point.triangle][i]);
  }
  point.weights.minCoeff(&corner);
  return first + 3 * rest.triangles.size() + of_triangle + static_cast<std::size_t>(corner);
}

std::size_t count_places(const RestShape& rest) {
  return static_cast<std::size_t>(rest.surface_vertices) + 6 * rest.triangles.size();
}

std::size_t place_of_piece(const ContactPoint& point, const RestShape& rest) {
  return static_cast<std::size_t>(point.piece) * count_places(rest) + place_of(point, rest);
}

/// None of the step so far.
void begin_contacts(OrganWorkspace& work) {
  work.contacts.clear();
  ++work.round;
}

/// Adds what a substep has found at a contact point to the contact that the step reports there.
void record_contact(StepContext& context, const ContactPoint& point) {
  OrganWorkspace& work = context.work();
  const RestShape& rest = context.model().rest;
  const std::size_t place = place_of_piece(point, rest);
  if (work.contact_round[place] != work.round) {
    work.contact_round[place] = work.round;
    work.contact_of[place] = static_cast<int>(work.contacts.size());
    work.contacts.emplace_back();
    work.contacts.back().force.setZero();
  }
  const InstrumentPiece& piece = context.world.pieces[point.piece];
  OrganContact& contact = work.contacts[work.contact_of[place]];
  contact.organ = context.organ;
  contact.instrument = piece.instrument;
  contact.part = piece.part;
  contact.triangle = point.triangle;
  contact.barycentric = point.weights;
  contact.direction = point.direction;
  contact.depth = point.target + point.lift;  // turned into a depth when the step ends
  contact.force += context.dt / context.motion.duration * point.force * point.direction;
}

/// Where the force of a point is remembered. That of a poke goes with the instrument's vertex: the nearest triangle and
/// corner change with every rounding where it rests between two.
std::size_t memory_of(const ContactPoint& point, const World& world, const RestShape& rest) {
  if (point.poking < 0) return place_of_piece(point, rest);
  std::size_t memory = world.pieces.size() * count_places(rest) + static_cast<std::size_t>(point.poking);
  for (int piece = 0; piece < point.piece; ++piece) memory += world.pieces[piece].surface.vertices.size();
  return memory;
}

std::size_t count_memories(const World& world, const RestShape& rest) {
  std::size_t memories = world.pieces.size() * count_places(rest);
  for (const InstrumentPiece& piece : world.pieces) memories += piece.surface.vertices.size();
  return memories;
}

/// Points start from what was found for them in the substep before.
void remember_forces(const StepContext& context, OrganWorkspace& work) {
  const RestShape& rest = context.model().rest;
  const std::vector<PlaceForce>& pressing = context.state.pressing;
  for (std::size_t i = 0; i < pressing.size(); ++i) work.pressing_of[pressing[i].place] = static_cast<int>(i);
  for (ContactPoint& point : work.points) {
    const int i = work.pressing_of[memory_of(point, context.world, rest)];
    if (i < 0) continue;
    point.force = pressing[i].force;
    if (context.model().integrator == Integrator::explicit_substeps) point.impulse = context.dt * pressing[i].stopping;
  }
  for (const PlaceForce& was : pressing) work.pressing_of[was.place] = -1;
}

void keep_forces(StepContext& context) {
  context.state.pressing.clear();
  for (const ContactPoint& point : context.work().points) {
    context.state.pressing.push_back(
        {memory_of(point, context.world, context.model().rest), point.force, point.impulse / context.dt});
  }
}

void stand_still(OrganState& state) {
  if (state.wakes_in_parts()) {
    for (const int v : state.region.active.vertices) state.velocities[v].setZero();
  } else {
    std::fill(state.velocities.begin(), state.velocities.end(), Vector3::Zero());
  }
  for (LevelState& level : state.levels) std::fill(level.velocities.begin(), level.velocities.end(), Vector3::Zero());
}

/// Moves the simulated vertices. Returns the largest speed of one, m/s.
double integrate_elements(StepContext& context) {
  const OrganModel& model = context.model();
  OrganState& state = context.state;
  OrganWorkspace& work = context.work();
  remember_forces(context, work);
  if (model.integrator == Integrator::vertex_block_descent) {
    stop_at_instrument(work.points, model.rest.inverse_mass, state.positions, context.dt, state.velocities,
                       work.response);
    const double speed = descend(model, context.world.gravity, context.dt, work.points, state, work.descent);
    keep_forces(context);
    if (context.motion.forces_wanted) bearing_forces(model, work.points, state, work.descent, state.forces);
    return speed;
  }
  double coarser_speed = 0.0;
  if (model.regions.empty()) {
    element_forces(model.rest, state, state.forces, work.elements, context.workspace.threads.get());
  } else if (model.levels.empty()) {
    element_forces(model.rest, state, state.region.active, state.forces, work.elements);
    for (double& time : state.untouched) time += context.dt;
  } else {
    coarser_speed =
        move_coarser(model, context.world.gravity, context.substep, context.substeps, context.dt, state, work.levels);
    solid_forces(model, context.dt, state, work.levels);
  }
  accelerate(model, context.world.gravity, context.dt, state.forces, state);
  stop_at_instrument(work.points, model.rest.inverse_mass, state.positions, context.dt, state.velocities,
                     work.response);
  const double speed = std::max(coarser_speed, advance(model, context.dt, state));
  if (!model.levels.empty()) {
    press_coarser(model, work.points, state, work.levels);
    follow_coarser(context.dt, state, work.levels);
  }
  if (context.substep == context.substeps) {  // the next step asks for it
    const bool everywhere = model.regions.empty() && context.substeps >= many_substeps;
    const double now = everywhere
                           ? stiffening(model.rest, state.positions)
                           : stiffening(model.rest, model.tetrahedra_at, work.points, state.positions, work.bearers);
    state.stiffening = std::max(now, stiffening_left * state.stiffening);
  }
  return speed;
}

/// What has moved by itself: the patches and the clearances have to know.
void note_motion(StepContext& context, double way) {
  context.work().patches.travel += way;
  for (Clearance& clearance : context.state.clearances) clearance.shift += way;
}

void put_last_good_back(StepContext& context) {
  OrganWorkspace& work = context.work();
  if (++work.bad_steps > most_bad_steps) work.last_good = rest_state(context.world, context.organ);
  recover(context.model(), work.last_good, context.state);
  begin_contacts(work);
  forget(work);
  context.report.recovered = true;
}

bool all_awake(const std::vector<ContactPoint>& points, const OrganState& state) {
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      if (state.region.mark[point.bearers.vertices[i]] != Part::free) return false;
    }
  }
  return true;
}

/// Their lists grow to this sooner or later; from the start, since the first time may come after hours.
void make_room(Detection& detection, Penetration& penetration) {
  detection.crossings.reserve(usual_contacts);
  detection.crossed_edges.reserve(usual_contacts);
  detection.unordered.reserve(usual_contacts);
  detection.pairs.reserve(usual_contacts);
  detection.hits.reserve(usual_contacts);
  for (std::vector<int>* list :
       {&detection.border, &detection.border_outside, &detection.colliding, &detection.stack,
        &detection.tree_room.stack, &detection.tree_room.leaves, &penetration.layer, &penetration.next_layer}) {
    list->reserve(usual_contacts);
  }
  detection.tree_room.codes.reserve(usual_contacts);
  detection.tree_room.candidates.reserve(usual_contacts);
  detection.tree_room.visits.reserve(usual_contacts);
}

}  // namespace

Workspace build_workspace(const World& world, int threads) {
  Workspace workspace;
  if (threads != 1) workspace.threads = std::make_unique<Threads>(threads);
  workspace.before.resize(static_cast<std::size_t>(world.instruments));
  workspace.now.resize(static_cast<std::size_t>(world.instruments));
  for (std::size_t organ = 0; organ < world.organs.size(); ++organ) {
    const OrganModel& model = world.organs[organ];
    const RestShape& rest = model.rest;
    OrganWorkspace& work = workspace.organs.emplace_back();
    work.patches = build_patches(rest.positions, rest.triangles, rest.topology);
    work.detections.resize(world.pieces.size());
    work.penetrations.resize(world.pieces.size());
    work.near.assign(world.pieces.size(), 0);
    work.last_looks.assign(world.pieces.size(), {});
    const OrganSurface surface = {rest.positions, rest.triangles, rest.topology, rest.component_roots, work.patches};
    for (std::size_t p = 0; p < world.pieces.size(); ++p) {
      prepare(work.detections[p], surface);
      prepare(work.penetrations[p], surface);
      make_room(work.detections[p], work.penetrations[p]);
    }
    if (rest.elastic()) {
      work.pressing_of.assign(count_memories(world, rest), -1);
      work.response.delassus.reserve(usual_contacts, rest.positions.size());
      work.response.lacking.reserve(usual_contacts);
      work.response.impulses.reserve(usual_contacts);
    }
    const std::size_t places = world.pieces.size() * count_places(rest);
    if (model.integrator == Integrator::vertex_block_descent) {
      prepare(work.descent, rest);
    } else {
      prepare(work.elements, rest);
      prepare(work.levels, model);
    }
    work.contact_of.assign(places, 0);
    work.points.reserve(usual_contacts);
    work.bearers.reserve(Bearers::most * usual_contacts);
    work.contacts.reserve(usual_contacts);
    work.contact_round.assign(places, 0);
    work.last_good = rest_state(world, static_cast<int>(organ));
    forget(work);
  }
  return workspace;
}

void forget(OrganWorkspace& work) {
  forget(work.patches);
}

void begin_report(const World& world, const Motion& motion, StepReport& report) {
  report.profile = StepProfile();
  report.recovered = false;
  report.substeps = 0;
  report.contacts.clear();
  report.contacts.reserve(usual_contacts);
  report.wrenches.assign(static_cast<std::size_t>(world.instruments), Wrench());
  report.poses.resize(static_cast<std::size_t>(world.instruments));
  report.placed.resize(static_cast<std::size_t>(world.instruments));
  for (std::size_t i = 0; i < motion.instruments.size(); ++i) {
    report.poses[i] = motion.instruments[i].to;
    report.placed[i] = motion.instruments[i].placed ? 1 : 0;
  }
}

int count_substeps(StepContext& context) {
  begin_contacts(context.work());
  context.slept = context.state.asleep;
  for (std::size_t i = 0; i < context.motion.instruments.size(); ++i) {
    context.workspace.now[i] = context.motion.instruments[i].from;
  }

  const OrganModel& model = context.model();
  const double much = most_cuts * model.motion_limit;
  double farthest = 0.0;
  bool near = false;
  for (const InstrumentPiece& piece : context.world.pieces) {
    const InstrumentMotion& motion = context.motion.instruments[piece.instrument];
    if (!motion.placed) continue;
    const double shift = (motion.to.position - motion.from.position).norm();
    const double way = shift + angle_between(motion.from, motion.to) * piece.surface.reach;
    Box swept = scene_bounds(piece.surface.bounds, motion.from);
    swept.add(scene_bounds(piece.surface.bounds, motion.to));
    // Between the two a rotation can leave both boxes by no more than the whole way.
    if (!swept.grown(way).overlaps(bounds_of(context.work().patches))) continue;
    near = true;
    farthest = std::max(farthest, way > much ? shift + way_of_turn(piece.surface, motion.from, motion.to) : way);
  }
  const bool jumps = farthest > much && farthest > fastest_motion * context.motion.duration;
  context.jumps = jumps;
  const int for_motion = jumps ? 1 : static_cast<int>(std::ceil(farthest / model.motion_limit));
  const bool one_is_enough = model.integrator == Integrator::vertex_block_descent || (context.state.asleep && !near);
  const int for_elements =
      one_is_enough ? 1 : substeps_for(model.rest, context.motion.duration, context.state.stiffening);
  int substeps = std::max({1, for_motion, for_elements});
  if (!model.levels.empty()) share_substeps(model, context.motion.duration, context.state, substeps);
  context.dt = context.motion.duration / substeps;
  context.report.substeps = std::max(context.report.substeps, substeps);
  return substeps;
}

void place_instruments(StepContext& context, int substep, int substeps) {
  const double fraction = static_cast<double>(substep) / substeps;
  context.substep = substep;
  context.substeps = substeps;
  Workspace& workspace = context.workspace;
  workspace.before = workspace.now;
  for (std::size_t i = 0; i < workspace.now.size(); ++i) {
    const InstrumentMotion& motion = context.motion.instruments[i];
    workspace.now[i] = interpolate(motion.from, motion.to, fraction);
  }
  double angle = 0.0;
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    const InstrumentPiece& piece = context.world.pieces[p];
    const Pose& before = workspace.before[piece.instrument];
    const Pose& now = workspace.now[piece.instrument];
    const bool another = p == 0 || piece.instrument != context.world.pieces[p - 1].instrument;
    if (another) angle = angle_between(before, now);
    Clearance& clearance = context.state.clearances[p];
    clearance.shift += (now.position - before.position).norm();
    clearance.turn += angle;
    LastLook& last = context.work().last_looks[p];
    if (last.near) last.way_of_near += farthest_way(*last.near, before, now);
    last.way_of_all += farthest_way(piece.surface.bounds, before, now);
  }
}

bool looks_again(StepContext& context) {
  OrganWorkspace& work = context.work();
  const double limit = context.model().motion_limit;
  bool again = context.substep == 1 || context.jumps;
  for (const LastLook& last : work.last_looks) again = again || has_moved(context, last);
  if (!again) find_instrument_velocities(context);
  for (std::size_t i = 0; i < work.points.size() && !again; ++i) {
    const ContactPoint& point = work.points[i];
    const Vector3 carried = point.carried + context.dt * point.instrument_velocity;
    again = !((at_point(point, context.state.positions) - carried).norm() <= unseen_slip * limit);
  }
  for (std::size_t p = 0; p < work.last_looks.size() && again; ++p) {
    work.last_looks[p] = {work.patches.travel, part_near(context, context.world.pieces[p], far_way * limit)};
  }
  return again;
}

void refit(StepContext& context) {
  const Lap lap(context.report.profile.refit);
  OrganWorkspace& work = context.work();
  const OrganSurface surface = context.surface();
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    const InstrumentPiece& piece = context.world.pieces[p];
    const bool placed = context.motion.instruments[piece.instrument].placed;
    const TurnedBox box(piece.surface.bounds.grown(poke_reach), context.workspace.now[piece.instrument]);
    work.near[p] = placed && box.overlaps(bounds_of(work.patches)) ? 1 : 0;
    if (work.near[p]) for_each_patch_near(surface, box, [](int) {});
  }
}

void find_crossings(StepContext& context) {
  const Lap lap(context.report.profile.detection);
  OrganWorkspace& work = context.work();
  work.points.clear();
  const OrganSurface surface = context.surface();
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    const InstrumentPiece& piece = context.world.pieces[p];
    // What collides by the paper's memory alone goes on colliding while the instrument is away.
    const bool remembers = context.model().colliding_set == CollidingSet::paper;
    if (!context.motion.instruments[piece.instrument].placed || (!work.near[p] && !remembers)) {
      context.state.touching[p].clear();
      work.detections[p].colliding.clear();
      continue;
    }
    detect(surface, piece.surface, context.workspace.now[piece.instrument], context.model().colliding_set,
           context.state.colliding[p], work.detections[p]);
    work.near[p] = 1;
  }
}

void find_border_depths(StepContext& context) {
  const Lap lap(context.report.profile.penetration);
  OrganWorkspace& work = context.work();
  const OrganSurface surface = context.surface();
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    if (!work.near[p]) continue;
    const InstrumentSurface& instrument = context.world.pieces[p].surface;
    if (context.model().depth == DepthScheme::paper) {
      penetrate_border(surface, instrument, work.detections[p], work.penetrations[p]);
    } else {
      penetrate_exactly(instrument, work.detections[p], work.penetrations[p]);
    }
  }
}

void propagate_depths(StepContext& context) {
  if (context.model().depth != DepthScheme::paper) return;
  const Lap lap(context.report.profile.propagation);
  OrganWorkspace& work = context.work();
  const OrganSurface surface = context.surface();
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    if (!work.near[p]) continue;
    propagate(surface, context.world.pieces[p].surface, work.detections[p], work.penetrations[p]);
  }
}

void find_contacts(StepContext& context) {
  const Lap lap(context.report.profile.response);
  OrganWorkspace& work = context.work();
  const RestShape& rest = context.model().rest;
  const OrganSurface surface = context.surface();
  for (std::size_t p = 0; p < context.world.pieces.size(); ++p) {
    if (!work.near[p]) continue;
    const InstrumentPiece& piece = context.world.pieces[p];
    const int index = static_cast<int>(p);
    const Pose& pose = context.workspace.now[piece.instrument];
    add_vertex_contacts(surface, piece.surface, index, pose, work.penetrations[p], work.detections[p],
                        context.state.touching[p], work.points);
    if (context.model().sharp[p] == 0) continue;  // the organ's vertices feel all of it
    add_edge_contacts(surface, piece.surface, index, pose, work.detections[p], work.points);
    add_poke_contacts(surface, piece.surface, index, pose, context.model().poking[p], context.state.clearances[p],
                      work.points);
  }
  const bool parts = !context.model().regions.empty();
  if (parts && !context.state.asleep && context.substep == 1)
    note_motion(context, wake(context.model(), work.points, context.state, work.levels));
  if (work.points.empty()) return;

  if (!rest.embedding.corners.empty()) bear_by(rest.embedding, rest.triangles, context.state.positions, work.points);
  if (parts && (context.state.asleep || !all_awake(work.points, context.state))) {
    note_motion(context, wake(context.model(), work.points, context.state, work.levels));
  }
  if (rest.elastic()) work.response.delassus.build(work.points, rest.inverse_mass);
  for (ContactPoint& point : work.points) point.carried = at_point(point, context.state.positions);
  context.state.asleep = context.state.asleep && !rest.elastic();
  if (!context.jumps) find_instrument_velocities(context);  // what was not on its way throws nothing
}

void follow_instruments(StepContext& context) {
  const Lap lap(context.report.profile.response);
  for (ContactPoint& point : context.work().points) {
    point.carried += context.dt * point.instrument_velocity;
    point.target += context.dt * point.direction.dot(point.instrument_velocity);
  }
}

void respond(StepContext& context) {
  OrganWorkspace& work = context.work();
  if (work.points.empty()) return;
  const Lap lap(context.report.profile.response);
  const RestShape& rest = context.model().rest;
  std::vector<char>* held = context.model().restoration ? nullptr : &context.state.held;
  const double way = push_out(work.points, rest.inverse_mass, context.state.positions, held);
  note_motion(context, way);
}

void deform(StepContext& context) {
  const OrganModel& model = context.model();
  if (!model.rest.elastic() || context.state.asleep) return;
  const Lap lap(context.report.profile.deformation);
  const OrganWorkspace& work = context.work();
  const double speed = integrate_elements(context);
  context.ran_away = runs_away(speed);
  note_motion(context, context.dt * speed);
  if (work.points.empty() && speed < std::min(sleep_speed, sleep_rate * model.rest.size)) {
    context.state.asleep = true;
    stand_still(context.state);
  }
}

void bear(StepContext& context) {
  OrganWorkspace& work = context.work();
  if (work.points.empty()) {
    context.state.pressing.clear();
    return;
  }
  const Lap lap(context.report.profile.response);
  const RestShape& rest = context.model().rest;
  if (!context.motion.forces_wanted) {
    for (ContactPoint& point : work.points) point.force = 0.0;
  } else if (rest.elastic()) {
    bear_forces(rest.inverse_mass, context.state.forces, work.points, work.response);
  }
  if (rest.elastic() && context.model().integrator == Integrator::explicit_substeps) keep_forces(context);
  for (const ContactPoint& point : work.points) record_contact(context, point);
}

void recall(StepContext& context) {
  const Lap lap(context.report.profile.health);
  if (!remembers_numbers(context.state)) put_last_good_back(context);
}

void check_health(StepContext& context) {
  const Lap lap(context.report.profile.health);
  const OrganModel& model = context.model();
  OrganWorkspace& work = context.work();
  bool good = healthy_in_turn(model, context.state, work.turn++);
  for (std::size_t p = 0; p < work.near.size(); ++p) {
    good = good && (!work.near[p] || remembers_numbers(context.state.clearances[p], model.poking[p]));
  }
  // What fell asleep in this step is looked at: a position that is not a number has no speed and touches nothing.
  const bool idle = context.slept && context.state.asleep && work.contacts.empty();
  if (good && idle) return;
  if (good && healthy(model, context.state)) {
    copy_state(model, context.state, work.last_good);
    work.bad_steps = 0;
    return;
  }
  put_last_good_back(context);
}

void report_contacts(StepContext& context) {
  OrganWorkspace& work = context.work();
  for (const int triangle : context.state.pressed) {
    for (const int v : context.model().rest.triangles[triangle]) context.state.depths[v] = 0.0;
  }
  context.state.pressed.clear();
  context.state.pressed.reserve(usual_contacts);
  for (OrganContact& contact : work.contacts) {
    context.state.pressed.push_back(contact.triangle);
    place(context.model(), contact.triangle, context.state);
    const Triangle& corners = context.model().rest.triangles[contact.triangle];
    Vector3 rest = Vector3::Zero();
    contact.point.setZero();
    for (int i = 0; i < 3; ++i) {
      contact.point += contact.barycentric[i] * context.state.positions[corners[i]];
      rest += contact.barycentric[i] * context.model().rest.positions[corners[i]];
    }
    // How far it was pushed, and what is left of the instrument below it where it could not be pushed all the way.
    const double target = contact.depth;
    const double reached = contact.direction.dot(contact.point);
    contact.depth = std::max(0.0, std::max(target, reached) - contact.direction.dot(rest));
    for (int i = 0; i < 3; ++i) {
      double& depth = context.state.depths[corners[i]];
      depth = std::max(depth, contact.barycentric[i] * contact.depth);
    }
    Wrench& wrench = context.report.wrenches[contact.instrument];
    wrench.force -= contact.force;
    wrench.torque -= (contact.point - context.motion.instruments[contact.instrument].to.position).cross(contact.force);
    context.report.contacts.push_back(contact);
  }
}

void end_report(StepReport& report) {
  StepProfile& p = report.profile;
  p.total = p.refit + p.detection + p.penetration + p.propagation + p.response + p.deformation + p.health;
}

}  // namespace tissue_sim
