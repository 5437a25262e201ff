#include "tissue_sim/study/reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace tissue_sim::reference_test {
namespace {

constexpr double young = 5400.0;  // Pa
const double pi = std::acos(-1.0);

std::vector<double> even_planes(double from, double to, int cells) {
  std::vector<double> planes;
  for (int i = 0; i <= cells; ++i) planes.push_back(from + (to - from) * i / cells);
  return planes;
}

ReferenceProblem solid_problem(const TetrahedralMesh& mesh, double poisson) {
  ReferenceProblem problem{mesh, {lame_moduli(young, poisson)}};
  problem.fixed.resize(mesh.vertices.size());
  problem.prescribed.assign(mesh.vertices.size(), Vector3::Zero());
  problem.forces.assign(mesh.vertices.size(), Vector3::Zero());
  return problem;
}

double largest_distance(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double largest = 0.0;
  for (std::size_t v = 0; v < a.size(); ++v) largest = std::max(largest, (a[v] - b[v]).norm());
  return largest;
}

TEST(Reference, AnAffineBoundaryDisplacementIsAffineInside) {
  TetrahedralMesh mesh = make_block({0.03, 0.02, 0.02}, {4, 3, 4});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto anywhere = [&](double within) {
    return Vector3(within * Vector3(uniform(random), uniform(random), uniform(random)));
  };
  Matrix3 gradient;
  gradient << 0.3, 0.2, -0.1, 0.15, -0.25, 0.1, 0.05, -0.2, 0.2;
  std::vector<char> outside;
  for (Vector3& p : mesh.vertices) {
    const Vector3 to_face = Vector3(0.015, 0.01, 0.01) - (p + Vector3(0.0, 0.0, 0.01)).cwiseAbs();
    outside.push_back(to_face.minCoeff() < 1e-9 ? 1 : 0);
    if (outside.back() == 0) p += anywhere(0.001);
  }
  ReferenceProblem problem = solid_problem(mesh, 0.45);
  ReferenceOptions options;
  options.tolerance = 1e-11;
  std::vector<Vector3> expected;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vector3& p = mesh.vertices[v];
    expected.push_back(p + gradient * p);
    const bool held = outside[v] != 0;
    problem.fixed[v] = {held, held, held};
    if (held) problem.prescribed[v] = gradient * p;
  }
  // From rest, from displacements of half a cell, and from tetrahedra turned inside out.
  for (const double within : {0.0, 0.003, 0.03}) {
    options.start.clear();
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      options.start.push_back(mesh.vertices[v]);
      if (outside[v] == 0) options.start.back() += anywhere(within);
    }
    const ReferenceSolution solution = solve_statics(problem, options);
    EXPECT_TRUE(solution.converged) << within;
    EXPECT_LT(largest_distance(solution.positions, expected), 1e-10 * 0.03) << within;
  }
}

/// A bar of 10 x 10 x 40 mm with its ends guided, shorter by `strain` of its length.
struct Bar {
  explicit Bar(double strain) : mesh(make_block({0.01, 0.01, 0.04}, {3, 3, 8})), problem(solid_problem(mesh, 0.45)) {
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Vector3& p = mesh.vertices[v];
      const bool top = p.z() == 0.0;
      problem.fixed[v] = {p.x() < -0.0049, p.y() < -0.0049, top || p.z() < -0.0399};
      if (top) problem.prescribed[v].z() = -strain * 0.04;
    }
  }
  TetrahedralMesh mesh;
  ReferenceProblem problem;
};

