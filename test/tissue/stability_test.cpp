#include "tissue_sim/tissue/stability.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "geometry/twins.h"
#include "tissue/test_solids.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim::stability_test {
namespace {

constexpr double safety = 0.4;

Organ organ_of(const TriangleMesh& mesh, double damping) {
  Organ organ;
  organ.mesh = mesh;
  organ.model = Model::surface;
  organ.material.young = 10e3;
  organ.material.poisson = 0.45;
  organ.material.density = 1060.0;
  organ.material.damping = damping;
  organ.wall_thickness = 0.002;
  return organ;
}

/// Every vertex as light as a third of the wall of its triangles.
std::vector<double> wall_masses(const Organ& organ) {
  std::vector<double> mass(organ.mesh.vertices.size(), 0.0);
  for (const auto& [a, b, c] : organ.mesh.triangles) {
    const double area =
        0.5 * area_normal(organ.mesh.vertices[a], organ.mesh.vertices[b], organ.mesh.vertices[c]).norm();
    for (const int v : {a, b, c}) mass[v] += organ.material.density * organ.wall_thickness * area / 3.0;
  }
  return mass;
}

template <class Kind>
void add_row_sums(const std::vector<Kind>& elements, const std::vector<Vector3>& x, std::vector<double>& sums) {
  ElementVectors<Kind> gradient;
  for (const Kind& element : elements) {
    element.evaluate(gather(element, x), gradient);
    for (std::size_t i = 0; i < Kind::size; ++i) {
      for (std::size_t j = 0; j < Kind::size; ++j) {
        sums[element.vertices[i]] += element.stiffness * gradient[i].norm() * gradient[j].norm();
      }
    }
  }
}

/// The largest of the bounds on omega^2 of the vertices.
double fastest(const RestShape& shape, const std::vector<double>& mass) {
  std::vector<double> sums(mass.size(), 0.0);
  add_row_sums(shape.distances, shape.positions, sums);
  add_row_sums(shape.areas, shape.positions, sums);
  add_row_sums(shape.volumes, shape.positions, sums);
  double bound = 0.0;
  for (std::size_t i = 0; i < mass.size(); ++i) {
    if (!shape.attached[i]) bound = std::max(bound, sums[i] / mass[i]);
  }
  return bound;
}

/// The plainest integrator: v += dt f / m, x += dt v, over all elements.
struct Motion {
  const RestShape& shape;
  std::vector<Vector3> x;
  std::vector<Vector3> v;
  std::vector<Vector3> forces;
  std::vector<Vector3> gradient;

  explicit Motion(const RestShape& rest)
      : shape(rest), x(rest.positions), v(x.size(), Vector3::Zero()), forces(x.size()), gradient(x.size()) {}

  /// Kinetic and elastic energy after one substep.
  double advance(double dt) {
    std::fill(forces.begin(), forces.end(), Vector3::Zero());
    double energy = 0.0;
    for (const DistanceElement& e : shape.distances) energy += add_forces(e, {shape.inverse_mass, 1e300}, x, v, forces);
    for (const AreaElement& e : shape.areas) energy += add_forces(e, {shape.inverse_mass, 1e300}, x, v, forces);
    for (const VolumeElement& e : shape.volumes) energy += add_forces(e, {shape.inverse_mass, 1e300}, x, v, forces);
    const double c = shape.enclosed.evaluate(x, shape.triangles, gradient);
    energy += 0.5 * shape.enclosed.stiffness * c * c;
    double rate = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) rate += gradient[i].dot(v[i]);
    for (std::size_t i = 0; i < x.size(); ++i) {
      energy += 0.5 * shape.mass[i] * v[i].squaredNorm();
      forces[i] -= (shape.enclosed.stiffness * c + shape.enclosed.damping * rate) * gradient[i];
      v[i] += dt * shape.inverse_mass[i] * forces[i];
      x[i] += dt * v[i];
    }
    return energy;
  }

  void start(double speed) {
    Random random(1);
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!shape.attached[i]) v[i] = speed * random_direction(random);
    }
  }
};

TEST(MassFloor, AddsLittleAndSlowsTheFastest) {
  for (const TriangleMesh& mesh : {make_sphere(0.05, 32), make_torus(0.05, 0.02, 16), make_cylinder(0.02, 0.1, 24)}) {
    const Organ organ = organ_of(mesh, 0.1);
    const RestShape shape = build_rest_shape(organ);
    const std::vector<double> bare = wall_masses(organ);
    double total = 0.0;
    double added = 0.0;
    for (std::size_t i = 0; i < bare.size(); ++i) {
      EXPECT_GE(shape.mass[i], bare[i] * (1.0 - 1e-12));
      total += bare[i];
      added += shape.mass[i] - bare[i];
    }
    EXPECT_LE(added, 0.005 * total * (1.0 + 1e-9));
    EXPECT_NEAR(added, shape.added_mass, 1e-9 * total);
    EXPECT_LT(fastest(shape, shape.mass), fastest(shape, bare));
  }
}

