#include "tissue_sim/simulation/vertex_block_descent.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tissue_sim/geometry/elementary.h"
#include "tissue_sim/tissue/energy.h"

namespace tissue_sim {

namespace {

/// s; one sweep a millisecond is exact at rest and leaves a few percent in motion.
constexpr double sweep_period = 1e-3;

/// How much stiffer than the vertices that bear it a shared contact point is held. A much stiffer one would lock its
/// vertices in the places where the first sweep put them.
constexpr double shared_stiffness = 2.0;

/// The fastest vibration's angle in a step from which on a step may start at a part of its way only. Blocks of nu 0.499
/// went bad from 4.6 on, walls from 7.
constexpr double long_step = 2.0;

/// Constraint elements at vertex v. Damped along their gradient by what all their vertices moved since the start.
template <class Kind>
void add_elements(const std::vector<Kind>& elements, const FlatLists& at, int v, const std::vector<Vector3>& positions,
                  const std::vector<Vector3>& start, double dt, LocalStiffness& local) {
  if (elements.empty()) return;
  ElementVectors<Kind> gradient;
  for (const int* item = at.begin(v); item != at.end(v); ++item) {
    const std::size_t corner = static_cast<std::size_t>(*item) % Kind::size;
    const Kind& element = elements[static_cast<std::size_t>(*item) / Kind::size];
    const ElementVectors<Kind> x = gather(element, positions);
    const double c = element.evaluate(x, gradient);
    double moved = 0.0;
    for (std::size_t i = 0; i < Kind::size; ++i) moved += gradient[i].dot(x[i] - start[element.vertices[i]]);
    const double slowed = element.damping / dt;
    local.gradient += (element.stiffness * c + slowed * moved) * gradient[corner];
    local.block += element.block(x, corner) + slowed * gradient[corner] * gradient[corner].transpose();
  }
}

/// All constraint elements at vertex v.
void add_elements(const RestShape& rest, const Incidence& at, int v, const std::vector<Vector3>& positions,
                  const std::vector<Vector3>& start, double dt, LocalStiffness& local) {
  add_elements(rest.distances, at.distances, v, positions, start, dt, local);
  add_elements(rest.areas, at.areas, v, positions, start, dt, local);
  add_elements(rest.volumes, at.volumes, v, positions, start, dt, local);
}

/// In one write of 16 bytes: the next vertex reads it whole, and would have to wait for three.
void put(const Vector3& displacement, Eigen::Vector4f& where) {
  using Four = float __attribute__((vector_size(16)));
  const Four four = {static_cast<float>(displacement.x()), static_cast<float>(displacement.y()),
                     static_cast<float>(displacement.z()), 0.0F};
  std::memcpy(where.data(), &four, sizeof four);
}

/// Undamped.
void measure_displacements(const RestShape& rest, const std::vector<Vector3>& positions, DescentRoom& room) {
  for (std::size_t v = 0; v < room.displacements.size(); ++v) {
    put(positions[v] - rest.positions[v], room.displacements[v]);
  }
}

/// With a third of the products of the general one, and one division.
Matrix3 inverse_of_symmetric(const Matrix3& a) {
  const double xx = a(1, 1) * a(2, 2) - a(1, 2) * a(1, 2);
  const double xy = a(0, 2) * a(1, 2) - a(0, 1) * a(2, 2);
  const double xz = a(0, 1) * a(1, 2) - a(0, 2) * a(1, 1);
  const double yy = a(0, 0) * a(2, 2) - a(0, 2) * a(0, 2);
  const double yz = a(0, 1) * a(0, 2) - a(0, 0) * a(1, 2);
  const double zz = a(0, 0) * a(1, 1) - a(0, 1) * a(0, 1);
  Matrix3 inverse;
  inverse << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return 1.0 / (a(0, 0) * xx + a(0, 1) * xy + a(0, 2) * xz) * inverse;
}

/// Gradient of the enclosed volume's constraint by one vertex, 1/m: the triangles around it.
Vector3 enclosed_gradient(const RestShape& rest, int v, const std::vector<Vector3>& positions) {
  Vector3 sum = Vector3::Zero();
  const FlatLists& triangles = rest.wall_topology().vertex_triangles;
  for (const int* t = triangles.begin(v); t != triangles.end(v); ++t) {
    const Triangle& corners = rest.wall_triangles()[*t];
    const int i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
    sum += (positions[corners[(i + 1) % 3]] - positions[v]).cross(positions[corners[(i + 2) % 3]] - positions[v]);
  }
  return sum / (6.0 * rest.enclosed.rest);
}

/// One step of one organ: what all of its vertices share while they are swept over.
class Descent {
 public:
  Descent(const OrganModel& organ, double dt, std::vector<ContactPoint>& points, OrganState& state, DescentRoom& room)
      : organ_(organ),
        dt_(dt),
        inertia_((1.0 + dt * organ.drag) / (dt * dt)),
        damping_(organ.rest.damping_time / dt),
        is_long_(dt * organ.rest.fastest_frequency > long_step),
        corner_sum_(corner_sum()),
        points_(points),
        state_(state),
        room_(room) {}

