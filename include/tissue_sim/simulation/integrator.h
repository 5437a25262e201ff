#pragma once

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/simulation/state.h"
#include "tissue_sim/simulation/threads.h"

namespace tissue_sim {

/// How many substeps a step of `duration` (s) takes: as many as the stable substep asks for, more where a solid has
/// been `stiffening` (see below; 0: has no contact); 1 where nothing is integrated.
int substeps_for(const RestShape& rest, double duration, double stiffening = 0.0);

/// The most stiffening that more substeps are taken for, four times as many: beyond, it is a matter of the health
/// check, which begins again with as many.
constexpr double most_stiffening = 11.2;

/// How much stiffer than the stiffest tetrahedron at rest the stiffest at a contact is now, as squared frequency. Where
/// a thin instrument presses deep into small tetrahedra that is far beyond what the substep at rest is stable for.
/// `tetrahedra_at` lists the tetrahedra at each vertex; `bearers` is room.
double stiffening(const RestShape& rest, const FlatLists& tetrahedra_at, const std::vector<ContactPoint>& points,
                  const std::vector<Vector3>& positions, std::vector<int>& bearers);

/// The same of all tetrahedra, wherever they are: an organ that swings freely and far stiffens too.
double stiffening(const RestShape& rest, const std::vector<Vector3>& positions);

/// Packs the elements into the batches that element_forces() computes.
void pack_elements(RestShape& rest);

/// Cuts the batches of a large organ into chunks, for several threads; not for a part of the organ at a time.
void cut_elements(RestShape& rest);

/// Room for element_forces(), one entry a vertex and then one a stand-in (see ElementChunks); empty where the organ's
/// elements need none.
struct ElementRoom {
  /// The vertex whose motion is taken from all others': an attached one, or where none is, any. An organ that has
  /// fallen far has no digits left for its strain in a float.
  std::size_t reference = 0;
  std::vector<Eigen::Vector4f> displacements;  ///< m, of tetrahedra
  std::vector<Eigen::Vector4f> forces;         ///< N, of tetrahedra
  std::vector<VertexMotion> motions;           ///< of the other elements
  std::vector<VertexPull> pulls;
  std::vector<EnclosedShare> shares;  ///< of the enclosed volume
};
void prepare(ElementRoom& room, const RestShape& rest);

/// Where the vertices of an organ or of a level are, m, and how fast, m/s.
struct Moving {
  const std::vector<Vector3>& positions;
  const std::vector<Vector3>& velocities;

  Moving(const std::vector<Vector3>& x, const std::vector<Vector3>& v) : positions(x), velocities(v) {}
  Moving(const OrganState& organ) : positions(organ.positions), velocities(organ.velocities) {}
};

/// Writes the forces (N) of all elements, damping included, on all vertices; those of a large organ by several threads
/// if it is given them, to the same bits.
void element_forces(const RestShape& rest, const Moving& moving, std::vector<Vector3>& forces, ElementRoom& room,
                    Threads* threads = nullptr);

/// The same for a part of a wall whose elements are not cut into chunks: writes the forces of its elements on its
/// vertices, and leaves those on others. What the rest of the surface adds to the enclosed volume is what it added when
/// it was last computed, or nothing if it is at rest.
void element_forces(const RestShape& rest, const Moving& moving, const ActiveElements& active,
                    std::vector<Vector3>& forces, ElementRoom& room);

/// The first half of an explicit (symplectic) substep of dt (s): v += dt (f/m + g), slowed by the drag. Attached and
/// held vertices stay.
void accelerate(const OrganModel& organ, const Vector3& gravity, double dt, const std::vector<Vector3>& forces,
                OrganState& state);

/// The second half: x += dt v. Returns the largest speed of a vertex that moved, m/s.
double advance(const OrganModel& organ, double dt, OrganState& state);

}  // namespace tissue_sim