TEST(MassFloor, BringsTheRaisedToOneBound) {
  RestShape shape = build_rest_shape(organ_of(make_sphere(0.05, 32), 0.1));
  const std::vector<double> bare = wall_masses(organ_of(make_sphere(0.05, 32), 0.1));
  shape.mass = bare;
  shape.added_mass = 0.0;
  apply_mass_floor(0.02, shape);
  std::vector<double> sums(bare.size(), 0.0);
  add_row_sums(shape.distances, shape.positions, sums);
  add_row_sums(shape.areas, shape.positions, sums);
  add_row_sums(shape.volumes, shape.positions, sums);
  const double bound = fastest(shape, shape.mass);
  int raised = 0;
  for (std::size_t i = 0; i < bare.size(); ++i) {
    if (shape.mass[i] == bare[i]) continue;
    ++raised;
    EXPECT_NEAR(sums[i] / shape.mass[i], bound, 1e-9 * bound);
  }
  EXPECT_GT(raised, 0);
  EXPECT_LT(raised, static_cast<int>(bare.size()) / 2);
}

TEST(MassFloor, AttachedVerticesAreNotPaidFor) {
  Organ organ = organ_of(make_sphere(0.05, 32), 0.1);
  organ.attached = {0};  // a pole, the lightest and stiffest vertex
  EXPECT_EQ(build_rest_shape(organ).mass[0], wall_masses(organ)[0]);
}

TEST(StableSubstep, OfOneSpringIsTheTextbooks) {
  // Two masses m on a spring: omega^2 = 2 k / (m D0^2); without damping the symplectic step is stable below 2 / omega.
  RestShape shape;
  shape.positions = {Vector3::Zero(), Vector3(0.5, 0, 0)};
  shape.attached = {0, 0};
  shape.mass = {2.0, 2.0};
  shape.inverse_mass = {0.5, 0.5};
  DistanceElement spring;
  spring.vertices = {0, 1};
  spring.rest = spring.scale = 0.5;
  spring.stiffness = 4.0;
  shape.distances = {spring};
  const double omega = std::sqrt(2.0 * 4.0 / (2.0 * 0.25));
  shape.fastest_frequency = fastest_frequency(shape);
  EXPECT_NEAR(shape.fastest_frequency, omega, 1e-9);
  EXPECT_NEAR(stable_substep(shape, 1.0), 2.0 / omega, 1e-9);
  EXPECT_NEAR(stable_substep(shape, 0.4), 0.8 / omega, 1e-9);
  EXPECT_NEAR(stiffest_element(shape, shape.positions), omega * omega, 1e-9);

  // With damping d: (dt omega / 2)^2 + dt lambda / 2 = 1, lambda = 2 d / (m D0^2).
  shape.distances[0].damping = 1.0;
  const double lambda = 2.0 * 1.0 / (2.0 * 0.25);
  const double dt = stable_substep(shape, 1.0);
  EXPECT_NEAR(std::pow(0.5 * dt * omega, 2) + 0.5 * dt * lambda, 1.0, 1e-9);
}

TEST(StableSubstep, NothingToIntegrateNeedsNone) {
  RestShape shape;
  shape.positions = {Vector3::Zero()};
  shape.attached = {0};
  shape.mass = shape.inverse_mass = {1.0};
  EXPECT_EQ(stable_substep(shape, 0.4), 0.0);
}

TEST(StableSubstep, NeverGainsEnergy) {
  for (const double damping : {0.0, 0.1, 1.0}) {
    const RestShape shape = build_rest_shape(organ_of(make_sphere(0.05, 8), damping));
    const double dt = stable_substep(shape, safety);
    EXPECT_DOUBLE_EQ(dt, shape.stable_substep);
    Motion motion(shape);
    motion.start(0.05);
    const double at_start = motion.advance(dt);
    double highest = at_start;
    double last = at_start;
    for (int substep = 0; substep < 10000; ++substep) {
      last = motion.advance(dt);
      highest = std::max(highest, last);
    }
    // The symplectic step keeps an energy that differs from this one by up to dt omega / 2 = 0.4 of it, and does not
    // drift.
    EXPECT_LT(highest, at_start / (1.0 - safety));
    if (damping > 0.0) {
      EXPECT_LT(last, 0.6 * at_start);
    }
  }
}

