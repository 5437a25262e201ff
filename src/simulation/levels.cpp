#include "tissue_sim/simulation/levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tissue_sim {

namespace {

/// s. What no instrument touches any more stays awake for this long.
constexpr double awake_after_contact = 0.3;

/// Of an edge: contact points closer than this to a centre need none of their own, and a region stays as it is while
/// every contact point has such a centre and every centre a contact point within twice as much.
constexpr double centre_spacing = 0.7;

/// Of the radius of a wall's region: the same there. A region is recentred by as much.
constexpr double wall_centre_spacing = 0.125;

/// s. ... and no longer than this while something else is touched.
constexpr double longest_awake = 1.0;

/// Of an edge: what is no farther from rest, now or in `settling_time` (s), is put to rest.
constexpr double settled = 0.01;
constexpr double settling_time = 0.01;

/// Centres of a wall that are made room for from the start.
constexpr std::size_t usual_centres = 64;

/// Of mu times the edge: a band's spring.
constexpr double band_stiffness = 1.5;

/// Of the way: what a pin that has strayed comes back in one substep.
constexpr double pin_return = 0.2;

/// The arrays of one level of an organ, the organ's own tetrahedra being level 0.
struct LevelView {
  const RestShape& shape;
  std::vector<Vector3>& positions;
  std::vector<Vector3>& velocities;
  ActiveRegion& region;
};

const RestShape& shape_of(const OrganModel& model, std::size_t level) {
  return level == 0 ? model.rest : model.levels[level - 1].shape;
}

LevelView view(const OrganModel& model, std::size_t level, OrganState& state) {
  if (level == 0) return {model.rest, state.positions, state.velocities, state.region};
  LevelState& of_level = state.levels[level - 1];
  return {model.levels[level - 1].shape, of_level.positions, of_level.velocities, of_level.region};
}

/// How far a vertex is from its rest place, and how fast.
struct Moved {
  Vector3 displacement = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
};

/// By the level itself where the vertex is awake, else by the levels above it. A coarser level may be ahead of the
/// substep that the finer ones are in: it moves in a line between two of its substeps.
Moved moved(const OrganModel& model, std::size_t level, int v, const OrganState& state);

Moved by_coarser(const OrganModel& model, std::size_t level, int v, const OrganState& state) {
  if (shape_of(model, level).attached[v]) return {};  // the pins hold only their middle in place
  const Embedding& embedding = model.levels[level].finer;
  Moved sum;
  for (std::size_t i = 0; i < 4; ++i) {
    const double weight = embedding.weights[v][i];
    const Moved corner = moved(model, level + 1, embedding.corners[v][i], state);
    sum.displacement += weight * corner.displacement;
    sum.velocity += weight * corner.velocity;
  }
  return sum;
}

Moved moved(const OrganModel& model, std::size_t level, int v, const OrganState& state) {
  if (level == 0) return by_coarser(model, level, v, state);
  const LevelState& of_level = state.levels[level - 1];
  if (of_level.region.mark[v] != Part::free) return by_coarser(model, level, v, state);
  const Vector3& velocity = of_level.velocities[v];
  return {of_level.positions[v] - of_level.ahead * velocity - shape_of(model, level).positions[v], velocity};
}

double edge_of(const OrganModel& model, std::size_t level) {
  return level == 0 ? model.fine_edge : model.levels[level - 1].edge;
}

bool any_within(const std::vector<Vector3>& places, const Vector3& of, double distance) {
  return std::any_of(places.begin(), places.end(),
                     [&](const Vector3& place) { return (place - of).squaredNorm() < distance * distance; });
}

/// Makes the centres of a region anew around `touched`, a list a piece, unless they still are around it.
bool move_centres(const std::vector<std::vector<Vector3>>& touched, double spacing, std::vector<Vector3>& centres) {
  bool still = true;
  for (const std::vector<Vector3>& of_piece : touched) {
    for (const Vector3& place : of_piece) still = still && any_within(centres, place, spacing);
  }
  for (const Vector3& centre : centres) {
    bool near = false;
    for (const std::vector<Vector3>& of_piece : touched) near = near || any_within(of_piece, centre, 2.0 * spacing);
    still = still && near;
  }
  if (still) return false;
  centres.clear();
  for (const std::vector<Vector3>& of_piece : touched) {
    for (const Vector3& place : of_piece) {
      if (!any_within(centres, place, spacing)) centres.push_back(place);
    }
  }
  return true;
}

const Embedding& pins_of(const OrganModel& model, std::size_t level) {
  static const Embedding none;  // attached vertices of the organ itself do not move
  return level == 0 ? none : model.levels[level - 1].pins;
}

/// Whether the region is another one now.
bool wake_level(const OrganModel& model, std::size_t level, OrganState& state, LevelsRoom& room, double& farthest) {
  const LevelView at = view(model, level, state);
  AwakeSolid& awake = room.awake[level];
  const double edge = edge_of(model, level);
  if (!move_centres(state.centres, centre_spacing * edge, at.region.centres) && awake.made_from == at.region.centres) {
    return false;
  }
  RegionRoom& changed = room.regions[level];
  recentre(model.regions[level], at.shape, at.region, changed);
  for (const int v : changed.fallen) {
    const Moved to = by_coarser(model, level, v, state);
    const Vector3 place = at.shape.positions[v] + to.displacement;
    farthest = std::max(farthest, (place - at.positions[v]).norm());
    at.positions[v] = place;
    at.velocities[v].setZero();
  }
  for (const int v : changed.woken) {
    const Moved to = by_coarser(model, level, v, state);
    at.positions[v] = at.shape.positions[v] + to.displacement;
    at.velocities[v] = to.velocity;
  }
  gather(model.regions[level], at.shape, pins_of(model, level), at.region, changed,
         band_stiffness * model.shear_modulus * edge, awake);
  return true;
}

/// m; any displacement will do that moves with the organ.
Vector3 common_displacement(const OrganModel& model, const OrganState& state) {
  return state.levels.back().positions.front() - model.levels.back().shape.positions.front();
}

/// Everything that follows a coarser level goes where that is now.
void follow_all(const OrganModel& model, OrganState& state, LevelsRoom& room) {
  room.common = common_displacement(model, state);
  for (AwakeSolid& awake : room.awake) carry_nothing(awake);
  for (std::size_t level = 0; level < model.levels.size(); ++level) {
    carry_finer(model.levels[level].finer, shape_of(model, level).attached, room.awake[level], room.awake[level + 1]);
  }
  for (std::size_t level = model.levels.size() + 1; level-- > 0;) {
    const LevelView at = view(model, level, state);
    const double ahead = level == 0 ? 0.0 : state.levels[level - 1].ahead;
    read_motion(at.shape, at.positions, at.velocities, ahead, room.common, room.awake[level]);
    if (level < model.levels.size()) follow(room.awake[level + 1], room.common, room.awake[level]);
  }
}

/// Whether what only centre `c` keeps awake is at rest.
bool is_settled(const OrganModel& model, const OrganState& state, std::size_t c) {
  const std::vector<Vector3>& centres = state.centres.front();
  const double reach = model.regions.front().radius * model.regions.front().radius;
  const double limit = settled * model.fine_edge;
  for (const int v : state.region.free) {
    const Vector3& place = model.rest.positions[v];
    if ((place - centres[c]).squaredNorm() >= reach) continue;
    bool shared = false;
    for (std::size_t i = 0; i < centres.size(); ++i) shared |= i != c && (place - centres[i]).squaredNorm() < reach;
    if (shared) continue;
    const double away = (state.positions[v] - place).norm() + settling_time * state.velocities[v].norm();
    if (!(away < limit)) return false;
  }
  return true;
}

/// Of a wall, where nothing sleeps but what is at rest. A centre stays until what it keeps awake has come back: one a
/// call is let go, the first of the list.
double wake_wall(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state,
                 RegionRoom& room) {
  const double spacing = wall_centre_spacing * model.regions.front().radius;
  std::vector<Vector3>& centres = state.centres.front();
  bool changed = false;
  if (state.asleep) {
    changed = !centres.empty();
    centres.clear();
    state.untouched.clear();
  }
  for (const ContactPoint& point : points) {
    const Vector3 place = at_point(point, model.rest.positions);
    std::size_t c = 0;
    while (c < centres.size() && (centres[c] - place).squaredNorm() >= spacing * spacing) ++c;
    if (c < centres.size()) {
      state.untouched[c] = 0.0;
      continue;
    }
    centres.push_back(place);
    state.untouched.push_back(0.0);
    changed = true;
  }
  for (std::size_t c = 0; c < centres.size(); ++c) {
    if (state.untouched[c] <= awake_after_contact) continue;
    const bool long_ago = !points.empty() && state.untouched[c] > longest_awake;
    if (!long_ago && !is_settled(model, state, c)) continue;
    centres.erase(centres.begin() + static_cast<std::ptrdiff_t>(c));
    state.untouched.erase(state.untouched.begin() + static_cast<std::ptrdiff_t>(c));
    changed = true;
    break;
  }
  if (!changed) return 0.0;
  state.region.centres = centres;
  recentre(model.regions.front(), model.rest, state.region, room);
  double farthest = 0.0;
  for (const int v : room.fallen) {
    farthest = std::max(farthest, (model.rest.positions[v] - state.positions[v]).norm());
    state.positions[v] = model.rest.positions[v];
    state.velocities[v].setZero();
  }
  return farthest;
}

/// Gives the nodes around every pin the velocities at which it stays, or comes back, to its rest place.
void hold_pins(const RestShape& shape, double dt, const Vector3& common, const AwakeSolid& awake,
               std::vector<Vector3>& velocities) {
  for (const Pin& pin : awake.pins) {
    Vector3 velocity = pin_return / dt * common;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto corner = static_cast<std::size_t>(pin.corners[i]);
      const Vector3 moves = corner < awake.free ? velocities[awake.vertices[corner]]
                                                : Vector3(awake.velocities[corner].head<3>().cast<double>());
      const Vector3 displacement = awake.displacements[corner].head<3>().cast<double>();
      velocity += pin.weights[i] * (moves + pin_return / dt * displacement);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      if (static_cast<std::size_t>(pin.corners[i]) >= awake.free) continue;  // where the coarser level has it
      const int v = awake.vertices[pin.corners[i]];
      velocities[v] -= pin.weights[i] * shape.inverse_mass[v] / pin.ease * velocity;
    }
  }
}

