#pragma once

#include <vector>

#include "tissue_sim/simulation/active_region.h"

namespace tissue_sim {

/// Four awake vertices of the next coarser level, and how much of each.
struct Follower {
  std::array<int, 4> corners{};
  std::array<float, 4> weights{};
  bool attached = false;  ///< stays at its rest place instead
};

/// A free vertex that a spring pulls towards the coarser level.
struct BandVertex {
  int vertex = 0;          ///< among the awake ones
  double mass = 0.0;       ///< kg, of the vertex
  double stiffness = 0.0;  ///< N/m, of the spring: 0 where the band begins
  double damping = 0.0;    ///< N s/m, of the motion against the coarser level
  Follower follower;
  Eigen::Vector4f target = Eigen::Vector4f::Zero();    ///< m, as AwakeSolid::displacements
  Eigen::Vector4f velocity = Eigen::Vector4f::Zero();  ///< m/s, of the target
};

/// A place of a lattice that stays where it is.
struct Pin {
  std::array<int, 4> corners{};  ///< among the awake vertices
  std::array<double, 4> weights{};
  double ease = 0.0;  ///< 1/kg, how easily it moves
};

/// What is awake of one level, side by side. It follows from the centres of the region: the next step reads nothing of
/// it. Motion is kept in floats, so it is measured from a common displacement: that of an organ that has fallen far
/// would leave no digits for its strain.
struct AwakeSolid {
  std::vector<Vector3> made_from;   ///< centres of the region
  std::vector<int> vertices;        ///< of the level: the free ones, in their order; those that follow the coarser one
  std::size_t free = 0;             ///< so many of them
  std::size_t corners = 0;          ///< so many have tetrahedra; behind them what only carries the finer level
  std::vector<int> place;           ///< of each vertex of the level among `vertices`, or -1
  NeoHookeanSolid packed;           ///< tetrahedra with a free corner, by places in `vertices`
  LatticeCubes cubes;               ///< those of a lattice instead
  std::vector<Follower> followers;  ///< one for each of `vertices` that is not free
  std::vector<BandVertex> band;     ///< the outermost of the free ones
  std::vector<Pin> pins;            ///< all of whose corners are awake
  std::vector<Eigen::Vector4f> displacements;  ///< m, one for each of `vertices`, less the common one
  std::vector<Eigen::Vector4f> velocities;     ///< m/s
  std::vector<Eigen::Vector4f> damped;         ///< m: where they will be after the damping time
  std::vector<Eigen::Vector4f> forces;         ///< N, of the tetrahedra
};

void prepare(AwakeSolid& awake, const RestShape& shape);

/// Gathers what `region` has awake, around `centres`; `room` is that of the recentre() that woke it. `stiffness` (N/m)
/// is that of the band's springs halfway. Who follows is known when carry_finer() has been called.
void gather(const RegionModel& model, const RestShape& shape, const Embedding& pins, const ActiveRegion& region,
            const RegionRoom& room, double stiffness, AwakeSolid& awake);

/// The same of a level that is awake as a whole.
void gather_all(const RestShape& shape, const Embedding& pins, AwakeSolid& awake);

/// Lists whom the vertices follow that are not free, and the band's targets. What they ask for of the coarser level is
/// added to that one's vertices, if it is not there.
void carry_finer(const Embedding& embedding, const std::vector<char>& attached, AwakeSolid& finer, AwakeSolid& coarser);

/// Forgets what carry_finer() has added.
void carry_nothing(AwakeSolid& awake);

/// The free vertices' motion, as it was `ahead` s ago. `common` is the common displacement, m.
void read_motion(const RestShape& shape, const std::vector<Vector3>& positions, const std::vector<Vector3>& velocities,
                 double ahead, const Vector3& common, AwakeSolid& awake);

/// Puts the followers, and the band's targets, where the coarser level is.
void follow(const AwakeSolid& coarser, const Vector3& common, AwakeSolid& finer);

/// Moves them on in a line for dt (s).
void follow_on(double dt, AwakeSolid& awake);

/// The forces (N) of tetrahedra and band on the free vertices. A spring is no stiffer, and no more damped, than a
/// substep of dt (s) is stable for.
void solid_forces(const RestShape& shape, double dt, AwakeSolid& awake);

}  // namespace tissue_sim
