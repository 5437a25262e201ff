#pragma once

#include <functional>

#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

/// Cuts every triangle into four at the middles of its edges; the old vertices stay first.
TriangleMesh subdivide(const TriangleMesh& mesh);

/// Bisects edges, the longest first, with all the tetrahedra around them, until none is longer than `longest` (m) at
/// its middle. Fits together everywhere. New vertices come last; the surface keeps its shape.
void refine(TetrahedralMesh& mesh, const std::function<double(const Vector3&)>& longest);

}  // namespace tissue_sim
