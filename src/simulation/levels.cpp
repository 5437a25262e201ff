#include "tissue_sim/simulation/levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tissue_sim {

namespace {

/// s. What no instrument touches any more stays awake for this long.
constexpr double awake_after_contact = 0.3;

/// Of an edge: contact points closer than this to a centre need none of their own.
constexpr double centre_spacing = 0.5;

/// Of the radius of a wall's region: the same there. A region is recentred by as much.
constexpr double wall_centre_spacing = 0.125;

/// s. ... and no longer than this while something else is touched.
constexpr double longest_awake = 1.0;

/// Of an edge: what is no farther from rest, now or in `settling_time` (s), is put to rest.
constexpr double settled = 0.01;
constexpr double settling_time = 0.01;

/// Centres of a wall that are made room for from the start.
constexpr std::size_t usual_centres = 64;

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
  if (of_level.region.mark[v] == Part::asleep) return by_coarser(model, level, v, state);
  const Vector3& velocity = of_level.velocities[v];
  return {of_level.positions[v] - of_level.ahead * velocity - shape_of(model, level).positions[v], velocity};
}

/// The driven vertices go where the coarser level has them, and the band's targets with them.
void follow(const OrganModel& model, std::size_t level, OrganState& state) {
  const LevelView at = view(model, level, state);
  for (const int v : at.region.driven) {
    const Moved to = by_coarser(model, level, v, state);
    at.positions[v] = at.shape.positions[v] + to.displacement;
    at.velocities[v] = to.velocity;
  }
  for (BandVertex& band : at.region.band) {
    const Moved to = by_coarser(model, level, band.vertex, state);
    band.target = at.shape.positions[band.vertex] + to.displacement;
    band.velocity = to.velocity;
  }
}

/// The same for the time dt (s) in which the coarser level moves on in a line.
void follow_on(double dt, const LevelView& at) {
  for (const int v : at.region.driven) at.positions[v] += dt * at.velocities[v];
  for (BandVertex& band : at.region.band) band.target += dt * band.velocity;
}

/// N/m of a band's spring: 0 where the band begins, and what fixes the vertex at the radius. No stiffer than a substep
/// of dt (s) is stable for.
double band_stiffness(double reach, double mass, double modulus_times_edge, double dt) {
  return std::min(3.0 * modulus_times_edge * reach * reach / (1.01 - std::min(reach, 1.0)), 0.25 * mass / (dt * dt));
}

void wake_level(const OrganModel& model, std::size_t level, OrganState& state, RegionRoom& room, double& farthest) {
  const LevelView at = view(model, level, state);
  recentre(model.regions[level], at.shape, state.centres, at.region, room);
  for (const int v : room.fallen) {
    const Moved to = by_coarser(model, level, v, state);
    const Vector3 place = at.shape.positions[v] + to.displacement;
    farthest = std::max(farthest, (place - at.positions[v]).norm());
    at.positions[v] = place;
    at.velocities[v].setZero();
  }
  for (const int v : room.woken) {
    const Moved to = by_coarser(model, level, v, state);
    at.positions[v] = at.shape.positions[v] + to.displacement;
    at.velocities[v] = to.velocity;
  }
  follow(model, level, state);
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
  recentre(model.regions.front(), model.rest, state.centres, state.region, room);
  double farthest = 0.0;
  for (const int v : room.fallen) {
    farthest = std::max(farthest, (model.rest.positions[v] - state.positions[v]).norm());
    state.positions[v] = model.rest.positions[v];
    state.velocities[v].setZero();
  }
  return farthest;
}

double edge_of(const OrganModel& model, std::size_t level) {
  return level == 0 ? model.fine_edge : model.levels[level - 1].edge;
}

/// Gives the nodes around every pin the velocities at which it stays, or comes back, to its rest place.
void hold_pins(const Level& level, double dt, const LevelView& at) {
  for (std::size_t p = 0; p < level.pins.corners.size(); ++p) {
    const Tetrahedron& corners = level.pins.corners[p];
    const std::array<double, 4>& weights = level.pins.weights[p];
    // A pin of which a corner is asleep lies outside the region: the coarser level holds it.
    const auto asleep = [&](int v) { return at.region.mark[v] == Part::asleep; };
    if (std::any_of(corners.begin(), corners.end(), asleep)) continue;
    Vector3 velocity = Vector3::Zero();
    double ease = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int v = corners[i];
      velocity += weights[i] * (at.velocities[v] + pin_return / dt * (at.positions[v] - at.shape.positions[v]));
      ease += weights[i] * weights[i] * at.shape.inverse_mass[v];
    }
    for (std::size_t i = 0; i < 4; ++i) {
      if (at.region.mark[corners[i]] != Part::free) continue;  // driven: where the coarser level has it
      at.velocities[corners[i]] -= weights[i] * at.shape.inverse_mass[corners[i]] / ease * velocity;
    }
  }
}

