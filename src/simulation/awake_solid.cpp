#include "tissue_sim/simulation/awake_solid.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {

constexpr std::size_t lanes = NeoHookeanBatch::lanes;

/// Of critical, of a band's spring. Undamped, a wave that the coarser level does not share was thrown back into the
/// region: with a radius of five edges the force on a sliding probe swung by a third.
constexpr double band_damping = 1.4;

/// Of what a region needs when it is first gathered: it grows while an instrument goes in.
constexpr std::size_t spare = 2;

template <class Item>
void make_room(std::size_t count, std::vector<Item>& items) {
  if (items.capacity() < count) items.reserve(spare * count);
}

/// Number by number into where it goes: a vector put together elsewhere and copied whole waits for its halves.
void write_floats(const Vector3& v, Eigen::Vector4f& floats) {
  for (Eigen::Index i = 0; i < 3; ++i) floats[i] = static_cast<float>(v[i]);
  floats[3] = 0.0F;
}

/// The place of a vertex among the awake ones, where it is put last if it is not there.
int place_of(int vertex, AwakeSolid& awake) {
  int& place = awake.place[vertex];
  if (place < 0) {
    place = static_cast<int>(awake.vertices.size());
    awake.vertices.push_back(vertex);
  }
  return place;
}

void forget(AwakeSolid& awake) {
  for (const int v : awake.vertices) awake.place[v] = -1;
  awake.vertices.clear();
  awake.packed.batches.clear();
  awake.packed.tetrahedra = 0;
  awake.cubes.batches.clear();
  awake.cubes.cubes = 0;
  awake.band.clear();
  awake.pins.clear();
}

/// Copies the tetrahedron in a lane behind those that are there.
void add_tetrahedron(const NeoHookeanBatch& from, std::size_t l, AwakeSolid& awake) {
  NeoHookeanSolid& packed = awake.packed;
  const std::size_t to = packed.tetrahedra++ % lanes;
  if (to == 0) packed.batches.emplace_back();
  NeoHookeanBatch& batch = packed.batches.back();
  for (std::size_t i = 0; i < 4; ++i) batch.vertices[i][to] = place_of(from.vertices[i][l], awake);
  for (std::size_t i = 0; i < 9; ++i) batch.inverse_rest[i][to] = from.inverse_rest[i][l];
  batch.volume_mu[to] = from.volume_mu[l];
  batch.volume_stiff[to] = from.volume_stiff[l];
}

/// The lanes that are left repeat the last tetrahedron, as pack() has it.
void fill_last(NeoHookeanSolid& packed) {
  if (packed.tetrahedra % lanes == 0) return;
  NeoHookeanBatch& batch = packed.batches.back();
  const std::size_t last = packed.tetrahedra % lanes - 1;
  for (std::size_t l = last + 1; l < lanes; ++l) {
    for (auto& row : batch.vertices) row[l] = row[last];
    for (auto& row : batch.inverse_rest) row[l] = row[last];
    batch.volume_mu[l] = batch.volume_mu[last];
    batch.volume_stiff[l] = batch.volume_stiff[last];
  }
}

/// Tetrahedra of a cube without a free corner are left out, and so are corners that are theirs alone: nobody asks for
/// the forces there, and somebody would have to say where they are.
void gather_cube(const CubeBatch& from, std::size_t l, const ActiveRegion& region, AwakeSolid& awake) {
  std::array<bool, 6> wanted{};
  unsigned corners = 0;
  for (int n = 0; n < 6; ++n) {
    const std::array<int, 4> along = corners_along(n);
    const bool free = std::any_of(along.begin(), along.end(),
                                  [&](int corner) { return region.mark[from.vertices[corner][l]] == Part::free; });
    wanted[n] = free && from.volume_mu[n][l] > 0.0F;
    for (const int corner : along) corners |= wanted[n] ? 1U << static_cast<unsigned>(corner) : 0U;
  }
  if (corners == 0) return;
  add_cube(from, l, awake.cubes);
  CubeBatch& batch = awake.cubes.batches.back();
  const std::size_t to = (awake.cubes.cubes - 1) % CubeBatch::lanes;
  for (std::size_t i = 0; i < 8; ++i) {
    const std::size_t corner = (corners >> i & 1U) != 0 ? i : 0;  // all tetrahedra have the first
    batch.vertices[i][to] = place_of(from.vertices[corner][l], awake);
  }
  for (std::size_t n = 0; n < 6; ++n) {
    if (!wanted[n]) batch.volume_mu[n][to] = batch.volume_stiff[n][to] = 0.0F;
  }
}