/// One explicit substep of a coarser level: elements, band, what the contacts pushed. Returns the largest speed, m/s.
double move_level(const OrganModel& model, std::size_t level, const Vector3& gravity, double dt, OrganState& state,
                  LevelsRoom& room) {
  const LevelView at = view(model, level, state);
  LevelState& own = state.levels[level - 1];
  AwakeSolid& awake = room.awake[level];
  read_motion(at.shape, at.positions, at.velocities, 0.0, room.common, awake);
  solid_forces(at.shape, dt, awake);
  const double slowed = 1.0 / (1.0 + dt * model.drag);
  for (std::size_t i = 0; i < awake.free; ++i) {
    const int v = awake.vertices[i];
    const Vector3 force = awake.forces[i].head<3>().cast<double>();
    at.velocities[v] =
        slowed * (at.velocities[v] + at.shape.inverse_mass[v] * (dt * force + own.push[v]) + dt * gravity);
    own.push[v].setZero();
  }
  hold_pins(at.shape, dt, room.common, awake, at.velocities);
  double fastest = 0.0;
  for (std::size_t i = 0; i < awake.free; ++i) {
    const int v = awake.vertices[i];
    at.positions[v] += dt * at.velocities[v];
    awake.velocities[i].head<3>() = at.velocities[v].cast<float>();
    fastest = std::max(fastest, at.velocities[v].squaredNorm());
  }
  own.ahead = dt;
  follow(awake, room.common, room.awake[level - 1]);
  follow_on(dt, awake);
  return std::sqrt(fastest);
}

