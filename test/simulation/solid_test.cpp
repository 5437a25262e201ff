#include <gtest/gtest.h>

#include <set>

#include "simulation/solid_scenes.h"
#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/simulation/integrator.h"

namespace tissue_sim::solid_test {
namespace {

constexpr double radius = 0.006;  // m
constexpr double depth = 0.002;   // m
constexpr int slices = 24;

Simulation pressed(const Organ& organ, int settle = 400) {
  Simulation simulation(scene_of(organ, {round_ball(radius, slices)}));
  press(simulation, radius, depth, settle);
  return simulation;
}

std::set<int> bearing_vertices(Simulation& simulation) {
  std::set<int> bearing;
  for (const ContactPoint& point : simulation.workspace.organs[0].points) {
    for (int i = 0; i < point.bearers.count; ++i) bearing.insert(point.bearers.vertices[i]);
  }
  return bearing;
}

/// N, by the plain formula.
std::vector<Vector3> internal_forces(const RestShape& rest, const std::vector<Vector3>& positions) {
  std::vector<Vector3> forces(positions.size(), Vector3::Zero());
  NeoHookeanElement::Vectors gradient;
  for (const NeoHookeanElement& element : rest.tetrahedra) {
    element.evaluate(gather(element, positions), gradient);
    for (std::size_t i = 0; i < 4; ++i) forces[element.vertices[i]] -= gradient[i];
  }
  return forces;
}

/// What lies on the block's top presses up against the ball, and the ball presses down on the block.
TEST(SolidForce, AtRestIsThatOfTheTetrahedraAtTheContact) {
  Simulation simulation = pressed(soft_block(Model::fem, 4));
  EXPECT_LT(fastest_vertex(simulation.organ()), 1e-4);
  const Vector3& force = simulation.report.wrenches[0].force;
  EXPECT_GT(force.z(), 0.05) << "on the instrument, out of the organ";
  EXPECT_LT(force.head<2>().norm(), 0.1 * force.z());

  const std::vector<Vector3> internal = internal_forces(simulation.rest(), simulation.organ().positions);
  Vector3 held = Vector3::Zero();
  for (const int v : bearing_vertices(simulation)) held += internal[v];
  EXPECT_LT((force - held).norm(), 1e-3 * force.norm()) << force.transpose() << " N against " << held.transpose();

  Vector3 at_table = Vector3::Zero();
  for (std::size_t v = 0; v < internal.size(); ++v) {
    if (simulation.rest().attached[v]) at_table += internal[v];
  }
  EXPECT_LT((force + at_table).norm(), 1e-3 * force.norm()) << "the table bears what the ball presses";
}

TEST(SolidForce, IsTheImpulseOfTheResponseOverItsTimeAtRest) {
  Simulation simulation = pressed(soft_block(Model::fem, 4));
  const double dt = 1e-3 / simulation.report.substeps;
  const double drag = simulation.world.organs[0].drag;
  Vector3 impulse = Vector3::Zero();
  for (const ContactPoint& point : simulation.workspace.organs[0].points) impulse += point.impulse * point.direction;
  const Vector3 force = -(1.0 + dt * drag) / dt * impulse;
  const Vector3& reported = simulation.report.wrenches[0].force;
  EXPECT_LT((force - reported).norm(), 1e-3 * reported.norm())
      << force.transpose() << " N against " << reported.transpose();
}

TEST(SolidForce, OffTheTipItTurns) {
  // The same ball twice, the second carried by a tip 50 mm beside it.
  const Vector3 beside(0.05, 0.0, 0.0);
  const Organ organ = soft_block(Model::fem, 3);
  Simulation at_tip(scene_of(organ, {round_ball(radius, slices)}));
  Instrument hook = round_ball(radius, slices);
  for (Vector3& v : hook.parts[0].mesh.vertices) v += beside;
  Simulation off_tip(scene_of(organ, {hook}));
  const auto pose = [&](double d) { return Pose{{0.0003, 0.0002, radius - d}, Eigen::Quaterniond::Identity()}; };
  const auto hooked = [&](double d) { return Pose{pose(d).position - beside, Eigen::Quaterniond::Identity()}; };
  at_tip.start_at(pose(-0.0002));
  off_tip.start_at(hooked(-0.0002));
  at_tip.slide_to(pose(depth), 50);
  off_tip.slide_to(hooked(depth), 50);
  for (int i = 0; i < 400; ++i) at_tip.go_to(at_tip.poses[0]);
  for (int i = 0; i < 400; ++i) off_tip.go_to(off_tip.poses[0]);
  const Wrench& straight = at_tip.report.wrenches[0];
  const Wrench& turned = off_tip.report.wrenches[0];
  EXPECT_LT((straight.force - turned.force).norm(), 1e-3 * straight.force.norm());
  EXPECT_LT((turned.torque - straight.torque - beside.cross(straight.force)).norm(), 1e-3 * turned.torque.norm());
  EXPECT_LT(turned.torque.y(), -0.9 * 0.05 * straight.force.z());
  EXPECT_LT(straight.torque.norm(), 0.1 * turned.torque.norm()) << "towards the middle of a ball nothing turns";
}

TEST(SolidForce, WithoutAttachmentsAndDragTheOrganTakesTheImpulse) {
  Organ organ = soft_block(Model::fem, 3);
  organ.attached.clear();
  organ.material.drag = 0.0;
  Simulation simulation(scene_of(organ, {round_ball(radius, slices)}));
  const double dt = 0.7 * simulation.rest().stable_substep;  // one substep a step, stiffened by the contact or not
  simulation.start_at(ball_over_block(radius, -0.0001));
  const auto momentum = [&]() {
    Vector3 sum = Vector3::Zero();
    for (std::size_t v = 0; v < simulation.rest().mass.size(); ++v) {
      sum += simulation.rest().mass[v] * simulation.organ().velocities[v];
    }
    return sum;
  };
  Vector3 given = Vector3::Zero();
  for (int i = 1; i <= 300; ++i) {
    simulation.go_to(ball_over_block(radius, -0.0001 + 0.1 * i * dt), dt);  // 0.1 m/s
    ASSERT_EQ(simulation.report.substeps, 1);
    for (const ContactPoint& point : simulation.workspace.organs[0].points) given += point.impulse * point.direction;
  }
  ASSERT_LT(given.z(), -1e-4);
  EXPECT_LT((momentum() - given).norm(), 1e-4 * given.norm());
}

/// A large block, fine under the ball: `core` wide there, with cells that grow by a half from one to the next.
TetrahedralMesh graded_block(double fine, double core, double half) {
  std::vector<double> outward = {0.0};
  while (outward.back() < half) {
    const double last = outward.size() > 1 ? outward.back() - outward[outward.size() - 2] : fine;
    outward.push_back(outward.back() + (outward.back() < core ? fine : 1.5 * last));
  }
  std::vector<double> across;
  std::vector<double> down;
  for (std::size_t i = outward.size(); i-- > 1;) across.push_back(-outward[i]);
  for (const double x : outward) across.push_back(x);
  for (std::size_t i = outward.size(); i-- > 0;) down.push_back(-outward[i]);
  return make_block({across, across, down});
}

/// F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5 for a half-space. Here the circle of contact, of radius a = sqrt(R d), is seen
/// by edges of h = 1.5 mm and so up to half an edge too large: the force is too large by up to h / 2a, less what the
/// edges of a pressed circle carry less (0.4 h / a). The table below, as far as 11 such radii, and the contact margin
/// add 5 %. The static reference is held to 6 % on a finer mesh; this is about newtons, and the power of the depth.
TEST(SolidForce, OfABallOnALargeBlockIsThatOfHertz) {
  constexpr double ball = 0.010;
  constexpr double poisson = 0.3;  // linear tetrahedra stiffen towards 0.5
  constexpr double fine = 0.0015;
  const TetrahedralMesh mesh = graded_block(fine, 0.006, 0.05);
  const double bottom = mesh.vertices.front().z();
  Organ organ = solid_organ(mesh, {1.0, 1.0, -bottom}, Model::fem);
  organ.integrator = Integrator::explicit_substeps;
  organ.material.poisson = poisson;
  organ.material.drag = 60.0;
  Simulation simulation(scene_of(organ, {round_ball(ball, 48)}));
  std::vector<double> forces;
  for (const double d : {ball / 10.0, ball / 5.0}) {
    press(simulation, ball, d, 100);
    forces.push_back(simulation.report.wrenches[0].force.z());
    const double hertz = 4.0 / 3.0 * 5400.0 / (1.0 - poisson * poisson) * std::sqrt(ball) * std::pow(d, 1.5);
    EXPECT_GT(forces.back() / hertz, 1.0) << forces.back() << " N";
    EXPECT_LT(forces.back() / hertz, 1.05 + 0.4 * fine / std::sqrt(ball * d)) << forces.back() << " N";
    testing::Test::RecordProperty(d < 0.0015 ? "percent_at_tenth" : "percent_at_fifth",
                                  static_cast<int>(1000.0 * forces.back() / hertz));
  }
  EXPECT_NEAR(std::log2(forces[1] / forces[0]), 1.5, 0.1);
}

double relative_difference(const RestShape& rest, const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double difference = 0.0;
  double size = 0.0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    difference += (a[v] - b[v]).squaredNorm();
    size += (b[v] - rest.positions[v]).squaredNorm();
  }
  return std::sqrt(difference / size);
}

TEST(SolidIntegrators, AgreeAtRest) {
  for (const Model model : {Model::fem, Model::volume}) {
    Simulation one = pressed(soft_block(model, 4, Integrator::explicit_substeps));
    Simulation other = pressed(soft_block(model, 4, Integrator::vertex_block_descent), 800);
    EXPECT_LT(relative_difference(one.rest(), other.organ().positions, one.organ().positions), 2e-3);
    const Vector3& force = one.report.wrenches[0].force;
    EXPECT_LT((other.report.wrenches[0].force - force).norm(), 2e-3 * force.norm())
        << other.report.wrenches[0].force.transpose() << " N against " << force.transpose();
  }
}

TEST(SolidIntegrators, GiveTheSameBitsTwice) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    const Organ organ = soft_block(Model::fem, 2, integrator);
    EXPECT_EQ(pressed(organ, 50).hash(), pressed(organ, 50).hash());
    EXPECT_NE(pressed(organ, 50).hash(), pressed(organ, 51).hash());
  }
}

