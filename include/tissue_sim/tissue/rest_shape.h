#pragma once

#include <vector>

#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/tissue/area.h"
#include "tissue_sim/tissue/constraint_batch.h"
#include "tissue_sim/tissue/distance.h"
#include "tissue_sim/tissue/element_chunks.h"
#include "tissue_sim/tissue/enclosed_volume.h"
#include "tissue_sim/tissue/lattice_cubes.h"
#include "tissue_sim/tissue/neo_hookean_batch.h"
#include "tissue_sim/tissue/volume.h"

namespace tissue_sim {

/// What is known of an organ before anything moves: topology, rest measures, masses, elements. Built once, never
/// changed.
struct RestShape {
  /// m, scene frame. First the surface's vertices, which contact works on. Behind them the inner vertices of a solid;
  /// or, where the surface is embedded, all vertices of the solid or the coarse shell that carries it.
  std::vector<Vector3> positions;
  int surface_vertices = 0;
  int first_simulated = 0;   ///< the vertices before it are carried: without mass, moved by `embedding`
  Embedding embedding;       ///< one entry a carried vertex, corners into `positions`
  double carried_way = 1.0;  ///< how far a carried vertex goes at most when no bearer goes farther than 1
  std::vector<Triangle> triangles;
  MeshTopology topology;
  std::vector<Triangle> shell;       ///< of the coarse shell that carries the surface, else empty
  MeshTopology shell_topology;       ///< of the shell; of all vertices, of which the carried ones have no edges
  double shell_bending = 1.0;        ///< what its bending stiffness is multiplied by, see CoarseShell
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
  std::vector<VolumeElement> volumes;         ///< flaps of a wall, tetrahedra of a solid
  std::vector<NeoHookeanElement> tetrahedra;  ///< `fem`
  NeoHookeanSolid packed;                     ///< the same tetrahedra for the explicit integrator, else empty
  LatticeCubes cubes;                         ///< those of a lattice, in place of `packed`
  ConstraintBatches constraints;              ///< the same distances, areas and volumes, likewise
  ElementChunks chunks;                       ///< of both, where there are many
  EnclosedVolume enclosed;
  double stiffness_correction = 1.0;  ///< of `volume`, from a patch test on the organ's own mesh
  double damping_time = 0.0;  ///< s, of the tetrahedra: their forces are those of positions + damping_time velocities
  double fastest_frequency = 0.0;  ///< rad/s, undamped, at rest
  double stable_substep = 0.0;     ///< s; 0: nothing to integrate
  double stiffest_element = 0.0;   ///< 1/s^2, see stiffest_element()

  bool elastic() const { return !distances.empty() || !tetrahedra.empty(); }

  /// The triangles that a hollow organ's wall is made of.
  const std::vector<Triangle>& wall_triangles() const { return shell.empty() ? triangles : shell; }
  const MeshTopology& wall_topology() const { return shell.empty() ? topology : shell_topology; }
};

/// Builds what the organ's model asks for, and no more.
RestShape build_rest_shape(const Organ& organ);

/// Puts a carried vertex, or all of them, where their bearers are.
void carry(const RestShape& shape, int vertex, std::vector<Vector3>& positions);
void carry_surface(const RestShape& shape, std::vector<Vector3>& positions);

}  // namespace tissue_sim
