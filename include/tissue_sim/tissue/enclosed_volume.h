#pragma once

#include <vector>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// Keeps what a closed surface encloses: C = (V - V0) / V0 over all of its triangles, one element for the whole organ.
struct EnclosedVolume {
  double rest = 0.0;       ///< V0, m^3
  double stiffness = 0.0;  ///< k, J; 0: not modelled
  double damping = 0.0;    ///< d, J s
  double wall = 0.0;       ///< J, the stiffness of the wall against the same C when all of it is blown up alike

  /// Returns C and writes its gradient (1/m), one entry a vertex.
  double evaluate(const std::vector<Vector3>& positions, const std::vector<Triangle>& triangles,
                  std::vector<Vector3>& gradient) const;
};

}  // namespace tissue_sim
