#include "tissue_sim/simulation/integrator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tissue_sim {

namespace {

/// How much stiffer than the stiffest at rest an element may become, as squared frequency. 4 would do for one mode at
/// the safety of 0.4, but around a vertex many stretch at once: 4 let a sphere's poles run away when it was pressed
/// flat, 2 only just did not.
constexpr double covered_stiffening = 1.5;

/// The same for tetrahedra, which are not softened: beyond it their substeps get shorter. 1.4 would do for one
/// tetrahedron at the safety of 0.7. A probe of 3 mm pressed 10 mm into tetrahedra of 1 to 1.5 mm went bad in every
/// step with that, and in none with 1.0 or 0.7.
constexpr double solid_stiffening = 0.7;

/// 1/s^2, at most, of the element by itself.
double squared_frequency(const RestShape& rest, const NeoHookeanElement& element,
                         const std::vector<Vector3>& positions) {
  const std::array<double, 4> stiffnesses = element.stiffnesses(gather(element, positions));
  double fastest = 0.0;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    fastest = std::max(fastest, stiffnesses[corner] * rest.inverse_mass[element.vertices[corner]]);
  }
  return fastest;
}

/// All vertices that are simulated, or those of a list.
struct EveryVertex {
  std::size_t first;
  std::size_t count;
  std::size_t operator[](std::size_t i) const { return first + i; }
  std::size_t size() const { return count; }
};
struct SomeVertices {
  const std::vector<int>& list;
  std::size_t operator[](std::size_t i) const { return static_cast<std::size_t>(list[i]); }
  std::size_t size() const { return list.size(); }
};

/// Elements from which on an organ is cut into chunks, a tetrahedron as two of the others: 0.15 ms a substep. Two
/// threads gain 1.5 to 1.8 times from there on, 1.35 on a wall of 32,000. One thread loses 0 to 4 % on organs from
/// files and up to 9 % on a sphere whose triangles are in order as they are.
constexpr std::size_t many_elements = 40000;

/// Enough for eight threads, and for two that do not get on equally; each costs a layer of vertices that is summed
/// twice.
constexpr int chunks_of_many = 8;

/// What tetrahedra read of the vertices. They are damped by evaluating them where the vertices will be after
/// damping_time.
void read_for_tetrahedra(const RestShape& rest, const Moving& moving, const EveryVertex& vertices, ElementRoom& room) {
  const auto moved = [&](std::size_t v) -> Vector3 {
    return moving.positions[v] - rest.positions[v] + rest.damping_time * moving.velocities[v];
  };
  const Vector3 whole = moved(room.reference);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::size_t v = vertices[i];
    const Vector3 displacement = moved(v) - whole;
    room.displacements[v] << displacement.cast<float>(), 0.0F;
    room.forces[v].setZero();
  }
}

void write_of_tetrahedra(const EveryVertex& vertices, const ElementRoom& room, std::vector<Vector3>& forces) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::size_t v = vertices[i];
    forces[v] = room.forces[v].head<3>().cast<double>();
  }
}

/// How hard the enclosed volume pulls on its gradient by the vertices' normals, N/m^2. Its change is summed in double,
/// lane by lane: of a million triangles' shares a float would keep no digit of a small one.
template <class ForEachShare>
double enclosed_pull(const EnclosedVolume& enclosed, const ForEachShare& for_each_share) {
  if (!(enclosed.stiffness > 0.0)) return 0.0;
  std::array<double, constraint_lanes> changes{};
  std::array<double, constraint_lanes> rates{};
  for_each_share([&](const EnclosedShare& share) {
    for (std::size_t l = 0; l < constraint_lanes; ++l) changes[l] += static_cast<double>(share.change[l]);
    for (std::size_t l = 0; l < constraint_lanes; ++l) rates[l] += static_cast<double>(share.rate[l]);
  });
  double change = 0.0;
  double rate = 0.0;
  for (const double c : changes) change += c;
  for (const double r : rates) rate += r;
  const double sixth = 1.0 / (6.0 * enclosed.rest);
  return sixth * sixth * (enclosed.stiffness * change + enclosed.damping * rate);
}