TEST(StableSubstep, ItsBoundIsWhereItBlowsUp) {
  for (const double damping : {0.0, 0.1, 1.0}) {
    const RestShape shape = build_rest_shape(organ_of(make_sphere(0.05, 8), damping));
    for (const double factor : {0.95, 1.05}) {
      const double dt = factor * stable_substep(shape, 1.0);
      Motion motion(shape);
      motion.start(1e-9);  // so small that the elements are springs
      const double at_start = motion.advance(dt);
      double highest = 0.0;
      for (int substep = 0; substep < 1000 && highest < 1e9 * at_start; ++substep) {
        highest = std::max(highest, motion.advance(dt));
      }
      if (factor < 1.0) {
        EXPECT_LT(highest, 30.0 * at_start) << "damping " << damping;
      } else {
        EXPECT_GT(highest, 1e6 * at_start) << "damping " << damping;
      }
    }
  }
}

TEST(StiffestElement, GrowsWithStretching) {
  const RestShape shape = build_rest_shape(organ_of(make_octasphere(0.05, 2), 0.1));
  EXPECT_EQ(stiffest_element(shape, shape.positions), shape.stiffest_element);
  std::vector<Vector3> x = shape.positions;
  for (Vector3& p : x) p *= 3.0;
  EXPECT_GT(stiffest_element(shape, x), shape.stiffest_element);
}

const Vector3 block_size(0.02, 0.015, 0.01);

RestShape solid_block(Model model, double damping) {
  TetrahedralMesh block = make_block(block_size, {4, 3, 2});
  jitter_inside(block, block_size, 0.005, 0.2);
  Organ organ = solid_organ(block, block_size, model);
  organ.material.damping = damping;
  return build_rest_shape(organ);
}

template <class Kind>
void add_dense(const std::vector<Kind>& elements, const RestShape& shape, Eigen::MatrixXd& stiffness) {
  ElementVectors<Kind> gradient;
  for (const Kind& element : elements) {
    element.evaluate(gather(element, shape.positions), gradient);
    for (std::size_t i = 0; i < Kind::size; ++i) {
      for (std::size_t j = 0; j < Kind::size; ++j) {
        stiffness.block<3, 3>(3 * element.vertices[i], 3 * element.vertices[j]) +=
            element.stiffness * gradient[i] * gradient[j].transpose();
      }
    }
  }
}

/// The largest frequency, of the whole matrix M^-1/2 K M^-1/2.
double dense_frequency(const RestShape& shape) {
  const auto n = static_cast<Eigen::Index>(3 * shape.positions.size());
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(n, n);
  add_dense(shape.distances, shape, stiffness);
  add_dense(shape.volumes, shape, stiffness);
  for (const NeoHookeanElement& element : shape.tetrahedra) {
    const NeoHookeanElement::Vectors x = gather(element, shape.positions);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        stiffness.block<3, 3>(3 * element.vertices[i], 3 * element.vertices[j]) += element.block(x, i, j);
      }
    }
  }
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale[i] = std::sqrt(shape.inverse_mass[static_cast<std::size_t>(i / 3)]);
  const Eigen::MatrixXd scaled = scale.asDiagonal() * stiffness * scale.asDiagonal();
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues()[n - 1]);
}

TEST(FastestFrequency, OfASolidIsThatOfTheWholeMatrix) {
  for (const Model model : {Model::fem, Model::volume}) {
    const RestShape shape = solid_block(model, 0.1);
    const double exact = dense_frequency(shape);
    EXPECT_NEAR(shape.fastest_frequency, exact, 0.01 * exact);
    EXPECT_LE(shape.fastest_frequency, exact * (1.0 + 1e-9)) << "power iteration comes from below";
  }
}

/// Power iteration until nothing changes any more, in the plainest way.
double iterated_frequency(const RestShape& shape) {
  std::vector<Vector3> x(shape.positions.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double angle = static_cast<double>(i);
    x[i] = Vector3(std::sin(angle), std::sin(2.3 * angle), std::sin(7.1 * angle));
  }
  double norm = 1.0;
  for (int iteration = 0; iteration < 200; ++iteration) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] *= std::sqrt(shape.inverse_mass[i]) / norm;
    std::vector<Vector3> y(x.size(), Vector3::Zero());
    add_stiffness_product(shape, x, y);
    norm = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = std::sqrt(shape.inverse_mass[i]) * y[i];
      norm += x[i].squaredNorm();
    }
    norm = std::sqrt(norm);
  }
  return std::sqrt(norm);
}