TEST(SolidIntegrators, VertexBlockDescentIsStableAtTheExtremes) {
  for (const double young : {500.0, 5.4e3, 1e6}) {
    for (const double poisson : {0.3, 0.49}) {
      for (const double duration : {0.001, 0.005, 0.020}) {
        Organ organ = soft_block(Model::fem, 3, Integrator::vertex_block_descent);
        organ.material.young = young;
        organ.material.poisson = poisson;
        Scene scene = scene_of(organ, {round_ball(radius, slices)});
        scene.time_step = duration;
        Simulation simulation(scene);
        simulation.start_at(ball_over_block(radius, -0.0002));
        double farthest = 0.0;
        int recoveries = 0;
        const auto go = [&](double d) {
          simulation.go_to(ball_over_block(radius, d), duration);
          recoveries += simulation.report.recovered ? 1 : 0;
          for (std::size_t v = 0; v < simulation.rest().positions.size(); ++v) {
            farthest = std::max(farthest, (simulation.organ().positions[v] - simulation.rest().positions[v]).norm());
          }
        };
        for (int i = 1; i <= 20; ++i) go(0.0001 * i);
        for (int i = 0; i < 100; ++i) go(depth);
        const std::string what = std::to_string(young) + " Pa, nu " + std::to_string(poisson) + ", steps of " +
                                 std::to_string(duration) + " s";
        EXPECT_FALSE(simulation.report.contacts.empty()) << what;
        EXPECT_EQ(recoveries, 0) << what;
        EXPECT_LT(farthest, 1.5 * depth) << what;
        go(-0.005);
        for (int i = 0; i < 1000 && !simulation.organ().asleep; ++i) go(-0.005);
        EXPECT_LT(rms_from_rest(simulation.rest(), simulation.organ().positions), 0.01e-3) << what;
        EXPECT_EQ(recoveries, 0) << what;
      }
    }
  }
}