auto all_shares(const ElementRoom& room) {
  return [&room](auto&& visit) {
    for (const EnclosedShare& share : room.shares) visit(share);
  };
}

/// What distance, area and volume elements read of the vertices.
template <class Vertices>
void read_for_constraints(const RestShape& rest, const Moving& moving, const Vertices& vertices, ElementRoom& room) {
  const Vector3 whole = moving.positions[room.reference] - rest.positions[room.reference];
  const Vector3 speed_of_whole = moving.velocities[room.reference];
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::size_t v = vertices[i];
    const Vector3 displacement = moving.positions[v] - rest.positions[v] - whole;
    const Vector3 velocity = moving.velocities[v] - speed_of_whole;
    VertexMotion& motion = room.motions[v];
    Eigen::Map<Eigen::Vector3f>(motion.displacement.data()) = displacement.cast<float>();
    Eigen::Map<Eigen::Vector3f>(motion.velocity.data()) = velocity.cast<float>();
    room.pulls[v] = VertexPull();
  }
}

/// `pull`: see enclosed_pull().
template <class Vertices>
void write_of_constraints(const Vertices& vertices, double pull, const ElementRoom& room,
                          std::vector<Vector3>& forces) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::size_t v = vertices[i];
    const Eigen::Map<const Eigen::Vector3f> force(room.pulls[v].force.data());
    const Eigen::Map<const Eigen::Vector3f> normal(room.pulls[v].normal.data());
    forces[v] = force.cast<double>() - pull * normal.cast<double>();
  }
}

/// The vertices of an organ that is cut into chunks, in parts for several threads.
struct VertexParts {
  const RestShape& rest;
  std::size_t parts;

  EveryVertex part(std::size_t i) const {
    const auto first = static_cast<std::size_t>(rest.first_simulated);
    const std::size_t count = rest.positions.size() - first;
    const std::size_t begin = count * i / parts;
    return {first + begin, count * (i + 1) / parts - begin};
  }

  /// Calls visit(vertex, stand-in) for those of a part, in the order of the chunks.
  template <class Visit>
  void visit_stand_ins(const EveryVertex& vertices, const Visit& visit) const {
    const auto before = [](const Seam& seam, std::size_t vertex) {
      return static_cast<std::size_t>(seam.vertex) < vertex;
    };
    const std::vector<Seam>& seams = rest.chunks.seams;
    const std::size_t end = vertices.first + vertices.count;
    auto seam = std::lower_bound(seams.begin(), seams.end(), vertices.first, before);
    for (; seam != seams.end() && static_cast<std::size_t>(seam->vertex) < end; ++seam) {
      for (int i = 0; i < seam->stand_ins; ++i) {
        visit(static_cast<std::size_t>(seam->vertex), static_cast<std::size_t>(seam->first_stand_in + i));
      }
    }
  }
};

void tetrahedra_in_chunks(const RestShape& rest, const Moving& moving, std::vector<Vector3>& forces, ElementRoom& room,
                          Threads* threads) {
  const std::vector<ElementChunk>& chunks = rest.chunks.chunks;
  const VertexParts vertices = {rest, chunks.size()};
  run(threads, vertices.parts, [&](std::size_t i) {
    const EveryVertex part = vertices.part(i);
    read_for_tetrahedra(rest, moving, part, room);
    vertices.visit_stand_ins(part, [&](std::size_t vertex, std::size_t stand_in) {
      room.displacements[stand_in] = room.displacements[vertex];
      room.forces[stand_in].setZero();
    });
  });
  run(threads, chunks.size(), [&](std::size_t c) {
    add_neo_hookean_forces(rest.packed, chunks[c].tetrahedra, room.displacements.front().data(),
                           room.forces.front().data());
  });
  run(threads, vertices.parts, [&](std::size_t i) {
    const EveryVertex part = vertices.part(i);
    vertices.visit_stand_ins(
        part, [&](std::size_t vertex, std::size_t stand_in) { room.forces[vertex] += room.forces[stand_in]; });
    write_of_tetrahedra(part, room, forces);
  });
}

