#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

using Matrix3 = Eigen::Matrix3d;

/// Moduli of an isotropic solid in Pa.
struct LameModuli {
  double mu = 0.0;      ///< shear modulus, E / (2 (1 + nu))
  double lambda = 0.0;  ///< E nu / ((1 + nu) (1 - 2 nu))
};

inline LameModuli lame_moduli(double young, double poisson) {
  return {young / (2.0 * (1.0 + poisson)), young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))};
}

/// What one vertex sees of an energy: its gradient (N) and second derivative (N/m).
struct LocalStiffness {
  Vector3 gradient = Vector3::Zero();
  Matrix3 block = Matrix3::Zero();
};

/// A linear tetrahedron of stable neo-Hookean tissue, total Lagrangian (Smith, de Goes and Kim, "Stable Neo-Hookean
/// Flesh Simulation", 2018, without the logarithm of their last form): with the deformation gradient F, its determinant
/// J and L = lambda + mu,
///   E = V (mu/2 (|F|^2 - 3) - mu (J - 1) + L/2 (J - 1)^2).
/// It is zero and at its minimum at rest, has the moduli mu and lambda at small strain, and stays finite and smooth
/// when a tetrahedron is flattened or turned inside out. J is linear in each corner, so the second derivative by one
/// corner is positive definite everywhere, exactly and without any projection.
struct NeoHookeanElement {
  static constexpr std::size_t size = 4;
  using Vectors = std::array<Vector3, size>;

  std::array<int, size> vertices{};
  Matrix3 inverse_rest = Matrix3::Zero();  ///< 1/m, of the matrix with columns x1 - x0, x2 - x0, x3 - x0 at rest
  double volume = 0.0;                     ///< m^3, at rest; positive
  LameModuli moduli;

  /// From positions at rest, of positive volume.
  static NeoHookeanElement at_rest(const std::array<int, size>& vertices, const Vectors& rest,
                                   const LameModuli& moduli) {
    NeoHookeanElement element;
    element.vertices = vertices;
    element.moduli = moduli;
    Matrix3 edges;
    edges << rest[1] - rest[0], rest[2] - rest[0], rest[3] - rest[0];
    element.volume = edges.determinant() / 6.0;
    element.inverse_rest = edges.inverse();
    return element;
  }

  /// Gradient of corner i's shape function at rest, 1/m: F is the sum over the corners of x_i times its transpose.
  Vector3 shape_gradient(std::size_t corner) const {
    if (corner > 0) return inverse_rest.row(static_cast<Eigen::Index>(corner) - 1);
    return -inverse_rest.colwise().sum().transpose();
  }

  Matrix3 deformation_gradient(const Vectors& x) const {
    Matrix3 edges;
    edges << x[1] - x[0], x[2] - x[0], x[3] - x[0];
    return edges * inverse_rest;
  }

  /// Derivative of the determinant by F.
  static Matrix3 cofactors(const Matrix3& f) {
    Matrix3 result;
    result << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
    return result;
  }

  /// Returns the energy (J) and writes its gradient (N) at every corner; the force is minus that.
  double evaluate(const Vectors& x, Vectors& gradient) const {
    const Matrix3 f = deformation_gradient(x);
    const Matrix3 c = cofactors(f);
    const double stretch = f.col(0).dot(c.col(0)) - 1.0;  // J - 1
    const double stiff = moduli.lambda + moduli.mu;
    const Matrix3 stress = moduli.mu * f + (stiff * stretch - moduli.mu) * c;  // first Piola-Kirchhoff, Pa
    const Matrix3 pull = volume * stress * inverse_rest.transpose();
    for (int i = 0; i < 3; ++i) gradient[static_cast<std::size_t>(i) + 1] = pull.col(i);
    gradient[0] = -(pull.col(0) + pull.col(1) + pull.col(2));
    return energy(f, stretch);
  }

  /// J, as evaluate(), in a third of the time.
  double energy(const Vectors& x) const {
    const Matrix3 f = deformation_gradient(x);
    return energy(f, f.col(0).dot(f.col(1).cross(f.col(2))) - 1.0);
  }
  double energy(const Matrix3& f, double stretch) const {
    const double stiff = moduli.lambda + moduli.mu;
    return volume * (0.5 * moduli.mu * (f.squaredNorm() - 3.0) - moduli.mu * stretch + 0.5 * stiff * stretch * stretch);
  }

  /// What one corner sees. Its block is V (mu |g|^2 1 + L (C g)(C g)^T), g its shape gradient and C the cofactors of F:
  /// positive definite.
  LocalStiffness local(const Vectors& x, std::size_t corner) const {
    const Matrix3 f = deformation_gradient(x);
    const Matrix3 c = cofactors(f);
    const Vector3 g = shape_gradient(corner);
    const Vector3 cg = c * g;
    const double stretch = f.col(0).dot(c.col(0)) - 1.0;
    const double stiff = moduli.lambda + moduli.mu;
    LocalStiffness result;
    result.gradient = volume * (moduli.mu * (f * g) + (stiff * stretch - moduli.mu) * cg);
    result.block = volume * stiff * cg * cg.transpose();
    result.block.diagonal().array() += volume * moduli.mu * g.squaredNorm();
    return result;
  }
  Matrix3 block(const Vectors& x, std::size_t corner) const { return local(x, corner).block; }

  /// How stiffly the tetrahedron holds the corner, N/m: the largest eigenvalue of its block, and what volume that is
  /// lost or won adds between corners. Grows where the tetrahedron is stretched or pressed flat.
  double stiffness(const Vectors& x, std::size_t corner) const { return stiffnesses(x)[corner]; }

  /// The same of all four.
  std::array<double, 4> stiffnesses(const Vectors& x) const {
    const Matrix3 f = deformation_gradient(x);
    const Matrix3 c = cofactors(f);
    const double stiff = moduli.lambda + moduli.mu;
    const double stretch = f.col(0).dot(c.col(0)) - 1.0;
    std::array<double, 4> of_corners{};
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const Vector3 g = shape_gradient(corner);
      of_corners[corner] =
          volume * ((moduli.mu + std::abs(stiff * stretch)) * g.squaredNorm() + stiff * (c * g).squaredNorm());
    }
    return of_corners;
  }

  /// Second derivative of the energy by corners i (rows) and j (columns), N/m. Exact, so not always positive definite.
  Matrix3 block(const Vectors& x, std::size_t i, std::size_t j) const {
    const Matrix3 f = deformation_gradient(x);
    const Matrix3 c = cofactors(f);
    const double stretch = f.col(0).dot(c.col(0)) - 1.0;
    const double stiff = moduli.lambda + moduli.mu;
    const Vector3 gi = shape_gradient(i);
    const Vector3 gj = shape_gradient(j);
    // J moves corner j along C g_j; C g_i turns with corner j as F (g_j x g_i) does, crossed from the left.
    const Vector3 turn = f * gi.cross(gj);
    Matrix3 crossed;
    crossed << 0.0, -turn.z(), turn.y(), turn.z(), 0.0, -turn.x(), -turn.y(), turn.x(), 0.0;
    return volume * (moduli.mu * gi.dot(gj) * Matrix3::Identity() + stiff * (c * gi) * (c * gj).transpose() +
                     (stiff * stretch - moduli.mu) * -crossed);
  }
};

}  // namespace tissue_sim
