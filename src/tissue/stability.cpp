#include "tissue_sim/tissue/stability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {

constexpr int power_iterations = 200;

/// Vertices from which on Lanczos takes the place of power iteration, which took 32 s for a wall of a million
/// triangles. After 20 steps it is within 0.1 % of the fastest frequency, as 200 power iterations are (measured on
/// walls of 4,000 to 500,000 vertices). Below, the old figure stays, to the bit.
constexpr std::size_t many_vertices = 20000;
constexpr int lanczos_steps = 20;

template <class Kind>
void add_row_sums(const std::vector<Kind>& elements, const std::vector<Vector3>& positions, std::vector<double>& sums) {
  ElementVectors<Kind> gradient;
  for (const Kind& element : elements) {
    element.evaluate(gather(element, positions), gradient);
    double of_all = 0.0;
    for (const Vector3& g : gradient) of_all += g.norm();
    for (std::size_t i = 0; i < Kind::size; ++i) {
      sums[element.vertices[i]] += element.stiffness * gradient[i].norm() * of_all;
    }
  }
}

/// y += sum over the elements of factor grad C (grad C . x): stiffness or damping at rest.
template <class Kind>
void add_product(const std::vector<Kind>& elements, double Element<Kind::size>::*factor, const RestShape& shape,
                 const std::vector<Vector3>& x, std::vector<Vector3>& y) {
  ElementVectors<Kind> gradient;
  for (const Kind& element : elements) {
    element.evaluate(gather(element, shape.positions), gradient);
    double along = 0.0;
    for (std::size_t i = 0; i < Kind::size; ++i) along += gradient[i].dot(x[element.vertices[i]]);
    for (std::size_t i = 0; i < Kind::size; ++i) y[element.vertices[i]] += element.*factor * along * gradient[i];
  }
}

void add_row_sums(const std::vector<NeoHookeanElement>& tetrahedra, const std::vector<Vector3>& positions,
                  std::vector<double>& sums) {
  for (const NeoHookeanElement& element : tetrahedra) {
    const NeoHookeanElement::Vectors x = gather(element, positions);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) sums[element.vertices[i]] += element.block(x, i, j).norm();
    }
  }
}

/// y += stiffness x of tetrahedra at rest: V (mu (H + H^T) + lambda tr H) g_i, H the gradient of x.
void add_product(const std::vector<NeoHookeanElement>& tetrahedra, const std::vector<Vector3>& x,
                 std::vector<Vector3>& y) {
  for (const NeoHookeanElement& element : tetrahedra) {
    const Matrix3 h = element.deformation_gradient(gather(element, x));
    Matrix3 stress = element.moduli.mu * (h + h.transpose());
    stress.diagonal().array() += element.moduli.lambda * h.trace();
    const Matrix3 pull = element.volume * stress * element.inverse_rest.transpose();
    for (int i = 0; i < 3; ++i) y[element.vertices[static_cast<std::size_t>(i) + 1]] += pull.col(i);
    y[element.vertices[0]] -= pull.col(0) + pull.col(1) + pull.col(2);
  }
}

std::vector<Vector3> random_vectors(std::size_t n) {
  std::vector<Vector3> x(n);
  std::uint32_t random = 1;
  for (Vector3& v : x) {
    for (double& component : {std::ref(v.x()), std::ref(v.y()), std::ref(v.z())}) {
      random = random * 1664525u + 1013904223u;
      component = static_cast<double>(random) / 4294967296.0 - 0.5;
    }
  }
  return x;
}

/// Lanczos without reorthogonalisation: its copies of an eigenvalue do not move the largest. From below, as power
/// iteration.
template <class Product>
double largest_of_many(const RestShape& shape, Product&& product) {
  const std::size_t n = shape.positions.size();
  std::vector<Vector3> x = random_vectors(n);
  std::vector<Vector3> before(n, Vector3::Zero());
  std::vector<Vector3> y(n);
  double length = 0.0;  // of x
  for (std::size_t i = 0; i < n; ++i) {
    if (!(shape.inverse_mass[i] > 0.0)) x[i].setZero();
    length += x[i].squaredNorm();
  }
  length = std::sqrt(length);
  Eigen::VectorXd diagonal(lanczos_steps);
  Eigen::VectorXd beside(lanczos_steps);
  int steps = 0;
  while (steps < lanczos_steps && length > 0.0) {
    for (std::size_t i = 0; i < n; ++i) {
      x[i] *= std::sqrt(shape.inverse_mass[i]) / length;
      y[i].setZero();
    }
    product(x, y);
    double along = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      y[i] *= std::sqrt(shape.inverse_mass[i]);
      if (shape.inverse_mass[i] > 0.0) x[i] /= std::sqrt(shape.inverse_mass[i]);
      along += x[i].dot(y[i]);
    }
    const double back = steps > 0 ? beside[steps - 1] : 0.0;
    length = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      y[i] -= along * x[i] + back * before[i];
      length += y[i].squaredNorm();
    }
    length = std::sqrt(length);
    diagonal[steps] = along;
    beside[steps] = length;
    ++steps;
    before.swap(x);
    x.swap(y);
  }
  if (steps == 0) return 0.0;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal.head(steps), beside.head(steps - 1), Eigen::EigenvaluesOnly);
  return solver.eigenvalues().maxCoeff();
}

