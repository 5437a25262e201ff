#pragma once

#include <sstream>
#include <string>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// The mesh as a Wavefront OBJ file, with so many digits.
inline std::string obj_of(const TriangleMesh& mesh, int digits) {
  std::ostringstream text;
  text.precision(digits);
  for (const Vector3& p : mesh.vertices) text << "v " << p.transpose() << "\n";
  for (const Triangle& t : mesh.triangles) text << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  return text.str();
}

}  // namespace tissue_sim