/// What a substep of an organ's own tetrahedra costs over that of a coarser level, about, as both are awake.
constexpr int own_cost = 4;

/// The smallest divisor of `number` that is at least `least`, which is at most `number`.
int divisor(int number, int least) {
  int found = least;
  while (number % found != 0) ++found;
  return found;
}

}  // namespace

void prepare(LevelsRoom& room, const OrganModel& model) {
  room.regions.resize(model.regions.size());
  for (std::size_t level = 0; level < model.regions.size(); ++level) {
    prepare(room.regions[level], shape_of(model, level));
  }
  if (model.levels.empty()) return;
  room.awake.resize(model.levels.size() + 1);
  room.handed.resize(model.levels.size() + 1);
  for (std::size_t level = 0; level <= model.levels.size(); ++level) {
    prepare(room.awake[level], shape_of(model, level));
    room.handed[level].impulses.assign(shape_of(model, level).positions.size(), Vector3::Zero());
    room.handed[level].vertices.reserve(usual_contacts);
  }
  gather_all(model.levels.back().shape, model.levels.back().pins, room.awake.back());
}

void rest_levels(const OrganModel& model, std::size_t pieces, OrganState& state) {
  state.region.mark.assign(model.rest.positions.size(), Part::asleep);
  if (model.levels.empty()) {  // a wall
    state.centres.resize(1);
    state.centres.front().reserve(usual_centres);
    state.untouched.reserve(usual_centres);
    return;
  }
  state.centres.assign(pieces, {});
  state.untouched.assign(pieces, 0.0);
  for (const Level& level : model.levels) {
    LevelState& at = state.levels.emplace_back();
    at.positions = level.shape.positions;
    at.velocities.assign(at.positions.size(), Vector3::Zero());
    at.push = at.velocities;
    at.region.mark.assign(at.positions.size(), Part::asleep);
  }
  // The coarsest is always awake.
  ActiveRegion& coarsest = state.levels.back().region;
  std::fill(coarsest.mark.begin(), coarsest.mark.end(), Part::free);
  for (std::size_t v = 0; v < coarsest.mark.size(); ++v) coarsest.free.push_back(static_cast<int>(v));
  coarsest.active.vertices = coarsest.free;
}

