#pragma once

#include <vector>

#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// m. How far a push into a wall reaches before its curvature holds it: (D R^2 / (E h))^(1/4), with the plate stiffness
/// D and the membrane stiffness E h of wall_stiffness() and R the radius of curvature, whose median over the surface is
/// taken (Reissner 1946: 0.57 sqrt(R h) for a Poisson's ratio of 0.45).
double bending_length(const Organ& organ);

/// What is simulated in place of a hollow organ's own surface, which it carries.
struct CoarseShell {
  TriangleMesh mesh;  ///< empty where the organ's own is simulated
  Embedding embedding;
  std::vector<int> attached;  ///< vertices of `mesh`, ascending: as much of the surface as the organ holds
  /// The bending stiffness that makes up for the coarser mesh, which cannot follow a dent and so is too stiff. 1 for
  /// the mesh of the organ.
  double bending = 1.0;
};

/// m. Edges of the shell that stays within the organ's levels_tolerance, which it needs to have.
double shell_edge(const Organ& organ);

/// The coarsest shell that stays within the organ's levels_tolerance. Empty without one, and where that shell would
/// have nearly as many triangles as the organ's own mesh.
CoarseShell coarse_shell(const Organ& organ);

}  // namespace tissue_sim