/// The largest eigenvalue of M^-1/2 A M^-1/2, where product(x, y) adds A x to y.
template <class Product>
double largest_eigenvalue(const RestShape& shape, Product&& product) {
  const std::size_t n = shape.positions.size();
  if (n > many_vertices) return largest_of_many(shape, product);
  std::vector<Vector3> x = random_vectors(n);
  std::vector<Vector3> y(n);

  double eigenvalue = 0.0;
  for (int iteration = 0; iteration < power_iterations; ++iteration) {
    double norm = 0.0;
    for (const Vector3& v : x) norm += v.squaredNorm();
    if (!(norm > 0.0)) return 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      y[i].setZero();
      x[i] *= std::sqrt(shape.inverse_mass[i] / norm);
    }
    product(x, y);
    eigenvalue = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      y[i] *= std::sqrt(shape.inverse_mass[i]);
      eigenvalue += y[i].squaredNorm();
    }
    eigenvalue = std::sqrt(eigenvalue);
    x.swap(y);
  }
  return eigenvalue;
}

template <class Kind>
double stiffest_of(const std::vector<Kind>& elements, const RestShape& shape, const std::vector<Vector3>& positions) {
  ElementVectors<Kind> gradient;
  double stiffest = 0.0;
  for (const Kind& element : elements) {
    element.evaluate(gather(element, positions), gradient);
    double slope = 0.0;
    for (std::size_t i = 0; i < Kind::size; ++i) {
      slope += gradient[i].squaredNorm() * shape.inverse_mass[element.vertices[i]];
    }
    stiffest = std::max(stiffest, element.stiffness * slope);
  }
  return stiffest;
}

double stiffest_of(const std::vector<NeoHookeanElement>& elements, const RestShape& shape,
                   const std::vector<Vector3>& positions) {
  double stiffest = 0.0;
  for (const NeoHookeanElement& element : elements) {
    const NeoHookeanElement::Vectors x = gather(element, positions);
    for (std::size_t i = 0; i < 4; ++i) {
      stiffest = std::max(stiffest, element.stiffness(x, i) * shape.inverse_mass[element.vertices[i]]);
    }
  }
  return stiffest;
}

}  // namespace

double stiffest_element(const RestShape& shape, const std::vector<Vector3>& positions) {
  return std::max({stiffest_of(shape.distances, shape, positions), stiffest_of(shape.areas, shape, positions),
                   stiffest_of(shape.volumes, shape, positions), stiffest_of(shape.tetrahedra, shape, positions)});
}

void apply_mass_floor(double fraction, RestShape& shape) {
  std::vector<double> sums(shape.positions.size(), 0.0);
  add_row_sums(shape.distances, shape.positions, sums);
  add_row_sums(shape.areas, shape.positions, sums);
  add_row_sums(shape.volumes, shape.positions, sums);
  add_row_sums(shape.tetrahedra, shape.positions, sums);

  double total = 0.0;
  double fastest = 0.0;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (shape.attached[i]) sums[i] = 0.0;  // never moves
    total += shape.mass[i];
    if (shape.mass[i] > 0.0) fastest = std::max(fastest, sums[i] / shape.mass[i]);
  }
  const auto added_at = [&](double bound) {
    double added = 0.0;
    for (std::size_t i = 0; i < sums.size(); ++i) added += std::max(0.0, sums[i] / bound - shape.mass[i]);
    return added;
  };

  double too_low = 0.0;
  double enough = fastest;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (too_low + enough);
    (added_at(middle) > fraction * total ? too_low : enough) = middle;
  }
  if (!(enough > 0.0)) return;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double raised = std::max(shape.mass[i], sums[i] / enough);
    shape.added_mass += raised - shape.mass[i];
    shape.mass[i] = raised;
  }
}

namespace {

/// y += factor (gradient . x) gradient, of the enclosed volume.
void add_enclosed(double factor, const std::vector<Vector3>& gradient, const std::vector<Vector3>& x,
                  std::vector<Vector3>& y) {
  if (!(factor > 0.0)) return;
  double along = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) along += gradient[i].dot(x[i]);
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += factor * along * gradient[i];
}

std::vector<Vector3> enclosed_gradient(const RestShape& shape) {
  std::vector<Vector3> gradient(shape.positions.size());
  if (shape.enclosed.stiffness > 0.0) shape.enclosed.evaluate(shape.positions, shape.wall_triangles(), gradient);
  return gradient;
}

}  // namespace

void add_stiffness_product(const RestShape& shape, const std::vector<Vector3>& x, std::vector<Vector3>& y) {
  add_product(shape.distances, &DistanceElement::stiffness, shape, x, y);
  add_product(shape.areas, &AreaElement::stiffness, shape, x, y);
  add_product(shape.volumes, &VolumeElement::stiffness, shape, x, y);
  add_product(shape.tetrahedra, x, y);
  if (shape.enclosed.stiffness > 0.0) add_enclosed(shape.enclosed.stiffness, enclosed_gradient(shape), x, y);
}

double fastest_frequency(const RestShape& shape) {
  return std::sqrt(largest_eigenvalue(
      shape, [&](const std::vector<Vector3>& x, std::vector<Vector3>& y) { add_stiffness_product(shape, x, y); }));
}

double stable_substep(const RestShape& shape, double safety, double damping_safety) {
  const double omega_squared = square(shape.fastest_frequency);
  const std::vector<Vector3> gradient = enclosed_gradient(shape);
  const double lambda = shape.damping_time * omega_squared +
                        largest_eigenvalue(shape, [&](const std::vector<Vector3>& x, std::vector<Vector3>& y) {
                          add_product(shape.distances, &DistanceElement::damping, shape, x, y);
                          add_product(shape.areas, &AreaElement::damping, shape, x, y);
                          add_product(shape.volumes, &VolumeElement::damping, shape, x, y);
                          add_enclosed(shape.enclosed.damping, gradient, x, y);
                        });

  const double a = omega_squared / (4.0 * safety * safety);
  const double b = lambda / (2.0 * damping_safety);
  return a > 0.0 ? (std::sqrt(b * b + 4.0 * a) - b) / (2.0 * a) : 0.0;
}

}  // namespace tissue_sim
