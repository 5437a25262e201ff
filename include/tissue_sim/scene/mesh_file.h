#pragma once

#include <string>
#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Vertices closer than this (m, after scaling) are one: 1e-5 mm. STL names no shared vertex, and exporters that
/// compute a corner twice differ in its last bits; exact comparison left 20 edges of a real wrist mesh open.
constexpr double weld_tolerance = 1e-8;

/// The surface in a mesh file (STL, OBJ, PLY, DAE), as it is, times `scale`: node transforms applied, polygons cut
/// into triangles, normals and colours ignored. COLLADA: its unit is honoured, its up axis is not, as rviz does.
/// Throws SceneError.
TriangleMesh read_mesh(const std::string& path, const Vector3& scale);

/// A mesh fit to be an organ: welded, collapsed and doubled triangles dropped, facing outward; closed, manifold,
/// of one or more components. Warns of what was mended; throws SceneError for what cannot be.
TriangleMesh load_organ_mesh(const std::string& path, double scale, std::vector<std::string>& warnings);

/// The same of a mesh that was read from `path`.
TriangleMesh mend_organ_mesh(const std::string& path, TriangleMesh mesh, std::vector<std::string>& warnings);

struct InstrumentMesh {
  TriangleMesh mesh;
  bool closed = true;  ///< closed and manifold, so that inside and outside are defined everywhere
};

/// A mesh for a piece of an instrument: mended as an organ's, its holes closed too. What is still open or
/// non-manifold is used, with a warning: real instrument meshes are seldom clean.
InstrumentMesh load_instrument_mesh(const std::string& path, const Vector3& scale, std::vector<std::string>& warnings);

}  // namespace tissue_sim