TEST(SolidOrgan, ADentComesOut) {
  for (const Model model : {Model::fem, Model::volume}) {
    for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
      Simulation simulation = pressed(soft_block(model, 3, integrator), 100);
      simulation.slide_to(ball_over_block(radius, -0.005), 50);
      EXPECT_TRUE(simulation.report.contacts.empty());
      for (int i = 0; i < 1500 && !simulation.organ().asleep; ++i) simulation.go_to(simulation.poses[0]);
      EXPECT_LT(rms_from_rest(simulation.rest(), simulation.organ().positions), 1e-6);
    }
  }
}

TEST(SolidOrgan, WithoutRestorationItKeepsItsDent) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    Organ organ = soft_block(Model::fem, 4, integrator);
    organ.restoration = false;
    Simulation simulation = pressed(organ, 100);
    const auto lowest = [&]() {
      double z = 0.0;
      for (int v = 0; v < simulation.rest().surface_vertices; ++v) {
        if (!simulation.rest().attached[v] && simulation.rest().positions[v].z() > -1e-9) {
          z = std::min(z, simulation.organ().positions[v].z());
        }
      }
      return z;
    };
    const double dented = lowest();
    EXPECT_LT(dented, -0.7 * depth);
    simulation.slide_to(ball_over_block(radius, -0.005), 50);
    for (int i = 0; i < 500; ++i) simulation.go_to(simulation.poses[0]);
    EXPECT_NEAR(lowest(), dented, 0.1 * depth);
    EXPECT_TRUE(simulation.report.contacts.empty());
  }
}