void gather_tetrahedra(const NeoHookeanBatch& batch, std::size_t count, const ActiveRegion& region, AwakeSolid& awake) {
  for (std::size_t l = 0; l < count; ++l) {
    bool awake_corner = false;
    for (const auto& row : batch.vertices) awake_corner = awake_corner || region.mark[row[l]] == Part::free;
    if (awake_corner) add_tetrahedron(batch, l, awake);
  }
}

/// A pin of which a corner is asleep lies outside the region: the coarser level holds it.
void gather_pins(const RestShape& shape, const Embedding& pins, AwakeSolid& awake) {
  for (std::size_t p = 0; p < pins.corners.size(); ++p) {
    Pin pin;
    for (std::size_t i = 0; i < 4; ++i) {
      const int v = pins.corners[p][i];
      pin.corners[i] = awake.place[v];
      pin.weights[i] = pins.weights[p][i];
      pin.ease += pin.weights[i] * pin.weights[i] * shape.inverse_mass[v];
    }
    if (std::all_of(pin.corners.begin(), pin.corners.end(), [](int place) { return place >= 0; })) {
      awake.pins.push_back(pin);
    }
  }
}

void make_room_for_motion(AwakeSolid& awake) {
  for (std::vector<Eigen::Vector4f>* floats : {&awake.displacements, &awake.velocities, &awake.damped, &awake.forces}) {
    make_room(awake.vertices.size(), *floats);
    floats->resize(awake.vertices.size(), Eigen::Vector4f::Zero());
  }
}

Eigen::Vector4f combine(const std::vector<Eigen::Vector4f>& of, const Follower& follower) {
  const auto& [c, w] = std::tie(follower.corners, follower.weights);
  return (w[0] * of[c[0]] + w[1] * of[c[1]]) + (w[2] * of[c[2]] + w[3] * of[c[3]]);
}

}  // namespace

void prepare(AwakeSolid& awake, const RestShape& shape) {
  awake.place.assign(shape.positions.size(), -1);
}

void gather(const RegionModel& model, const RestShape& shape, const Embedding& pins, const ActiveRegion& region,
            const RegionRoom& room, double stiffness, AwakeSolid& awake) {
  forget(awake);
  awake.made_from = region.centres;
  make_room(2 * region.free.size(), awake.vertices);
  make_room(region.free.size(), awake.band);
  const bool is_lattice = shape.cubes.cubes > 0;
  make_room(is_lattice ? room.batches.size() : 0, awake.cubes.batches);
  make_room(is_lattice ? 0 : room.batches.size(), awake.packed.batches);
  awake.free = region.free.size();
  for (const int v : region.free) {
    const int place = place_of(v, awake);
    const double reach = 1.0 - (model.radius - room.distance[v]) / model.band;
    if (!(reach > 0.0)) continue;
    BandVertex& band = awake.band.emplace_back();
    band.vertex = place;
    band.mass = shape.mass[v];
    band.stiffness = stiffness * reach * reach / (1.01 - std::min(reach, 1.0));
    band.damping = 2.0 * band_damping * std::sqrt(band.stiffness * band.mass);
  }
  for (const int b : room.batches) {
    const auto batch = static_cast<std::size_t>(b);
    if (is_lattice) {
      const std::size_t count = std::min(CubeBatch::lanes, shape.cubes.cubes - CubeBatch::lanes * batch);
      for (std::size_t l = 0; l < count; ++l) gather_cube(shape.cubes.batches[batch], l, region, awake);
    } else {
      const std::size_t count = std::min(lanes, shape.packed.tetrahedra - lanes * batch);
      gather_tetrahedra(shape.packed.batches[batch], count, region, awake);
    }
  }
  fill_last(awake.packed);
  fill_last(awake.cubes);
  awake.corners = awake.vertices.size();
  gather_pins(shape, pins, awake);
  make_room_for_motion(awake);
}