void constraints_in_chunks(const RestShape& rest, const Moving& moving, std::vector<Vector3>& forces, ElementRoom& room,
                           Threads* threads) {
  const std::vector<ElementChunk>& chunks = rest.chunks.chunks;
  const VertexParts vertices = {rest, chunks.size()};
  run(threads, vertices.parts, [&](std::size_t i) {
    const EveryVertex part = vertices.part(i);
    read_for_constraints(rest, moving, part, room);
    vertices.visit_stand_ins(part, [&](std::size_t vertex, std::size_t stand_in) {
      room.motions[stand_in] = room.motions[vertex];
      room.pulls[stand_in] = VertexPull();
    });
  });
  run(threads, chunks.size(), [&](std::size_t c) {
    add_constraint_forces(rest.constraints, chunks[c].constraints, room.motions.data(), room.pulls.data(),
                          room.shares.data());
  });
  const double pull = enclosed_pull(rest.enclosed, all_shares(room));
  run(threads, vertices.parts, [&](std::size_t i) {
    const EveryVertex part = vertices.part(i);
    vertices.visit_stand_ins(part, [&](std::size_t vertex, std::size_t stand_in) {
      for (std::size_t k = 0; k < 3; ++k) room.pulls[vertex].force[k] += room.pulls[stand_in].force[k];
      for (std::size_t k = 0; k < 3; ++k) room.pulls[vertex].normal[k] += room.pulls[stand_in].normal[k];
    });
    write_of_constraints(part, pull, room, forces);
  });
}

}  // namespace

void pack_elements(RestShape& rest) {
  const bool surface = !rest.areas.empty() || rest.enclosed.stiffness > 0.0;
  rest.packed = pack(rest.tetrahedra);
  rest.constraints =
      pack(rest.distances, rest.areas, rest.volumes, surface ? rest.wall_triangles() : std::vector<Triangle>(),
           rest.positions, {rest.inverse_mass, covered_stiffening * rest.stiffest_element});
}

void cut_elements(RestShape& rest) {
  const std::size_t elements =
      2 * rest.tetrahedra.size() + rest.distances.size() + rest.areas.size() + rest.volumes.size();
  if (elements < many_elements) return;
  rest.chunks = cut_into_chunks(chunks_of_many, rest.positions, rest.packed, rest.constraints);
}

void prepare(ElementRoom& room, const RestShape& rest) {
  const std::size_t vertices = rest.positions.size() + static_cast<std::size_t>(rest.chunks.stand_ins);
  const auto attached = std::find(rest.attached.begin(), rest.attached.end(), 1);
  room.reference = attached != rest.attached.end() ? static_cast<std::size_t>(attached - rest.attached.begin())
                                                   : static_cast<std::size_t>(rest.first_simulated);
  if (!rest.packed.batches.empty()) {
    room.displacements.assign(vertices, Eigen::Vector4f::Zero());
    room.forces = room.displacements;
  }
  if (rest.constraints.empty()) return;
  room.motions.assign(vertices, VertexMotion());
  for (std::size_t v = 0; v < rest.positions.size(); ++v) {
    room.motions[v].inverse_mass = static_cast<float>(rest.inverse_mass[v]);
  }
  room.pulls.assign(vertices, VertexPull());
  room.shares.assign(rest.constraints.shares(), EnclosedShare());
}

