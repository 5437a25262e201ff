#pragma once

#include <vector>

#include "tissue_sim/scene/scene.h"
#include "tissue_sim/tissue/area.h"
#include "tissue_sim/tissue/distance.h"
#include "tissue_sim/tissue/enclosed_volume.h"
#include "tissue_sim/tissue/volume.h"

namespace tissue_sim {

/// What is known of an organ before anything moves: topology, rest measures, masses, elements. Built once, never
/// changed.
struct RestShape {
  std::vector<Vector3> positions;
  std::vector<Triangle> triangles;
  MeshTopology topology;
  std::vector<int> component_roots;  ///< the first vertex of each connected surface
  double mean_edge = 0.0;            ///< m
  double size = 0.0;                 ///< m, diagonal of the bounding box

  std::vector<char> attached;        ///< 1: held at its rest place
  std::vector<double> mass;          ///< kg, with what the mass floor added; 1 for `contact_only`, which has no masses
  std::vector<double> inverse_mass;  ///< 1/kg; 0 where attached
  double total_mass = 0.0;           ///< kg, with what the floor added
  double added_mass = 0.0;           ///< kg, by the mass floor

  std::vector<DistanceElement> distances;
  std::vector<AreaElement> areas;
  std::vector<VolumeElement> flaps;
  EnclosedVolume enclosed;
  double stable_substep = 0.0;    ///< s; 0: nothing to integrate
  double stiffest_element = 0.0;  ///< 1/s^2, see stiffest_element()

  bool elastic() const { return !distances.empty(); }
};

/// Builds what the organ's model asks for, and no more.
RestShape build_rest_shape(const Organ& organ);

}  // namespace tissue_sim