double wake(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state, LevelsRoom& room) {
  if (model.levels.empty()) return wake_wall(model, points, state, room.regions.front());
  const double spacing = centre_spacing * model.fine_edge;
  std::vector<char>& seen = room.touching;
  seen.assign(state.centres.size(), 0);
  for (const ContactPoint& point : points) {
    std::vector<Vector3>& centres = state.centres[point.piece];
    if (!seen[point.piece]) centres.clear();
    seen[point.piece] = 1;
    state.untouched[point.piece] = 0.0;
    const Vector3 place = at_point(point, model.rest.positions);
    bool covered = false;
    for (const Vector3& centre : centres) covered = covered || (centre - place).squaredNorm() < spacing * spacing;
    if (!covered) centres.push_back(place);
  }
  for (std::size_t p = 0; p < seen.size(); ++p) {
    if (!seen[p] && state.untouched[p] > awake_after_contact) state.centres[p].clear();
  }
  double farthest = 0.0;
  bool changed = false;
  for (std::size_t level = model.levels.size(); level-- > 0;) {
    changed = wake_level(model, level, state, room, farthest) || changed;
  }
  if (changed) follow_all(model, state, room);
  return farthest;
}

void share_substeps(const OrganModel& model, double duration, OrganState& state, int& substeps) {
  int needed = 1;
  for (std::size_t level = model.levels.size(); level-- > 0;) {
    needed = std::max(needed, substeps_for(model.levels[level].shape, duration));
    state.levels[level].substeps = needed;  // at least
  }
  substeps = std::max(substeps, needed);
  // 13 would make every level take 13, 16 the finest more than it needs: of 13 to 25 the cheapest is 15, 3, 3, 1.
  int cheapest = substeps;
  int least = std::numeric_limits<int>::max();
  for (int own = substeps; own < 2 * substeps; ++own) {
    int cost = own_cost * own;
    int finer = own;
    for (const LevelState& level : state.levels) cost += finer = divisor(finer, level.substeps);
    if (cost < least) {
      least = cost;
      cheapest = own;
    }
  }
  substeps = cheapest;
  int finer = substeps;
  for (LevelState& level : state.levels) level.substeps = finer = divisor(finer, level.substeps);
}