  void start(const Vector3& gravity);
  void sweep();
  double finish(const Vector3& gravity);

 private:
  const RestShape& rest() const { return organ_.rest; }
  bool moves(int v) const { return rest().inverse_mass[v] > 0.0 && !state_.holds(static_cast<std::size_t>(v)); }
  double inertia(int v) const { return inertia_ * rest().mass[v]; }
  void place(int v, const Vector3& position);
  double motion() const;
  double work_of(const Vector3& gravity) const;
  double elastic(const std::vector<Vector3>& positions) const {
    return elastic_energy(rest(), positions, room_.scratch);
  }
  double part_of_the_way(double slowed, const Vector3& gravity);
  double part_of_the_speed(const Vector3& gravity);
  LocalStiffness of_tetrahedra(int v) const {
    if (room_.displacements.empty()) return {};
    return corner_sum_(organ_.incidence.tetrahedra, v, room_.displacements.data());
  }
  LocalStiffness look_around(int v) const;
  double push(const ContactPoint& point, double weight, const Vector3& step) const;
  Vector3 free_step(int v, LocalStiffness& local, Matrix3& inverse);
  Vector3 stop_step(int v, const Matrix3& inverse, Vector3 step);

  const OrganModel& organ_;
  const double dt_;
  const double inertia_;  ///< 1/s^2
  const double damping_;  ///< how much the damping adds to the tetrahedra's blocks
  const bool is_long_;    ///< the step is: energies are looked at
  const CornerSum corner_sum_;
  std::vector<ContactPoint>& points_;
  OrganState& state_;
  DescentRoom& room_;
  double enclosed_ = 0.0;  ///< the enclosed volume's constraint, kept up with every vertex that moves
  double enclosed_at_start_ = 0.0;
  double motion_at_start_ = 0.0;   ///< J, of long steps, as is
  double elastic_at_start_ = 0.0;  ///< J
};

void Descent::start(const Vector3& gravity) {
  room_.start = state_.positions;
  if (is_long_) {
    motion_at_start_ = motion();
    elastic_at_start_ = elastic(room_.start);
  }
  measure_displacements(rest(), state_.positions, room_);
  if (rest().enclosed.stiffness > 0.0) {
    enclosed_at_start_ = rest().enclosed.evaluate(state_.positions, rest().wall_triangles(), room_.inertial);
    enclosed_ = enclosed_at_start_;
  }
  const double slowed = 1.0 / (1.0 + dt_ * organ_.drag);
  const int vertices = static_cast<int>(state_.positions.size());
  for (int v = rest().first_simulated; v < vertices; ++v) {
    if (!moves(v)) continue;
    room_.inertial[v] = state_.positions[v] + slowed * dt_ * (state_.velocities[v] + dt_ * gravity);
  }
  // From where the vertices are on their way to, not from where they are: else one sweep a step is all drag, and takes
  // ten times as long to come to rest. Only now, since a place belongs to its neighbours' volumes too.
  for (int v = rest().first_simulated; v < vertices; ++v) {
    if (moves(v)) place(v, state_.positions[v] + slowed * dt_ * state_.velocities[v]);
  }
  const double part = part_of_the_way(slowed, gravity);
  for (int v = rest().first_simulated; part < 1.0 && v < vertices; ++v) {
    if (moves(v)) place(v, room_.start[v] + part * slowed * dt_ * state_.velocities[v]);
  }

  room_.pressing.clear();
  for (std::size_t p = 0; p < points_.size(); ++p) {
    ContactPoint& point = points_[p];
    double yielding = 0.0;  // of the point: m/N
    for (int i = 0; i < point.bearers.count; ++i) {
      const int v = point.bearers.vertices[i];
      if (!moves(v)) continue;
      yielding += square(point.bearers.weights[i]) / (organ_.incidence.stiffness[v] + inertia(v));
      room_.pressing.push_back({static_cast<int>(p), point.bearers.weights[i], room_.first_of[v], false});
      room_.first_of[v] = static_cast<int>(room_.pressing.size()) - 1;
    }
    point.stiffness = yielding > 0.0 ? shared_stiffness / yielding : 0.0;
  }
}

/// A sweep of a long step reaches only a little of what the elements ask for, above all in tissue that hardly yields:
/// the motion goes on into places that take a hundred times the energy it has. A block of 0.2 mm edges, E 500 Pa,
/// nu 0.499, went on after a press until it had turned inside out. So where the way costs more energy than the motion
/// has, what contacts and gravity give included, the step starts at the part of it that an exact step along it would
/// go.
double Descent::part_of_the_way(double slowed, const Vector3& gravity) {
  if (!is_long_) return 1.0;
  double work = work_of(gravity);  // J, and of the contacts, as they pressed before
  for (const ContactPoint& point : points_) {
    const Vector3 way = at_point(point, state_.positions) - at_point(point, room_.start);
    work += std::max(0.0, point.force * point.direction.dot(way));
  }
  const double motion = square(slowed) * motion_at_start_;
  const double taken_up = elastic(state_.positions) - elastic_at_start_ - work;
  return taken_up > motion ? motion / (motion + taken_up) : 1.0;
}

/// What sweeps leave undone of a long step can leave more energy than there was: a block of 20 mm edges, E 6 kPa,
/// nu 0.499, had five times as much after 3,000 steps alone. Where no instrument gives any, the motion pays.
double Descent::part_of_the_speed(const Vector3& gravity) {
  if (!is_long_ || !points_.empty()) return 1.0;
  const double now = motion();
  const double left = motion_at_start_ + elastic_at_start_ + work_of(gravity) - elastic(state_.positions);
  return now > left ? std::sqrt(std::max(0.0, left) / now) : 1.0;
}

/// J.
double Descent::motion() const {
  double twice = 0.0;
  for (std::size_t v = rest().first_simulated; v < state_.velocities.size(); ++v) {
    if (moves(static_cast<int>(v))) twice += rest().mass[v] * state_.velocities[v].squaredNorm();
  }
  return 0.5 * twice;
}

/// J, since the start.
double Descent::work_of(const Vector3& gravity) const {
  double work = 0.0;
  for (std::size_t v = rest().first_simulated; v < state_.positions.size(); ++v) {
    if (moves(static_cast<int>(v))) work += rest().mass[v] * gravity.dot(state_.positions[v] - room_.start[v]);
  }
  return work;
}

void Descent::place(int v, const Vector3& position) {
  if (rest().enclosed.stiffness > 0.0) {
    enclosed_ += enclosed_gradient(rest(), v, state_.positions).dot(position - state_.positions[v]);
  }
  state_.positions[v] = position;
  if (room_.displacements.empty()) return;
  put(position - rest().positions[v] + damping_ * (position - room_.start[v]), room_.displacements[v]);
}

LocalStiffness Descent::look_around(int v) const {
  LocalStiffness local = of_tetrahedra(v);
  local.block *= 1.0 + damping_;
  add_elements(rest(), organ_.incidence, v, state_.positions, room_.start, dt_, local);
  if (rest().enclosed.stiffness > 0.0) {
    const EnclosedVolume& enclosed = rest().enclosed;
    const Vector3 gradient = enclosed_gradient(rest(), v, state_.positions);
    const double slowed = enclosed.damping / dt_;
    local.gradient += (enclosed.stiffness * enclosed_ + slowed * (enclosed_ - enclosed_at_start_)) * gradient;
    local.block += (enclosed.stiffness + slowed) * gradient * gradient.transpose();
  }
  return local;
}

/// N, along the point's direction, when one of its vertices has gone by `step` with `weight`.
double Descent::push(const ContactPoint& point, double weight, const Vector3& step) const {
  const double behind = point.target - point.direction.dot(at_point(point, state_.positions) + weight * step);
  return std::max(0.0, point.force + point.stiffness * behind);
}

/// The step that takes the vertex to the minimum of its local energy, contact points that it shares with others
/// included as soon as they press at its beginning or at its end.
Vector3 Descent::free_step(int v, LocalStiffness& local, Matrix3& inverse) {
  Vector3 step = Vector3::Zero();
  for (int round = 0; round < 2; ++round) {
    bool pressed = round == 0;
    for (int i = room_.first_of[v]; i >= 0; i = room_.pressing[i].next) {
      DescentRoom::Pressing& pressing = room_.pressing[i];
      const ContactPoint& point = points_[pressing.point];
      if (point.bearers.count == 1 || (round > 0 && pressing.active)) continue;
      pressing.active = push(point, pressing.weight, step) > 0.0;
      if (!pressing.active) continue;
      const double behind = point.target - point.direction.dot(at_point(point, state_.positions));
      local.gradient -= pressing.weight * (point.force + point.stiffness * behind) * point.direction;
      local.block += square(pressing.weight) * point.stiffness * point.direction * point.direction.transpose();
      pressed = true;
    }
    if (!pressed) break;
    inverse = inverse_of_symmetric(local.block);
    step = -(inverse * local.gradient);
  }
  return step;
}

/// Contact points that the vertex bears alone are met exactly: the lowest local energy in front of the instrument.
Vector3 Descent::stop_step(int v, const Matrix3& inverse, Vector3 step) {
  for (int i = room_.first_of[v]; i >= 0; i = room_.pressing[i].next) {
    ContactPoint& point = points_[room_.pressing[i].point];
    if (point.bearers.count != 1) continue;
    const double behind = point.target - point.direction.dot(state_.positions[v] + step);
    const Vector3 along = inverse * point.direction;
    point.force = std::max(0.0, behind / point.direction.dot(along));
    step += point.force * along;
  }
  return step;
}

void Descent::sweep() {
  const int vertices = static_cast<int>(state_.positions.size());
  for (int v = rest().first_simulated; v < vertices; ++v) {
    if (!moves(v)) continue;
    LocalStiffness local = look_around(v);
    local.gradient += inertia(v) * (state_.positions[v] - room_.inertial[v]);
    local.block.diagonal().array() += inertia(v);
    Matrix3 inverse = Matrix3::Zero();
    const Vector3 step = free_step(v, local, inverse);
    place(v, state_.positions[v] + stop_step(v, inverse, step));
  }
  for (ContactPoint& point : points_) {
    if (point.bearers.count > 1) point.force = push(point, 0.0, Vector3::Zero());
  }
}

double Descent::finish(const Vector3& gravity) {
  double fastest = 0.0;
  const int vertices = static_cast<int>(state_.positions.size());
  for (int v = rest().first_simulated; v < vertices; ++v) {
    room_.first_of[v] = -1;
    if (rest().attached[v]) continue;
    state_.velocities[v] = (state_.positions[v] - room_.start[v]) / dt_;
    fastest = std::max(fastest, state_.velocities[v].squaredNorm());
  }
  const double part = part_of_the_speed(gravity);
  for (int v = rest().first_simulated; part < 1.0 && v < vertices; ++v) state_.velocities[v] *= part;
  return part * std::sqrt(fastest);
}

/// What vertex v sees of all elements but the enclosed volume, without damping. Wants undamped displacements in the
/// room.
LocalStiffness look_around(const RestShape& rest, const Incidence& incidence, int v,
                           const std::vector<Vector3>& positions, const DescentRoom& room, CornerSum sum) {
  LocalStiffness local;
  if (!room.displacements.empty()) local = sum(incidence.tetrahedra, v, room.displacements.data());
  add_elements(rest, incidence, v, positions, positions, 1.0, local);
  return local;
}

/// The stiffness (N/m) that a vertex meets on its own at rest: a third of the trace of its block.
std::vector<double> vertex_stiffness(const RestShape& rest, const Incidence& incidence) {
  DescentRoom room;
  prepare(room, rest);
  std::vector<double> stiffness;
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    const int vertex = static_cast<int>(v);
    const LocalStiffness local = look_around(rest, incidence, vertex, rest.positions, room, corner_sum());
    stiffness.push_back(local.block.trace() / 3.0);
  }
  return stiffness;
}

}  // namespace

