#pragma once

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// A coarser mesh of the same surface: as many triangles as equilateral ones with sides of `edge` (m) would cover it
/// with, nearly all alike, enclosing the same volume. The shortest edge is collapsed first, to where the planes of the
/// triangles that it stands for are nearest (Garland and Heckbert 1997); then edges are flipped and vertices moved
/// along the surface until the triangles are about equilateral.
///
/// Needs a closed manifold mesh (inspect()) and gives one of as many surfaces and handles; where these, or sharp turns,
/// allow no more, triangles stay smaller. Finer than it is no mesh gets: it is returned as it is. The same bits for the
/// same input.
TriangleMesh coarsen(const TriangleMesh& mesh, double edge);

}  // namespace tissue_sim