TEST(FastestFrequency, OfManyVerticesIsThatOfPowerIteration) {
  Organ organ;
  organ.mesh = make_sphere(0.05, 146);
  organ.model = Model::surface;
  organ.wall_thickness = 0.003;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 5.0};
  organ.attached = {0, 1, 2, 3};
  const RestShape shape = build_rest_shape(organ);
  ASSERT_GT(shape.positions.size(), 20000U) << "where Lanczos takes over";
  const double exact = iterated_frequency(shape);
  EXPECT_NEAR(shape.fastest_frequency, exact, 0.002 * exact);
  EXPECT_GT(shape.stable_substep, 0.5 * 0.4 * 2.0 / exact);
  EXPECT_LE(shape.stable_substep, 0.4 * 2.0 / shape.fastest_frequency);
}

TEST(StableSubstep, OfASolidIsASafePartOfTheTextbooks) {
  // Without damping 2 / omega; stiffness-proportional damping takes a little.
  const RestShape undamped = solid_block(Model::fem, 0.0);
  EXPECT_NEAR(undamped.stable_substep, 0.7 * 2.0 / undamped.fastest_frequency, 1e-9 * undamped.stable_substep);
  const RestShape damped = solid_block(Model::fem, 0.1);
  EXPECT_DOUBLE_EQ(damped.damping_time, 2.0 * 0.1 / damped.fastest_frequency);
  const double dt = damped.stable_substep / 0.7;
  const double omega = damped.fastest_frequency;
  EXPECT_NEAR(std::pow(0.5 * dt * omega, 2) + 0.5 * dt * damped.damping_time * omega * omega, 1.0, 1e-9);
}

/// The plainest integrator of tetrahedra, as Motion above: forces of positions + damping_time velocities.
struct SolidMotion {
  const RestShape& shape;
  std::vector<Vector3> x;
  std::vector<Vector3> v;

  explicit SolidMotion(const RestShape& rest, double speed)
      : shape(rest), x(rest.positions), v(x.size(), Vector3::Zero()) {
    Random random(1);
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!shape.attached[i]) v[i] = speed * random_direction(random);
    }
  }

  /// Kinetic and elastic energy before the substep.
  double advance(double dt) {
    double energy = 0.0;
    std::vector<Vector3> forces(x.size(), Vector3::Zero());
    std::vector<Vector3> ahead = x;
    for (std::size_t i = 0; i < x.size(); ++i) ahead[i] += shape.damping_time * v[i];
    NeoHookeanElement::Vectors gradient;
    for (const NeoHookeanElement& element : shape.tetrahedra) {
      energy += element.evaluate(gather(element, x), gradient);
      element.evaluate(gather(element, ahead), gradient);
      for (std::size_t i = 0; i < 4; ++i) forces[element.vertices[i]] -= gradient[i];
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      energy += 0.5 * shape.mass[i] * v[i].squaredNorm();
      v[i] += dt * shape.inverse_mass[i] * forces[i];
      x[i] += dt * v[i];
    }
    return energy;
  }

  double mean_energy(double dt, int substeps) {
    double sum = 0.0;
    for (int i = 0; i < substeps; ++i) sum += advance(dt) / substeps;
    return sum;
  }
};

TEST(StableSubstep, OfASolidNeverGainsEnergy) {
  for (const double damping : {0.0, 0.1, 1.0}) {
    const RestShape shape = solid_block(Model::fem, damping);
    SolidMotion motion(shape, 0.05);
    const double at_start = motion.advance(shape.stable_substep);
    const double early = motion.mean_energy(shape.stable_substep, 200);
    EXPECT_LT(early, at_start / (1.0 - 0.7));
    motion.mean_energy(shape.stable_substep, 1600);
    const double late = motion.mean_energy(shape.stable_substep, 200);
    EXPECT_LT(late, (damping > 0.0 ? 0.9 : 1.02) * early) << "damping " << damping;
    testing::Test::RecordProperty(damping > 0.0 ? "damped_percent" : "undamped_percent",
                                  static_cast<int>(100.0 * late / early));
  }
}

TEST(StableSubstep, OfASolidIsBoundedWhereItBlowsUp) {
  for (const double damping : {0.0, 0.1, 1.0}) {
    const RestShape shape = solid_block(Model::fem, damping);
    for (const double factor : {0.95, 1.05, 1.5}) {
      const double dt = factor * stable_substep(shape, 1.0);
      SolidMotion motion(shape, 1e-5);  // so small that the elements are springs
      const double at_start = motion.advance(dt);
      double highest = 0.0;
      for (int i = 0; i < 1000 && highest < 1e9 * at_start; ++i) highest = std::max(highest, motion.advance(dt));
      if (factor < 1.0) {
        EXPECT_LT(highest, 30.0 * at_start) << "damping " << damping;
      } else {
        EXPECT_GT(highest, 1e6 * at_start) << "damping " << damping << ", " << factor << " of the bound";
      }
    }
  }
}

}  // namespace
}  // namespace tissue_sim::stability_test