TEST(Reference, AUniaxialBarHasTheModuliThatItWasGiven) {
  const double strain = 1e-4;
  const Bar bar(strain);
  const ReferenceSolution solution = solve_statics(bar.problem);
  EXPECT_TRUE(solution.converged);
  double force = 0.0;
  double widening = 0.0;
  for (std::size_t v = 0; v < bar.mesh.vertices.size(); ++v) {
    const Vector3& p = bar.mesh.vertices[v];
    if (p.z() == 0.0) force += solution.internal_forces[v].z();
    if (p.x() > 0.0049) widening = (solution.positions[v] - p).x();
  }
  EXPECT_NEAR(force / (1e-4 * strain), young, 1e-3 * young);
  EXPECT_NEAR(widening / (0.01 * strain), 0.45, 1e-3 * 0.45);
}

TEST(Reference, AFlatPlateIsAGuidedEnd) {
  const Bar guided(0.2);
  Bar pressed(0.0);
  for (std::size_t v = 0; v < pressed.mesh.vertices.size(); ++v) {
    if (pressed.mesh.vertices[v].z() < 0.0) continue;
    pressed.problem.fixed[v][2] = false;
    pressed.problem.surface.push_back(static_cast<int>(v));
  }
  pressed.problem.obstacle = [](const Vector3& p) {
    ObstaclePoint result;
    result.depth = p.z() + 0.2 * 0.04;
    result.direction = -Vector3::UnitZ();
    return result;
  };
  const ReferenceSolution expected = solve_statics(guided.problem);
  const ReferenceSolution solution = solve_statics(pressed.problem);
  EXPECT_TRUE(expected.converged);
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(largest_distance(solution.positions, expected.positions), 1e-9);
  EXPECT_EQ(solution.contacts, pressed.problem.surface);
  double force = 0.0;
  for (const int v : solution.contacts) force += expected.internal_forces[static_cast<std::size_t>(v)].z();
  EXPECT_GT(force, 0.1);
  EXPECT_NEAR(solution.contact_force.z(), force, 1e-6 * force);
}

TEST(Reference, ATwistIsTheSameAtOnceAndInSteps) {
  Bar bar(0.0);
  const Matrix3 turn = Eigen::AngleAxisd(2.0, Vector3::UnitZ()).toRotationMatrix();
  for (std::size_t v = 0; v < bar.mesh.vertices.size(); ++v) {
    const Vector3& p = bar.mesh.vertices[v];
    const bool end = p.z() == 0.0 || p.z() < -0.0399;
    bar.problem.fixed[v] = {end, end, end};
    if (p.z() == 0.0) bar.problem.prescribed[v] = turn * p - p;
  }
  ReferenceOptions options;
  const ReferenceSolution at_once = solve_statics(bar.problem, options);
  options.load_steps = 8;
  const ReferenceSolution in_steps = solve_statics(bar.problem, options);
  EXPECT_TRUE(at_once.converged);
  EXPECT_TRUE(in_steps.converged);
  EXPECT_LT(largest_distance(at_once.positions, in_steps.positions), 1e-9);
}

TEST(Reference, NothingMovesWithoutALoad) {
  const Bar bar(0.0);
  const ReferenceSolution solution = solve_statics(bar.problem);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.iterations, 0);
  EXPECT_EQ(solution.positions, bar.mesh.vertices);
}

TEST(Reference, WhatNothingHoldsHasNoEquilibrium) {
  const TetrahedralMesh mesh = make_block({0.01, 0.01, 0.01}, {2, 2, 2});
  ReferenceProblem problem = solid_problem(mesh, 0.3);
  for (Vector3& force : problem.forces) force.x() = 0.001;
  const ReferenceSolution solution = solve_statics(problem);
  EXPECT_FALSE(solution.converged);
  EXPECT_GT(solution.residual, 1e-3);
}

