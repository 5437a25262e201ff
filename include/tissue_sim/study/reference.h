#pragma once

#include <array>
#include <functional>
#include <vector>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/geometry/tetrahedral_mesh.h"
#include "tissue_sim/tissue/neo_hookean.h"

namespace tissue_sim {

/// Where a point is to a rigid obstacle.
struct ObstaclePoint {
  double depth = 0.0;              ///< m, positive inside, 0 on the surface
  Vector3 direction{0, 0, 0};      ///< unit, the shortest way out
  Matrix3 turn = Matrix3::Zero();  ///< 1/m, derivative of the direction by the point; 0 where the surface is flat
};
using Obstacle = std::function<ObstaclePoint(const Vector3&)>;

Obstacle rigid_sphere(const Vector3& centre, double radius);

/// Depth and direction of closest_feature(), each triangle flat. Keeps a reference to `surface`.
Obstacle rigid_surface(const InstrumentSurface& surface, const Pose& pose);

/// A solid at rest under dead loads, held vertices and a rigid, frictionless obstacle that no vertex of `surface` may
/// be inside of. Lists of vectors may be empty: all zero, none held.
struct ReferenceProblem {
  const TetrahedralMesh& mesh;
  std::vector<LameModuli> moduli;            ///< one for all, or one a tetrahedron
  std::vector<std::array<bool, 3>> fixed{};  ///< a vertex, along x, y and z
  std::vector<Vector3> prescribed{};         ///< m a vertex: its displacement along the axes in which it is fixed
  std::vector<Vector3> forces{};             ///< N a vertex
  Obstacle obstacle{};                       ///< may be empty
  Vector3 approach{0, 0, 0};                 ///< m, how far the obstacle has come; it comes in the load steps
  std::vector<int> surface{};                ///< the vertices that may touch the obstacle
};

/// An obstacle should come by less than half its thickness in a load step, or vertices leave it on its far side.
/// Positions to start with choose among several equilibria, which a facetted obstacle has (vertices on either side of
/// its edges; 0.1 % of the force with a sphere of 32 slices): what is on the obstacle, or within a thousandth of the
/// solid's size of it, begins in contact.
struct ReferenceOptions {
  double tolerance = 1e-7;       ///< of the residual to the reaction
  int load_steps = 1;            ///< displacements, forces and the obstacle's approach grow in as many equal steps
  int max_iterations = 30;       ///< of Newton in a load step; where they do not do, it is halved (to 1/64)
  std::vector<Vector3> start{};  ///< m, positions to begin with; empty: at rest
};

struct ReferenceSolution {
  std::vector<Vector3> positions;        ///< m
  std::vector<Vector3> internal_forces;  ///< N, the solid's own on every vertex
  std::vector<int> contacts;             ///< vertices on the obstacle, ascending
  Vector3 contact_force{0, 0, 0};        ///< N, on the obstacle
  int iterations = 0;                    ///< of Newton, in all load steps
  double residual = 0.0;                 ///< 2-norm of the forces left over, a part of that of the reactions
  bool converged = false;  ///< residual within tolerance, no vertex inside the obstacle, none pulled to it
};

/// Static equilibrium of stable neo-Hookean tetrahedra: Newton with the exact second derivative, Armijo line search on
/// the energy and a sparse Cholesky factorisation. Contact is an active set: a vertex in contact stays on the
/// obstacle's surface (its closest point, so that curvature is exact) and slides along it; it is let go when it is
/// pulled. Reactions so small that rounding would decide (1e-8 of the shear modulus times the square of the solid's
/// size) count as that much. Same input, same bits. Throws std::invalid_argument when the problem's lists do not fit
/// the mesh.
ReferenceSolution solve_statics(const ReferenceProblem& problem, const ReferenceOptions& options = {});

}  // namespace tissue_sim