int substeps_for(const RestShape& rest, double duration, double stiffening) {
  if (!rest.elastic()) return 1;
  const double shorter = std::sqrt(std::clamp(stiffening, solid_stiffening, most_stiffening) / solid_stiffening);
  const double substeps = std::ceil(shorter * duration / rest.stable_substep - 1e-9);
  return substeps < 1e9 ? std::max(1, static_cast<int>(substeps)) : 1'000'000'000;  // NaN too: no scene allows as many
}

double stiffening(const RestShape& rest, const FlatLists& tetrahedra_at, const std::vector<ContactPoint>& points,
                  const std::vector<Vector3>& positions, std::vector<int>& bearers) {
  if (rest.packed.batches.empty()) return 0.0;
  bearers.clear();
  for (const ContactPoint& point : points) {
    bearers.insert(bearers.end(), point.bearers.vertices.begin(), point.bearers.vertices.begin() + point.bearers.count);
  }
  std::sort(bearers.begin(), bearers.end());  // neighbours share most of theirs
  double stiffest = 0.0;
  int before = -1;
  for (const int v : bearers) {
    if (v == std::exchange(before, v)) continue;
    for (const int* t = tetrahedra_at.begin(v); t != tetrahedra_at.end(v); ++t) {
      stiffest = std::max(stiffest, squared_frequency(rest, rest.tetrahedra[*t], positions));
    }
  }
  return stiffest / rest.stiffest_element;
}

double stiffening(const RestShape& rest, const std::vector<Vector3>& positions) {
  double stiffest = 0.0;
  for (const NeoHookeanElement& element : rest.tetrahedra) {
    stiffest = std::max(stiffest, squared_frequency(rest, element, positions));
  }
  return rest.tetrahedra.empty() ? 0.0 : stiffest / rest.stiffest_element;
}

void element_forces(const RestShape& rest, const Moving& moving, std::vector<Vector3>& forces, ElementRoom& room,
                    Threads* threads) {
  const bool tetrahedra = !rest.packed.batches.empty();
  if (!rest.chunks.empty()) {
    return tetrahedra ? tetrahedra_in_chunks(rest, moving, forces, room, threads)
                      : constraints_in_chunks(rest, moving, forces, room, threads);
  }
  const auto first = static_cast<std::size_t>(rest.first_simulated);
  const EveryVertex vertices = {first, forces.size() - first};
  if (tetrahedra) {
    read_for_tetrahedra(rest, moving, vertices, room);
    add_neo_hookean_forces(rest.packed, room.displacements.front().data(), room.forces.front().data());
    write_of_tetrahedra(vertices, room, forces);
    return;
  }
  read_for_constraints(rest, moving, vertices, room);
  add_constraint_forces(rest.constraints, room.motions.data(), room.pulls.data(), room.shares.data());
  write_of_constraints(vertices, enclosed_pull(rest.enclosed, all_shares(room)), room, forces);
}

void element_forces(const RestShape& rest, const Moving& moving, const ActiveElements& active,
                    std::vector<Vector3>& forces, ElementRoom& room) {
  const SomeVertices vertices = {active.vertices};
  read_for_constraints(rest, moving, vertices, room);
  add_constraint_forces(rest.constraints, active.constraints, room.motions.data(), room.pulls.data(),
                        room.shares.data());
  const auto awake_shares = [&](auto&& visit) {
    for (const int pair : active.constraints.pairs) visit(room.shares[pair]);
    const std::size_t first = rest.constraints.pairs.size();
    for (const int triangle : active.constraints.triangles)
      visit(room.shares[first + static_cast<std::size_t>(triangle)]);
  };
  const double pull =
      active.others_rest ? enclosed_pull(rest.enclosed, awake_shares) : enclosed_pull(rest.enclosed, all_shares(room));
  write_of_constraints(vertices, pull, room, forces);
}