TEST(Reference, ListsThatDoNotFitTheMeshAreRefused) {
  TetrahedralMesh mesh = make_block({0.01, 0.01, 0.01}, {1, 1, 1});
  const auto refused = [&](auto change) {
    ReferenceProblem problem = solid_problem(mesh, 0.3);
    ReferenceOptions options;
    change(problem, options);
    EXPECT_THROW(solve_statics(problem, options), std::invalid_argument);
  };
  refused([](ReferenceProblem& problem, ReferenceOptions&) { problem.fixed.pop_back(); });
  refused([](ReferenceProblem& problem, ReferenceOptions&) { problem.prescribed.pop_back(); });
  refused([](ReferenceProblem& problem, ReferenceOptions&) { problem.forces.pop_back(); });
  refused([](ReferenceProblem& problem, ReferenceOptions&) { problem.moduli.resize(2); });
  refused([](ReferenceProblem&, ReferenceOptions& options) { options.start.resize(3); });
  refused([](ReferenceProblem&, ReferenceOptions& options) { options.load_steps = 0; });
  refused([](ReferenceProblem& problem, ReferenceOptions&) {
    problem.obstacle = rigid_sphere({0, 0, 1}, 0.1);
    problem.surface = {8};
  });
  std::swap(mesh.tetrahedra[0][0], mesh.tetrahedra[0][1]);
  refused([](ReferenceProblem&, ReferenceOptions&) {});
}

/// Tip deflection over Timoshenko's, of a cantilever of length 8 h, height h and width h / 2 with `cells` through its
/// height, under a load spread evenly over its end that moves it by h / 100. Half its width, the middle plane guided.
double cantilever_deflection(int cells) {
  const double h = 0.01;
  const double length = 8.0 * h;
  const double width = 0.5 * h;
  const double inertia = width * h * h * h / 12.0;
  TetrahedralMesh mesh = make_block({even_planes(0.0, length, 8 * cells), even_planes(0.0, 0.5 * width, cells / 8),
                                     even_planes(-0.5 * h, 0.5 * h, cells)});
  ReferenceProblem problem = solid_problem(mesh, 0.0);
  const double load = 0.01 * h * 3.0 * young * inertia / (length * length * length);  // N, on the whole width
  std::vector<double> shares(mesh.vertices.size(), 0.0);
  double sum = 0.0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vector3& p = mesh.vertices[v];
    const bool clamped = p.x() == 0.0;
    problem.fixed[v] = {clamped, clamped || p.y() == 0.0, clamped};
    if (p.x() < length - 1e-9) continue;
    const bool side = p.y() == 0.0 || p.y() > 0.5 * width - 1e-9;
    const bool edge = std::abs(p.z()) > 0.5 * h - 1e-9;
    shares[v] = (side ? 0.5 : 1.0) * (edge ? 0.5 : 1.0);
    sum += shares[v];
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) problem.forces[v].z() = 0.5 * load * shares[v] / sum;
  const ReferenceSolution solution = solve_statics(problem);
  EXPECT_TRUE(solution.converged);
  double deflection = 0.0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    deflection += shares[v] / sum * (solution.positions[v] - mesh.vertices[v]).z();
  }
  const double shear_modulus = 0.5 * young;
  const double bending = load * length * length * length / (3.0 * young * inertia);
  const double shear = load * length / (5.0 / 6.0 * shear_modulus * width * h);
  return deflection / (bending + shear);
}

TEST(Reference, ACantileverBendsAsTimoshenkoSays) {
  // Linear tetrahedra are too stiff in bending, by the square of their size: 5.1 % with 8 cells through the height.
  const double coarse = cantilever_deflection(8);
  const double fine = cantilever_deflection(16);
  EXPECT_NEAR(fine, 1.0, 0.02);
  EXPECT_NEAR((1.0 - coarse) / (1.0 - fine), 4.0, 0.4);
  EXPECT_NEAR(fine + (fine - coarse) / 3.0, 1.0, 0.003);
}

/// An eighth of a thick-walled sphere: three patches of cells x cells squares, in `layers` layers of growing thickness.
struct Octant {
  Octant(double inner, double outer, int cells, int layers);
  TetrahedralMesh mesh;
  std::vector<Triangle> inside;  ///< seen from outside of the sphere
};