void gather_all(const RestShape& shape, const Embedding& pins, AwakeSolid& awake) {
  forget(awake);
  for (std::size_t v = 0; v < shape.positions.size(); ++v) place_of(static_cast<int>(v), awake);
  awake.free = awake.corners = awake.vertices.size();
  awake.packed = shape.packed;
  awake.cubes = shape.cubes;
  gather_pins(shape, pins, awake);
  make_room_for_motion(awake);
}

void carry_nothing(AwakeSolid& awake) {
  for (std::size_t i = awake.corners; i < awake.vertices.size(); ++i) awake.place[awake.vertices[i]] = -1;
  awake.vertices.resize(awake.corners);
}

void carry_finer(const Embedding& embedding, const std::vector<char>& attached, AwakeSolid& finer,
                 AwakeSolid& coarser) {
  const auto follower_of = [&](int vertex) {
    Follower follower;
    follower.attached = attached[vertex] != 0;
    for (std::size_t i = 0; i < 4; ++i) {
      follower.corners[i] = place_of(embedding.corners[vertex][i], coarser);
      follower.weights[i] = static_cast<float>(embedding.weights[vertex][i]);
    }
    return follower;
  };
  make_room(finer.vertices.size(), finer.followers);
  finer.followers.clear();
  for (std::size_t i = finer.free; i < finer.vertices.size(); ++i) {
    finer.followers.push_back(follower_of(finer.vertices[i]));
  }
  for (BandVertex& band : finer.band) band.follower = follower_of(finer.vertices[band.vertex]);
  make_room_for_motion(coarser);
}

void read_motion(const RestShape& shape, const std::vector<Vector3>& positions, const std::vector<Vector3>& velocities,
                 double ahead, const Vector3& common, AwakeSolid& awake) {
  for (std::size_t i = 0; i < awake.free; ++i) {
    const int v = awake.vertices[i];
    write_floats(positions[v] - ahead * velocities[v] - shape.positions[v] - common, awake.displacements[i]);
    write_floats(velocities[v], awake.velocities[i]);
  }
}

void follow(const AwakeSolid& coarser, const Vector3& common, AwakeSolid& finer) {
  Eigen::Vector4f at_rest;
  write_floats(-common, at_rest);
  const auto go = [&](const Follower& follower, Eigen::Vector4f& displacement, Eigen::Vector4f& velocity) {
    if (follower.attached) {
      displacement = at_rest;
      velocity.setZero();
      return;
    }
    displacement = combine(coarser.displacements, follower);
    velocity = combine(coarser.velocities, follower);
  };
  for (std::size_t i = 0; i < finer.followers.size(); ++i) {
    go(finer.followers[i], finer.displacements[finer.free + i], finer.velocities[finer.free + i]);
  }
  for (BandVertex& band : finer.band) go(band.follower, band.target, band.velocity);
}

void follow_on(double dt, AwakeSolid& awake) {
  const auto way = static_cast<float>(dt);
  for (std::size_t i = awake.free; i < awake.vertices.size(); ++i) {
    awake.displacements[i] += way * awake.velocities[i];
  }
  for (BandVertex& band : awake.band) band.target += way * band.velocity;
}

void solid_forces(const RestShape& shape, double dt, AwakeSolid& awake) {
  const auto ahead = static_cast<float>(shape.damping_time);
  for (std::size_t i = 0; i < awake.corners; ++i) {
    awake.damped[i] = awake.displacements[i] + ahead * awake.velocities[i];
    awake.forces[i].setZero();
  }
  if (!awake.packed.batches.empty()) {
    add_neo_hookean_forces(awake.packed, awake.damped.front().data(), awake.forces.front().data());
  }
  if (!awake.cubes.batches.empty()) {
    add_cube_forces(awake.cubes, awake.damped.front().data(), awake.forces.front().data());
  }
  const double stiffest = 0.25 / (dt * dt);  // 1/s^2 and 1/s: what a substep can follow
  const double fastest = 0.5 / dt;
  for (const BandVertex& band : awake.band) {
    const auto stiffness = static_cast<float>(std::min(band.stiffness, stiffest * band.mass));
    const auto damping = static_cast<float>(std::min(band.damping, fastest * band.mass));
    awake.forces[band.vertex] += stiffness * (band.target - awake.displacements[band.vertex]) +
                                 damping * (band.velocity - awake.velocities[band.vertex]);
  }
}

}  // namespace tissue_sim
