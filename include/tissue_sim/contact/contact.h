#pragma once

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// A point of an organ's surface that an instrument presses on. Scene frame, SI units.
struct OrganContact {
  int organ = 0;
  int instrument = 0;
  int part = 0;                            ///< of the instrument
  int triangle = 0;                        ///< of the organ
  Vector3 barycentric = Vector3::UnitX();  ///< one entry is 1 for a colliding vertex
  Vector3 point = Vector3::Zero();
  Vector3 direction = Vector3::UnitZ();  ///< unit, out of the instrument: the way the organ is pushed
  double depth = 0.0;                    ///< m, how far the instrument has pushed this point from its rest place
  Vector3 force = Vector3::Zero();       ///< N, on the organ, mean over the step
};

}  // namespace tissue_sim
