#include "tissue_sim/tissue/material.h"

#include <algorithm>

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

WallStiffness wall_stiffness(const Material& material, double wall_thickness) {
  const double nu = material.poisson;
  WallStiffness wall;
  wall.membrane = material.young * wall_thickness;
  const double mu = wall.membrane / (2.0 * (1.0 + nu));
  const double lambda = wall.membrane * nu / (1.0 - nu * nu);
  wall.distance = 8.0 * mu;
  wall.area = std::max(0.0, lambda - mu);  // 1/3 rounds to a hair below zero
  wall.bending = material.young * cube(wall_thickness) / (12.0 * (1.0 - nu * nu));
  return wall;
}

}  // namespace tissue_sim
