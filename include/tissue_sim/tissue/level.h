#pragma once

#include <vector>

#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// How large the active regions of a `fem` organ are, by the tolerance of its levels.
struct RegionSize {
  double edges = 0.0;  ///< radius of a region over the edge of its level
  double cells = 0.0;  ///< ... and over the cell of the next coarser level
};
RegionSize region_size(double tolerance);

/// A coarser copy of the whole organ: a lattice of neo-Hookean tetrahedra, each as stiff and as heavy as the solid that
/// it holds. It carries the deformation of the whole where finer levels are asleep.
struct Level {
  RestShape shape;
  double edge = 0.0;  ///< m, of its cells
  Embedding finer;    ///< the vertices of the next finer level, corners into `shape`
  Embedding pins;     ///< places of the lattice that are attached
  Embedding bearing;  ///< how they hand on forces: more to the corners that hold more tissue
};

/// The coarser levels of a `fem` organ, the finest first. Empty where a region of the organ's own tetrahedra would be
/// most of it.
std::vector<Level> build_levels(const Organ& organ, const RestShape& finest);

/// m, the median edge of the smallest quarter of the tetrahedra. A graded mesh is fine where it will be touched, and
/// its regions have to be as small as that asks for: the median of all would follow the coarse rest of a large organ.
double fine_edge(const RestShape& shape);

}  // namespace tissue_sim