TEST(SolidOrgan, AnEmbeddedSurfaceIsPressedAndComesBack) {
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    constexpr double size = 0.015;
    Organ organ = embedded_sphere(size, 32, 4, Model::fem);
    organ.integrator = integrator;
    organ.material.drag = 60.0;
    Simulation simulation(scene_of(organ, {round_ball(radius, slices)}));
    const double top = simulation.rest().positions[0].z();
    const auto at = [&](double d) {
      return Pose{{0.0003, 0.0002, top + radius - d}, Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3::UnitX()))};
    };
    ASSERT_NEAR(top, -0.1 * size, 1e-9) << "the pole comes first";
    simulation.start_at(at(-0.0002));
    simulation.slide_to(at(depth), 50);
    for (int i = 0; i < 300; ++i) simulation.go_to(simulation.poses[0]);
    EXPECT_NEAR(simulation.organ().positions[0].z(), top - depth, 0.2e-3);
    const Vector3 force = simulation.report.wrenches[0].force;
    EXPECT_GT(force.z(), 0.01);
    for (int v = 0; v < simulation.rest().first_simulated; ++v) {
      const Vector3 carried =
          embedded_point(simulation.rest().embedding, static_cast<std::size_t>(v), simulation.organ().positions);
      EXPECT_LT((simulation.organ().positions[v] - carried).norm(), 1e-12);
    }
    // What the ball presses, the attachments bear.
    const std::vector<Vector3> internal = internal_forces(simulation.rest(), simulation.organ().positions);
    Vector3 at_table = Vector3::Zero();
    for (std::size_t v = 0; v < internal.size(); ++v) {
      if (simulation.rest().attached[v]) at_table += internal[v];
    }
    EXPECT_LT((force + at_table).norm(), 0.01 * force.norm()) << force.transpose() << " " << at_table.transpose();

    simulation.slide_to(at(-0.005), 50);
    for (int i = 0; i < 1500 && !simulation.organ().asleep; ++i) simulation.go_to(simulation.poses[0]);
    EXPECT_LT(rms_from_rest(simulation.rest(), simulation.organ().positions), 1e-6);
  }
}

