#include "tissue_sim/simulation/integrator.h"

#include <gtest/gtest.h>

#include <set>

#include "geometry/twins.h"
#include "simulation/test_scenes.h"

namespace tissue_sim::integrator_test {
namespace {

Organ solid_block(Model model) {
  Organ organ;
  organ.name = "block";
  organ.solid = make_block({0.02, 0.02, 0.01}, {6, 6, 3});
  organ.mesh = take_surface(organ.solid);
  organ.model = model;
  organ.integrator = Integrator::explicit_substeps;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.attached = {0};
  return organ;
}

/// Organs with all kinds of elements, moved at random.
struct Moved {
  explicit Moved(const Organ& organ) : world(build_world(scene_of(organ, {ball(0.005)}))), state(rest_state(world, 0)) {
    Random random(3);
    for (Vector3& p : state.positions) p += random_point(random, 0.05 * rest().mean_edge);
    for (Vector3& v : state.velocities) v += random_point(random, 5.0 * rest().mean_edge);
    prepare(room, rest());
  }
  const RestShape& rest() const { return world.organs.front().rest; }
  std::vector<Vector3> forces() {
    std::vector<Vector3> all(state.positions.size());
    element_forces(rest(), state, all, room);
    return all;
  }

  World world;
  OrganState state;
  ElementRoom room;
};

std::vector<Organ> organs() {
  return {wall_sphere(16), solid_block(Model::volume), solid_block(Model::fem)};
}

TEST(ElementForces, AreThoseOfThePlainElements) {
  for (const Organ& organ : organs()) {
    Moved moved(organ);
    const RestShape& rest = moved.rest();
    std::vector<Vector3> expected(moved.state.positions.size(), Vector3::Zero());
    const StiffnessLimit limit = {rest.inverse_mass, 1.5 * rest.stiffest_element};
    const auto add = [&](const auto& elements) {
      for (const auto& e : elements) add_forces(e, limit, moved.state.positions, moved.state.velocities, expected);
    };
    add(rest.distances);
    add(rest.areas);
    add(rest.volumes);
    if (rest.enclosed.stiffness > 0.0) {
      std::vector<Vector3> gradient(expected.size());
      const double c = rest.enclosed.evaluate(moved.state.positions, rest.triangles, gradient);
      double rate = 0.0;
      for (std::size_t v = 0; v < expected.size(); ++v) rate += gradient[v].dot(moved.state.velocities[v]);
      const double pull = rest.enclosed.stiffness * c + rest.enclosed.damping * rate;
      for (std::size_t v = 0; v < expected.size(); ++v) expected[v] -= pull * gradient[v];
    }
    std::vector<Vector3> ahead = moved.state.positions;
    for (std::size_t v = 0; v < ahead.size(); ++v) ahead[v] += rest.damping_time * moved.state.velocities[v];
    NeoHookeanElement::Vectors gradient;
    for (const NeoHookeanElement& e : rest.tetrahedra) {
      e.evaluate(gather(e, ahead), gradient);
      for (std::size_t i = 0; i < 4; ++i) expected[e.vertices[i]] -= gradient[i];
    }
    double size = 0.0;
    for (const Vector3& f : expected) size = std::max(size, f.norm());
    const std::vector<Vector3> forces = moved.forces();
    for (std::size_t v = 0; v < forces.size(); ++v) EXPECT_LT((forces[v] - expected[v]).norm(), 1e-5 * size) << v;
  }
}

/// Far from where it was at rest a float has no digits left for the strain: only what is left of the whole's way
/// counts.
TEST(ElementForces, OfAnOrganThatHasGoneFarAreTheSame) {
  for (Organ organ : organs()) {
    organ.attached.clear();
    Moved moved(organ);
    const std::vector<Vector3> near = moved.forces();
    for (Vector3& p : moved.state.positions) p += Vector3(40.0, -30.0, 20.0);
    for (Vector3& v : moved.state.velocities) v += Vector3(0.0, 100.0, 50.0);
    const std::vector<Vector3> far = moved.forces();
    double size = 0.0;
    for (const Vector3& f : near) size = std::max(size, f.norm());
    for (std::size_t v = 0; v < near.size(); ++v) EXPECT_LT((far[v] - near[v]).norm(), 1e-5 * size) << v;
  }
}

/// Batches that have a vertex for which `chosen`, and all of their vertices.
template <class Batch, class Corners>
std::vector<int> batches_at(const std::vector<Batch>& batches, const Corners& corners, const std::set<int>& chosen,
                            std::set<int>& vertices) {
  std::vector<int> list;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    const std::vector<int> of_batch = corners(batches[b]);
    const bool touches = std::any_of(of_batch.begin(), of_batch.end(), [&](int v) { return chosen.count(v) > 0; });
    if (!touches) continue;
    list.push_back(static_cast<int>(b));
    vertices.insert(of_batch.begin(), of_batch.end());
  }
  return list;
}

template <class Rows>
std::vector<int> flat(const Rows& rows, int divisor) {
  std::vector<int> all;
  for (const auto& row : rows) {
    for (const int v : row) all.push_back(v / divisor);
  }
  return all;
}

TEST(ElementForces, OfAPartOfAWallAreTheSameBitsWhereAllElementsAreInIt) {
  for (const Organ& organ : organs()) {
    Moved moved(organ);
    const RestShape& rest = moved.rest();
    if (!rest.tetrahedra.empty()) continue;
    const std::vector<Vector3> whole = moved.forces();
    const std::set<int> chosen = {20, 21, 33};
    std::set<int> vertices;
    ActiveElements active;
    const auto of_batch = [](const auto& batch) { return flat(batch.vertices, 8); };
    active.constraints.pairs = batches_at(
        rest.constraints.pairs, [](const PairBatch& b) { return flat(b.flap.vertices, 8); }, chosen, vertices);
    active.constraints.flaps = batches_at(rest.constraints.flaps, of_batch, chosen, vertices);
    active.constraints.triangles = batches_at(rest.constraints.triangles, of_batch, chosen, vertices);
    active.constraints.distances = batches_at(rest.constraints.distances, of_batch, chosen, vertices);
    active.vertices.assign(vertices.begin(), vertices.end());
    ASSERT_LT(active.vertices.size(), whole.size());

    const Vector3 before(1.0, 2.0, 3.0);
    std::vector<Vector3> forces(whole.size(), before);
    element_forces(rest, moved.state, active, forces, moved.room);
    for (const int v : chosen) EXPECT_EQ(forces[v], whole[v]);
    for (std::size_t v = 0; v < forces.size(); ++v) {
      if (vertices.count(static_cast<int>(v)) > 0) continue;
      EXPECT_EQ(forces[v], before) << "not of the part";
    }
  }
}

}  // namespace
}  // namespace tissue_sim::integrator_test