namespace {

/// Calls visit(vertex) for what is integrated now.
template <class Visit>
void for_each_free(const RestShape& rest, const OrganState& state, Visit&& visit) {
  if (state.wakes_in_parts()) {
    for (const int v : state.region.free) {
      if (!rest.attached[v]) visit(static_cast<std::size_t>(v));
    }
    return;
  }
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < state.positions.size(); ++v) {
    if (!rest.attached[v]) visit(v);
  }
}

}  // namespace

namespace {

// Arithmetic side by side, from and to plain arrays of vectors. As a `using` clang would drop the alignment.
typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));  // NOLINT(modernize-use-using)

/// The six numbers of two vectors that follow each other.
Two* numbers_of(Vector3& vector) {
  return reinterpret_cast<Two*>(vector.data());
}
const Two* numbers_of(const Vector3& vector) {
  return reinterpret_cast<const Two*>(vector.data());
}

/// Calls visit_two(vertex) for what is integrated now and its next neighbour, and visit(vertex) for what has none left.
template <class VisitTwo, class Visit>
void for_each_two_free(const RestShape& rest, const OrganState& state, VisitTwo&& visit_two, Visit&& visit) {
  if (state.wakes_in_parts() || !state.held.empty()) {
    for_each_free(rest, state, visit);
    return;
  }
  const std::size_t end = state.positions.size();
  for (std::size_t v = static_cast<std::size_t>(rest.first_simulated); v < end; ++v) {
    if (rest.attached[v]) continue;
    if (v + 1 == end || rest.attached[v + 1]) {
      visit(v);
      continue;
    }
    visit_two(v);
    ++v;
  }
}

}  // namespace

void accelerate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                OrganState& state) {
  const double slowed = 1.0 / (1.0 + dt * organ.drag);
  const Two gravity_of[3] = {{gravity.x(), gravity.y()}, {gravity.z(), gravity.x()}, {gravity.y(), gravity.z()}};
  const auto accelerate_two = [&](std::size_t v) {
    const double mass = organ.rest.inverse_mass[v];
    const double next = organ.rest.inverse_mass[v + 1];
    const Two inverse_mass[3] = {{mass, mass}, {mass, next}, {next, next}};
    const Two* force = numbers_of(forces[v]);
    Two* velocity = numbers_of(state.velocities[v]);
    for (std::size_t i = 0; i < 3; ++i) {
      velocity[i] = slowed * (velocity[i] + dt * (inverse_mass[i] * force[i] + gravity_of[i]));
    }
  };
  for_each_two_free(organ.rest, state, accelerate_two, [&](std::size_t v) {
    if (state.holds(v)) {
      state.velocities[v].setZero();
      return;
    }
    const Vector3 change = dt * (organ.rest.inverse_mass[v] * forces[v] + gravity);
    state.velocities[v] = slowed * (state.velocities[v] + change);
  });
}

double advance(const OrganModel& organ, double dt, OrganState& state) {
  double fastest = 0.0;
  Two fastest_two = {0.0, 0.0};
  const auto advance_two = [&](std::size_t v) {
    const Two* velocity = numbers_of(state.velocities[v]);
    Two* position = numbers_of(state.positions[v]);
    for (std::size_t i = 0; i < 3; ++i) position[i] += dt * velocity[i];
    const Two x = {velocity[0][0], velocity[1][1]};
    const Two y = {velocity[0][1], velocity[2][0]};
    const Two z = {velocity[1][0], velocity[2][1]};
    const Two squared = x * x + (y * y + z * z);  // in the order of squaredNorm()
    fastest_two = squared > fastest_two ? squared : fastest_two;
  };
  for_each_two_free(organ.rest, state, advance_two, [&](std::size_t v) {
    if (state.holds(v)) return;
    state.positions[v] += dt * state.velocities[v];
    fastest = std::max(fastest, state.velocities[v].squaredNorm());
  });
  return std::sqrt(std::max({fastest, fastest_two[0], fastest_two[1]}));
}

}  // namespace tissue_sim