/// A needle's round end of 1 mm on triangles of 5 mm: no vertex of the organ is ever inside it.
TEST(SolidOrgan, AThinProbeIsKeptOutBetweenItsVertices) {
  constexpr double thin = 0.001;
  for (const Integrator integrator : {Integrator::explicit_substeps, Integrator::vertex_block_descent}) {
    for (const Vector3& place :
         {Vector3(0.0017, 0.0031, 0.0), Vector3(0.0025, 0.0025, 0.0), Vector3(0.005, 0.0001, 0)}) {
      Simulation simulation(scene_of(soft_block(Model::fem, 3, integrator), {round_ball(thin, 12)}));
      const auto at = [&](double d) {
        return Pose{place + Vector3(0.0, 0.0, thin - d), Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Vector3::UnitX()))};
      };
      simulation.start_at(at(-0.0002));
      simulation.slide_to(at(0.003), 60);
      for (int i = 0; i < 200; ++i) simulation.go_to(simulation.poses[0]);
      EXPECT_FALSE(simulation.report.contacts.empty());
      EXPECT_GT(simulation.report.wrenches[0].force.z(), 0.01);
      TriangleMesh surface;
      surface.vertices.assign(simulation.organ().positions.begin(),
                              simulation.organ().positions.begin() + simulation.rest().surface_vertices);
      surface.triangles = simulation.rest().triangles;
      double deepest = 0.0;
      for (const Vector3& v : simulation.world.pieces[0].surface.vertices) {
        const Vector3 p = simulation.poses[0].apply(v);
        if (is_inside(surface, p)) deepest = std::max(deepest, distance_to_mesh(surface, p));
      }
      EXPECT_LT(deepest, 0.1e-3) << place.transpose();
    }
  }
}

TEST(SolidOrgan, ASliverChangesTheForceByAThousandthAtMost) {
  // Uneven, or the faces around a vertex are flat in pairs and two tetrahedra become slivers.
  TetrahedralMesh uneven = make_block(soft_block_size, {8, 8, 4});
  jitter_inside(uneven, soft_block_size, soft_block_size.z() / 4.0, 0.2);
  Organ organ = solid_organ(uneven, soft_block_size, Model::fem);
  organ.integrator = Integrator::explicit_substeps;
  organ.material.drag = 60.0;
  const double clean = pressed(organ).report.wrenches[0].force.z();
  ASSERT_GE(make_one_sliver(organ.solid, static_cast<int>(organ.mesh.vertices.size()), 1e-3), 0);
  const double with_sliver = pressed(organ).report.wrenches[0].force.z();
  EXPECT_NEAR(with_sliver / clean, 1.0, 1e-3);
}

/// A step in which contact is looked for once, at its start: at its end the contacts are where the instrument is then.
TEST(Solid, ContactsGoAlongWithTheInstrument) {
  Simulation simulation = pressed(soft_block(Model::fem, 6), 100);
  const double deeper = 2e-5;
  const Pose pose = ball_over_block(radius, depth + deeper);
  simulation.go_to(pose);

  ASSERT_GE(simulation.report.substeps, 3);
  const InstrumentSurface& ball = simulation.world.pieces[0].surface;
  EXPECT_GT(simulation.workspace.organs[0].last_looks[0].way_of_near, 0.5 * deeper) << "it was looked for again";
  ASSERT_FALSE(simulation.report.contacts.empty());
  for (const OrganContact& contact : simulation.report.contacts) {
    EXPECT_LT(closest_feature(ball, pose.apply_inverse(contact.point)).depth, 0.1 * deeper);
  }
}

/// A ball with a shaft on it, pressed in, that leans over by `lean` (rad) in the last step.
Simulation leaning(double lean) {
  Instrument tool = ball(radius);
  TriangleMesh shaft = make_cylinder(0.5 * radius, 0.3, 12);
  for (Vector3& v : shaft.vertices) v.z() += 0.17 + radius;
  tool.parts.push_back({"shaft", shaft, true});
  Simulation simulation(scene_of(soft_block(Model::fem, 6, Integrator::explicit_substeps), {tool}));
  simulation.start_at(ball_over_block(radius, -1e-4));
  simulation.slide_to(ball_over_block(radius, depth), 100);
  Pose pose = simulation.poses[0];
  pose.orientation = turn(lean, Vector3::UnitX()) * pose.orientation;
  simulation.go_to(pose);
  EXPECT_GE(simulation.report.substeps, 3);
  return simulation;
}

/// The far end of a shaft swings where no organ is: contact is not looked for again before it can have come near.
TEST(Solid, WhatSwingsFarFromTheOrganIsNotLookedAtAgain) {
  const double limit = leaning(0.0).world.organs[0].motion_limit;
  const double to_the_end = 0.32 + radius;
  const auto way_since = [&](double way_of_end) {
    return leaning(way_of_end / to_the_end).workspace.organs[0].last_looks[1].way_of_all;
  };
  EXPECT_GT(way_since(1.2 * limit), 0.7 * limit) << "it was looked for again after half a limit";
  EXPECT_LT(way_since(6.0 * limit), 2.0 * limit) << "it may have come near";
}