Incidence build_incidence(const RestShape& rest) {
  const std::size_t vertices = rest.positions.size();
  Incidence incidence;
  incidence.distances = corners_of(rest.distances, vertices);
  incidence.areas = corners_of(rest.areas, vertices);
  incidence.volumes = corners_of(rest.volumes, vertices);
  incidence.tetrahedra = pack_corners(rest.tetrahedra, vertices);
  incidence.stiffness = vertex_stiffness(rest, incidence);
  return incidence;
}

void prepare(DescentRoom& room, const RestShape& rest) {
  room.start = rest.positions;
  room.inertial = rest.positions;
  room.scratch = rest.positions;
  if (!rest.tetrahedra.empty()) room.displacements.assign(rest.positions.size(), Eigen::Vector4f::Zero());
  room.first_of.assign(rest.positions.size(), -1);
}

double descend(const OrganModel& organ, const Vector3& gravity, double dt, std::vector<ContactPoint>& points,
               OrganState& state, DescentRoom& room) {
  const TinyIsZero tiny_is_zero;
  Descent descent(organ, dt, points, state, room);
  descent.start(gravity);
  const int sweeps = std::max(1, static_cast<int>(std::ceil(dt / sweep_period - 1e-9)));
  for (int i = 0; i < sweeps; ++i) descent.sweep();
  return descent.finish(gravity);
}

void bearing_forces(const OrganModel& organ, const std::vector<ContactPoint>& points, const OrganState& state,
                    DescentRoom& room, std::vector<Vector3>& forces) {
  if (points.empty()) return;
  const TinyIsZero tiny_is_zero;
  const CornerSum sum = corner_sum();
  const RestShape& rest = organ.rest;
  measure_displacements(rest, state.positions, room);
  const bool encloses = rest.enclosed.stiffness > 0.0;
  const double enclosed =
      encloses ? rest.enclosed.evaluate(state.positions, rest.wall_triangles(), room.inertial) : 0.0;
  constexpr int done = 0;  // vertices bear many points where an organ is folded over an instrument
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) {
      const int v = point.bearers.vertices[i];
      if (room.first_of[v] == done) continue;
      forces[v] = -look_around(rest, organ.incidence, v, state.positions, room, sum).gradient;
      if (encloses) forces[v] -= rest.enclosed.stiffness * enclosed * enclosed_gradient(rest, v, state.positions);
      room.first_of[v] = done;
    }
  }
  for (const ContactPoint& point : points) {
    for (int i = 0; i < point.bearers.count; ++i) room.first_of[point.bearers.vertices[i]] = -1;
  }
}

}  // namespace tissue_sim
