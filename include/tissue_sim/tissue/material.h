#pragma once

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// Stiffness of a wall in the terms of its elements.
struct WallStiffness {
  double distance = 0.0;  ///< sigma_D, N/m: sum of the distance elements' k per area
  double area = 0.0;      ///< sigma_A, N/m: sum of the area elements' k per area
  double bending = 0.0;   ///< D, N m: plate stiffness E h^3 / (12 (1 - nu^2))
  double membrane = 0.0;  ///< E h, N/m
};

/// The wall of an organ as distance and area elements. The average over all directions of the plane of sigma_D/2
/// (e.n.n)^2 gives mu = lambda = sigma_D/8, the area elements add sigma_A to lambda, and plane stress asks for mu = E h
/// / (2 (1 + nu)) and lambda = E h nu / (1 - nu^2). Hence sigma_D = 4 E h / (1 + nu) and sigma_A = lambda - mu, which
/// is not negative for nu >= 1/3.
WallStiffness wall_stiffness(const Material& material, double wall_thickness);

}  // namespace tissue_sim