Octant::Octant(double inner, double outer, int cells, int layers) {
  const auto place = [cells](int i, int j, int k) {
    return static_cast<std::size_t>((k * (cells + 1) + j) * (cells + 1) + i);
  };
  const auto along = [cells](int i) { return std::tan(0.25 * pi * i / cells); };
  std::vector<int> numbers(place(cells, cells, cells) + 1, -1);
  std::vector<Vector3> directions;
  for (int k = 0; k <= cells; ++k) {
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        if (std::max({i, j, k}) < cells) continue;
        numbers[place(i, j, k)] = static_cast<int>(directions.size());
        directions.push_back(Vector3(along(i), along(j), along(k)).normalized());
      }
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto number = [&](int u, int v) {
      std::array<int, 3> p{};
      p[axis] = cells;
      p[(axis + 1) % 3] = u;
      p[(axis + 2) % 3] = v;
      return numbers[place(p[0], p[1], p[2])];
    };
    for (int u = 0; u < cells; ++u) {
      for (int v = 0; v < cells; ++v) {
        inside.push_back({number(u, v), number(u + 1, v), number(u + 1, v + 1)});
        inside.push_back({number(u, v), number(u + 1, v + 1), number(u, v + 1)});
      }
    }
  }
  const int ring = static_cast<int>(directions.size());
  for (int layer = 0; layer <= layers; ++layer) {
    const double radius = inner * std::pow(outer / inner, static_cast<double>(layer) / layers);
    for (const Vector3& direction : directions) mesh.vertices.push_back(radius * direction);
  }
  // Prisms cut by the order of their vertices, so that neighbours fit together.
  for (int layer = 0; layer < layers; ++layer) {
    for (Triangle t : inside) {
      std::sort(t.begin(), t.end());
      for (int& v : t) v += layer * ring;
      mesh.tetrahedra.push_back({t[0], t[1], t[2], t[2] + ring});
      mesh.tetrahedra.push_back({t[0], t[1], t[1] + ring, t[2] + ring});
      mesh.tetrahedra.push_back({t[0], t[0] + ring, t[1] + ring, t[2] + ring});
    }
  }
  orient(mesh);
}

/// Relative L2 error over the vertices against Lame's displacement, of a sphere of 20 and 40 mm under pressure.
double pressurised_sphere_error(int cells, double poisson) {
  const double a = 0.02;
  const double b = 0.04;
  const double pressure = 1e-3 * young;
  const Octant octant(a, b, cells, cells);
  const std::vector<Vector3>& rest = octant.mesh.vertices;
  ReferenceProblem problem = solid_problem(octant.mesh, poisson);
  for (std::size_t v = 0; v < rest.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) problem.fixed[v][static_cast<std::size_t>(axis)] = rest[v][axis] < 1e-12;
  }
  for (const Triangle& t : octant.inside) {
    std::array<Vector3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = rest[static_cast<std::size_t>(t[i])];
    const Vector3 area = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]);
    for (const int v : t) problem.forces[static_cast<std::size_t>(v)] += pressure / 3.0 * area;
  }
  const ReferenceSolution solution = solve_statics(problem);
  EXPECT_TRUE(solution.converged);
  double error = 0.0;
  double size = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const double r = rest[v].norm();
    const double outward = pressure * a * a * a / (young * (b * b * b - a * a * a)) *
                           ((1.0 - 2.0 * poisson) * r + (1.0 + poisson) * b * b * b / (2.0 * r * r));
    error += (solution.positions[v] - rest[v] - outward / r * rest[v]).squaredNorm();
    size += outward * outward;
  }
  return std::sqrt(error / size);
}

TEST(Reference, APressurisedSphereSwellsAsLameSays) {
  const double coarse = pressurised_sphere_error(6, 0.3);
  const double fine = pressurised_sphere_error(12, 0.3);
  EXPECT_LT(fine, 0.02);
  EXPECT_GT(coarse / fine, 3.0);  // second order
}

}  // namespace
}  // namespace tissue_sim::reference_test
