#include "tissue_sim/study/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tissue_sim {
namespace {

TetrahedralMesh block_of(const std::array<std::vector<double>, 3>& planes) {
  TetrahedralMesh mesh;
  const int nx = static_cast<int>(planes[0].size());
  const int ny = static_cast<int>(planes[1].size());
  const int nz = static_cast<int>(planes[2].size());
  for (double z : planes[2])
    for (double y : planes[1])
      for (double x : planes[0]) mesh.vertices.emplace_back(x, y, z);
  const auto id = [&](std::array<int, 3> p) { return (p[2] * ny + p[1]) * nx + p[0]; };
  const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int k = 0; k + 1 < nz; ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i)
        for (int o = 0; o < 6; ++o) {
          std::array<int, 3> p{i, j, k};
          Tetrahedron t;
          t[0] = id(p);
          for (int s = 0; s < 3; ++s) {
            ++p[static_cast<std::size_t>(order[o][s])];
            t[static_cast<std::size_t>(s) + 1] = id(p);
          }
          if (o >= 3) std::swap(t[2], t[3]);
          mesh.tetrahedra.push_back(t);
        }
  return mesh;
}

std::vector<double> even(double from, double to, int cells) {
  std::vector<double> result;
  for (int i = 0; i <= cells; ++i) result.push_back(from + (to - from) * i / cells);
  return result;
}

bool on_boundary(const Vector3& p, const Vector3& low, const Vector3& high) {
  return (p - low).minCoeff() < 1e-9 || (high - p).minCoeff() < 1e-9;
}

TEST(Reference, AnAffineBoundaryDisplacementIsAffineInside) {
  TetrahedralMesh mesh = block_of({even(0, 0.03, 4), even(0, 0.02, 3), even(0, 0.02, 4)});
  const Vector3 high(0.03, 0.02, 0.02);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Matrix3 gradient;
  gradient << 0.3, 0.2, -0.1, 0.15, -0.25, 0.1, 0.05, -0.2, 0.2;
  ReferenceProblem problem{mesh, {lame_moduli(5400, 0.45)}, {}, {}, {}, {}, Vector3::Zero(), {}};
  ReferenceOptions options;
  options.tolerance = 1e-12;
  for (Vector3& p : mesh.vertices) {
    const bool held = on_boundary(p, Vector3::Zero(), high);
    if (!held) p += 0.001 * Vector3(uniform(random), uniform(random), uniform(random));
    problem.fixed.push_back({held, held, held});
    problem.prescribed.push_back(gradient * p);
    options.start.push_back(p + 0.001 * Vector3(uniform(random), uniform(random), uniform(random)));
  }
  const ReferenceSolution solution = solve_statics(problem, options);
  EXPECT_TRUE(solution.converged);
  double worst = 0.0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    worst = std::max(worst, (solution.positions[v] - mesh.vertices[v] - problem.prescribed[v]).norm());
  }
  EXPECT_LT(worst, 1e-10 * 0.03);
  std::printf("worst %g  iterations %d residual %g\n", worst / 0.03, solution.iterations, solution.residual);
}

}  // namespace
}  // namespace tissue_sim