/// The end of a probe is a ball of which one half is in its shaft: no organ gets there.
TEST(Solid, WhatIsInsideAnotherPieceOfItsInstrumentDoesNotPoke) {
  Instrument probe = ball(radius);
  TriangleMesh shaft = make_cylinder(1.2 * radius, 0.1, 24);
  for (Vector3& v : shaft.vertices) v.z() += 0.05;
  probe.parts.push_back({"shaft", shaft, true});
  Scene scene = scene_of(soft_block(Model::fem, 6), {probe, ball(radius, "another")});
  const World world = build_world(scene);
  ASSERT_EQ(world.pieces.size(), 3u);
  const std::vector<std::vector<int>>& poking = world.organs[0].poking;
  std::size_t outside = 0;
  for (const Vector3& v : world.pieces[0].surface.vertices) outside += v.z() < poke_reach ? 1 : 0;
  EXPECT_EQ(poking[0].size(), outside);
  for (const int v : poking[0]) EXPECT_LT(world.pieces[0].surface.vertices[v].z(), poke_reach);
  EXPECT_EQ(poking[2].size(), world.pieces[2].surface.vertices.size()) << "another instrument, which may be elsewhere";
}

/// A thin rod whose ends are in two balls: none of its vertices can poke, and it lies across the organ all the same.
TEST(Solid, ARodBetweenTwoBallsIsFeltByEdges) {
  Instrument tool;
  tool.name = "tool";
  TriangleMesh rod = make_cylinder(0.0005, 0.04, 8);
  for (Vector3& v : rod.vertices) v = {v.z(), v.y(), -v.x()};
  tool.parts.push_back({"rod", rod, true});
  for (const double end : {-0.02, 0.02}) {
    TriangleMesh mesh = make_sphere(0.002, 8);
    for (Vector3& v : mesh.vertices) v.x() += end;
    tool.parts.push_back({"ball", mesh, true});
  }
  Organ organ = soft_block(Model::fem, 3, Integrator::explicit_substeps);
  Simulation simulation(scene_of(organ, {tool}));
  ASSERT_TRUE(simulation.world.organs[0].poking[0].empty());
  EXPECT_EQ(simulation.world.organs[0].sharp[0], 1);
  const auto at = [](double down) { return Pose{{0.0, 0.0017, 0.0005 - down}, Eigen::Quaterniond::Identity()}; };
  simulation.start_at(at(-0.0005));
  simulation.slide_to(at(0.001), 60);
  int of_rod = 0;
  for (const OrganContact& contact : simulation.report.contacts) of_rod += contact.part == 0 ? 1 : 0;
  EXPECT_GT(of_rod, 0);
}

/// An instrument that moves far from the organ is no reason to look for the contacts of another one again.
TEST(Solid, AnInstrumentFarAwayIsNotLookedAtAgain) {
  Simulation simulation(
      scene_of(soft_block(Model::fem, 6, Integrator::explicit_substeps), {ball(radius), ball(radius, "far")}));
  simulation.start_at(ball_over_block(radius, -1e-4));
  simulation.slide_to(ball_over_block(radius, depth), 100);
  const double limit = simulation.world.organs[0].motion_limit;
  const Pose here = simulation.poses[0];
  const Pose from = {{0.0, 0.0, 0.5}, Eigen::Quaterniond::Identity()};
  const Pose to = {{0.0, 0.9 * limit, 0.5}, Eigen::Quaterniond::Identity()};
  const Motion motion = {0.001, {{true, here, here}, {true, from, to}}};
  ++simulation.report.step;
  step(simulation.world, motion, simulation.state, simulation.workspace, simulation.report);
  ASSERT_GE(simulation.report.substeps, 3);
  const double since = simulation.workspace.organs[0].last_looks[1].way_of_all;
  EXPECT_GT(since, 0.9 * limit * (simulation.report.substeps - 1.5) / simulation.report.substeps);
}

}  // namespace
}  // namespace tissue_sim::solid_test