double move_coarser(const OrganModel& model, const Vector3& gravity, int substep, int substeps, double dt,
                    OrganState& state, LevelsRoom& room) {
  // All levels begin a substep with the first: what is measured from here is measured anew.
  if (substep == 1) room.common = common_displacement(model, state);
  double fastest = 0.0;
  for (std::size_t level = model.levels.size(); level > 0; --level) {
    LevelState& at = state.levels[level - 1];
    const int every = substeps / at.substeps;
    const bool begins = (substep - 1) % every == 0;
    if (begins) at.speed = move_level(model, level, gravity, every * dt, state, room);
    fastest = std::max(fastest, at.speed);
  }
  for (std::size_t p = 0; p < state.untouched.size(); ++p) state.untouched[p] += dt;
  return fastest;
}

void solid_forces(const OrganModel& model, double dt, OrganState& state, LevelsRoom& room) {
  AwakeSolid& awake = room.awake.front();
  read_motion(model.rest, state.positions, state.velocities, 0.0, room.common, awake);
  solid_forces(model.rest, dt, awake);
  for (std::size_t i = 0; i < awake.free; ++i) {
    state.forces[awake.vertices[i]] = awake.forces[i].head<3>().cast<double>();
  }
}

void follow_coarser(double dt, OrganState& state, LevelsRoom& room) {
  for (LevelState& level : state.levels) level.ahead = std::max(0.0, level.ahead - dt);
  follow_on(dt, room.awake.front());
}

void press_coarser(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state,
                   LevelsRoom& room) {
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      const Vector3 impulse = point.bearers.weights[i] * point.impulse * point.direction;
      room.handed.front().add(point.bearers.vertices[i], impulse);
    }
  }
  for (std::size_t level = 0; level < model.levels.size(); ++level) {
    const Embedding& bearing = model.levels[level].bearing;
    std::vector<Vector3>& push = state.levels[level].push;
    room.handed[level].take_all([&](int v, const Vector3& impulse) {
      for (std::size_t i = 0; i < 4; ++i) {
        const Vector3 share = bearing.weights[v][i] * impulse;
        push[bearing.corners[v][i]] += share;
        if (level + 1 < model.levels.size()) room.handed[level + 1].add(bearing.corners[v][i], share);
      }
    });
  }
}

bool moves_less_than_it_shows(const OrganModel& model) {
  return model.rest.first_simulated > 0 || !model.levels.empty();
}

void place(const OrganModel& model, const int* first, const int* last, OrganState& state) {
  for (const int* v = first; v != last; ++v) {
    if (*v < model.rest.first_simulated) {
      carry(model.rest, *v, state.positions);
    } else if (!model.levels.empty() && state.region.mark[*v] != Part::free) {
      state.positions[*v] = model.rest.positions[*v] + by_coarser(model, 0, *v, state).displacement;
    }
  }
}

namespace {

void place_first(const OrganModel& model, int count, OrganState& state) {
  if (!moves_less_than_it_shows(model)) return;
  for (int v = 0; v < count; ++v) place(model, &v, &v + 1, state);
}

}  // namespace

void place(const OrganModel& model, int triangle, OrganState& state) {
  const Triangle& corners = model.rest.triangles[triangle];
  if (moves_less_than_it_shows(model)) place(model, corners.data(), corners.data() + corners.size(), state);
}

void place_surface(const OrganModel& model, OrganState& state) {
  place_first(model, model.rest.surface_vertices, state);
}

void place_all(const OrganModel& model, OrganState& state) {
  place_first(model, static_cast<int>(state.positions.size()), state);
}

}  // namespace tissue_sim