/// One explicit substep of a coarser level: elements, what the contacts pushed, band. Returns the largest speed, m/s.
double move_level(const OrganModel& model, std::size_t level, const Vector3& gravity, double dt, OrganState& state,
                  ElementRoom& room) {
  const LevelView at = view(model, level, state);
  LevelState& own = state.levels[level - 1];
  element_forces(at.shape, {at.positions, at.velocities}, at.region.active, own.forces, room);
  const double slowed = 1.0 / (1.0 + dt * model.drag);
  double fastest = 0.0;
  const double stiffness = model.shear_modulus * edge_of(model, level);
  for (const BandVertex& band : at.region.band) {
    const double k = band_stiffness(band.reach, at.shape.mass[band.vertex], stiffness, dt);
    own.push[band.vertex] += dt * k * (band.target - at.positions[band.vertex]);
  }
  for (const int v : at.region.free) {
    at.velocities[v] =
        slowed * (at.velocities[v] + at.shape.inverse_mass[v] * (dt * own.forces[v] + own.push[v]) + dt * gravity);
    own.push[v].setZero();
  }
  hold_pins(model.levels[level - 1], dt, at);
  for (const int v : at.region.free) {
    at.positions[v] += dt * at.velocities[v];
    fastest = std::max(fastest, at.velocities[v].squaredNorm());
  }
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
  room.elements.resize(model.levels.size());
  room.regions.resize(model.regions.size());
  for (std::size_t level = 0; level < model.levels.size(); ++level) {
    prepare(room.elements[level], model.levels[level].shape);
  }
  for (std::size_t level = 0; level < model.regions.size(); ++level) {
    prepare(room.regions[level], shape_of(model, level));
  }
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
    at.forces = at.velocities;
    at.region.mark.assign(at.positions.size(), Part::asleep);
  }
  // The coarsest is always awake.
  ActiveRegion& coarsest = state.levels.back().region;
  std::fill(coarsest.mark.begin(), coarsest.mark.end(), Part::free);
  for (std::size_t v = 0; v < coarsest.mark.size(); ++v) coarsest.free.push_back(static_cast<int>(v));
  coarsest.active.vertices = coarsest.free;
  for (std::size_t b = 0; b < model.levels.back().shape.packed.batches.size(); ++b) {
    coarsest.active.tetrahedra.push_back(static_cast<int>(b));
  }
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
  for (std::size_t level = model.levels.size(); level-- > 0;) {
    wake_level(model, level, state, room.regions[level], farthest);
  }
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
  double fastest = 0.0;
  for (std::size_t level = model.levels.size(); level > 0; --level) {
    LevelState& at = state.levels[level - 1];
    const int every = substeps / at.substeps;
    const bool begins = (substep - 1) % every == 0;
    if (begins) at.speed = move_level(model, level, gravity, every * dt, state, room.elements[level - 1]);
    fastest = std::max(fastest, at.speed);
    if (!begins) continue;
    if (level < model.levels.size()) follow_on(every * dt, view(model, level, state));
    at.ahead = every * dt;
    follow(model, level - 1, state);  // from where it is now: what has been followed so far ends here
  }
  for (std::size_t p = 0; p < state.untouched.size(); ++p) state.untouched[p] += dt;
  return fastest;
}

void add_band_forces(const OrganModel& model, double dt, OrganState& state) {
  const double stiffness = model.shear_modulus * model.fine_edge;
  for (const BandVertex& band : state.region.band) {
    const double k = band_stiffness(band.reach, model.rest.mass[band.vertex], stiffness, dt);
    state.forces[band.vertex] += k * (band.target - state.positions[band.vertex]);
  }
}

void follow_coarser(const OrganModel& model, double dt, OrganState& state) {
  for (LevelState& level : state.levels) level.ahead = std::max(0.0, level.ahead - dt);
  follow_on(dt, view(model, 0, state));
}

void press_coarser(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state) {
  const auto press = [&](std::size_t level, int v, const Vector3& impulse, auto&& self) -> void {
    if (level > 0) state.levels[level - 1].push[v] += impulse;
    if (level == model.levels.size()) return;
    const Embedding& bearing = model.levels[level].bearing;
    for (std::size_t i = 0; i < 4; ++i) {
      self(level + 1, bearing.corners[v][i], bearing.weights[v][i] * impulse, self);
    }
  };
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      press(0, point.bearers.vertices[i], point.bearers.weights[i] * point.impulse * point.direction, press);
    }
  }
}

bool moves_less_than_it_shows(const OrganModel& model) {
  return model.rest.first_simulated > 0 || !model.levels.empty();
}

void place(const OrganModel& model, const int* first, const int* last, OrganState& state) {
  for (const int* v = first; v != last; ++v) {
    if (*v < model.rest.first_simulated) {
      carry(model.rest, *v, state.positions);
    } else if (!model.levels.empty() && state.region.mark[*v] == Part::asleep) {
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
