#pragma once

#include <string>
#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// What it costs to load an organ, from its file to the first step. Seconds on one core.
struct LoadCost {
  std::string file;  ///< "obj" or "stl"
  Model model = Model::contact_only;
  int triangles = 0;
  double whole = 0.0;       ///< scene file to timeline, as every program does it
  double read = 0.0;        ///< the mesh file, as it is
  double mend = 0.0;        ///< welded, checked, turned outward
  double topology = 0.0;    ///< edges and neighbours
  double rest_shape = 0.0;  ///< elements, masses, stable substep; without the topology
  double tree = 0.0;        ///< boxes, tree and room for a step
  double memory = 0.0;      ///< bytes, the most that the process had resident while it loaded the whole
};

/// An ellipsoid of 20 n^2 triangles of about one size: an icosahedron, each side cut in n. Semi-axes in metres.
TriangleMesh make_ellipsoid(const Vector3& semi_axes, int n);

/// Wavefront OBJ: shared vertices, every coordinate in enough digits to come back as the float it was read as.
void write_obj(const TriangleMesh& mesh, const std::string& path);

/// Binary STL: three vertices a triangle, none shared.
void write_stl(const TriangleMesh& mesh, const std::string& path);

/// Loads an ellipsoid of about `triangles` triangles as OBJ and as STL, as `contact_only` and as `surface`. Writes its
/// files into a folder of its own under the system's temporary one, and removes it. Throws SceneError.
std::vector<LoadCost> time_loading(int triangles);

}  // namespace tissue_sim
