#include "tissue_sim/tissue/patch_test.h"

#include <limits>

#include "tissue_sim/tissue/stability.h"

namespace tissue_sim {

namespace {

constexpr double end_part = 0.1;  ///< of the organ's extent
constexpr double tolerance =
    1e-2;  ///< of the residual to that at the beginning; the energy is right to about its square
constexpr int most_iterations = 300;  ///< enough for a liver; long thin organs stop here, within a few percent

double dot(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// y = x + factor z
void add(const std::vector<Vector3>& x, double factor, const std::vector<Vector3>& z, std::vector<Vector3>& y) {
  for (std::size_t i = 0; i < x.size(); ++i) y[i] = x[i] + factor * z[i];
}

}  // namespace

PatchTest pull_ends(const RestShape& shape, int axis, int along) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto first = static_cast<std::size_t>(shape.first_simulated);
  for (std::size_t v = first; v < shape.positions.size(); ++v) {
    low = std::min(low, shape.positions[v][axis]);
    high = std::max(high, shape.positions[v][axis]);
  }
  PatchTest test;
  test.moved.assign(shape.positions.size(), 0);
  test.displacements.assign(shape.positions.size(), Vector3::Zero());
  for (std::size_t v = 0; v < shape.positions.size(); ++v) {
    const double place = (shape.positions[v][axis] - low) / (high - low);
    if (v >= first && place > end_part && place < 1.0 - end_part) continue;
    test.moved[v] = 1;
    if (v >= first && place >= 1.0 - end_part) test.displacements[v][along] = 1.0;
  }
  return test;
}

double patch_energy(const RestShape& shape, const PatchTest& test) {
  const std::size_t n = shape.positions.size();
  std::vector<Vector3> u = test.displacements;
  std::vector<Vector3> pulls(n, Vector3::Zero());
  add_stiffness_product(shape, u, pulls);
  std::vector<Vector3> residual(n, Vector3::Zero());
  for (std::size_t v = 0; v < n; ++v) {
    if (!test.moved[v]) residual[v] = -pulls[v];
  }
  std::vector<Vector3> direction = residual;
  double square = dot(residual, residual);
  const double enough = tolerance * tolerance * square;
  for (int i = 0; i < most_iterations && square > enough; ++i) {
    std::fill(pulls.begin(), pulls.end(), Vector3::Zero());
    add_stiffness_product(shape, direction, pulls);
    for (std::size_t v = 0; v < n; ++v) {
      if (test.moved[v]) pulls[v].setZero();
    }
    const double way = square / dot(direction, pulls);
    add(u, way, direction, u);
    add(residual, -way, pulls, residual);
    const double before = square;
    square = dot(residual, residual);
    add(residual, square / before, direction, direction);
  }
  std::fill(pulls.begin(), pulls.end(), Vector3::Zero());
  add_stiffness_product(shape, u, pulls);
  return 0.5 * dot(u, pulls);
}

}  // namespace tissue_sim
