#pragma once

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/simulation/awake_solid.h"
#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

/// Impulses (N s) on a few vertices of a level.
struct FewImpulses {
  std::vector<Vector3> impulses;  ///< per vertex, zero but for those that are listed
  std::vector<int> vertices;

  void add(int vertex, const Vector3& impulse) {
    if (impulse.isZero(0.0)) return;
    if (impulses[vertex].isZero(0.0)) vertices.push_back(vertex);
    impulses[vertex] += impulse;
  }
  template <class Visit>
  void take_all(const Visit& visit) {
    for (const int v : vertices) {
      visit(v, impulses[v]);
      impulses[v].setZero();
    }
    vertices.clear();
  }
};

/// Room for the levels of one organ, one entry a level: the first is the organ's own tetrahedra.
struct LevelsRoom {
  std::vector<RegionRoom> regions;  ///< of all but the coarsest; or of a wall
  std::vector<AwakeSolid> awake;
  std::vector<FewImpulses> handed;   ///< of the contacts
  Vector3 common = Vector3::Zero();  ///< m, a displacement that the motion in `awake` is measured from
  std::vector<char> touching;        ///< per piece
};
void prepare(LevelsRoom& room, const OrganModel& model);

/// Everything asleep, at rest.
void rest_levels(const OrganModel& model, std::size_t pieces, OrganState& state);

/// Wakes what is near the contact points and lets the rest of the finer levels fall asleep. Returns the farthest way
/// (m) of a vertex that fell asleep.
double wake(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state, LevelsRoom& room);

/// Substeps of every coarser level in a step of `duration` (s); each divides that of the level before. Raises
/// `substeps`, those of the organ's own tetrahedra, to what makes all of them together cheapest.
void share_substeps(const OrganModel& model, double duration, OrganState& state, int& substeps);

/// Moves the coarser levels whose substep begins with substep `substep` (1 is the first) of the organ's own
/// tetrahedra, which takes dt (s). Returns the largest speed (m/s) in the last substep of any of them.
double move_coarser(const OrganModel& model, const Vector3& gravity, int substep, int substeps, double dt,
                    OrganState& state, LevelsRoom& room);

/// The forces (N) on the organ's own free vertices: of its tetrahedra, and of the springs towards the coarser level.
void solid_forces(const OrganModel& model, double dt, OrganState& state, LevelsRoom& room);

/// What follows the coarser level goes where that has it at the end of the substep.
void follow_coarser(double dt, OrganState& state, LevelsRoom& room);

/// Hands the impulses of the contact points to the coarser levels.
void press_coarser(const OrganModel& model, const std::vector<ContactPoint>& points, OrganState& state,
                   LevelsRoom& room);

/// Whether the step leaves surface vertices where they are although the organ has moved: those that a solid or a shell
/// carries, and those that are asleep.
bool moves_less_than_it_shows(const OrganModel& model);

/// Puts such vertices (first .. last - 1 are their numbers) where they are now.
void place(const OrganModel& model, const int* first, const int* last, OrganState& state);

/// The same for all vertices, inner ones too.
void place_all(const OrganModel& model, OrganState& state);

/// The same for the corners of a triangle, and for the whole surface.
void place(const OrganModel& model, int triangle, OrganState& state);
void place_surface(const OrganModel& model, OrganState& state);

}  // namespace tissue_sim
