#pragma once

#include <cstdint>
#include <vector>

#include "tissue_sim/contact/contact_point.h"
#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/simulation/world.h"

namespace tissue_sim {

/// Contacts of a step that are made room for from the start: more than a tool makes, so that a warm step allocates
/// nothing.
constexpr std::size_t usual_contacts = 256;

/// What was found at a place of contact in the last substep: the next one starts from it.
struct PlaceForce {
  std::size_t place = 0;
  double force = 0.0;     ///< N, that the tissue bears there
  double stopping = 0.0;  ///< N, impulse over dt of the explicit integrator
};

/// What a step changes of a coarser level.
struct LevelState {
  std::vector<Vector3> positions;   ///< m
  std::vector<Vector3> velocities;  ///< m/s
  std::vector<Vector3> push;        ///< N s, of the contacts since the level's last substep
  ActiveRegion region;
  int substeps = 1;    ///< in this step
  double ahead = 0.0;  ///< s, of the substep that the organ's own tetrahedra are in
  double speed = 0.0;  ///< m/s, the largest in its last substep
};

/// What a step changes of one organ, and all that the next step reads of it.
struct OrganState {
  std::vector<Vector3> positions;             ///< m, scene frame, in the order of the rest shape's
  std::vector<Vector3> velocities;            ///< m/s
  std::vector<Vector3> forces;                ///< N, of the elements in the last substep
  std::vector<int> pressed;                   ///< triangles whose corners have a depth
  std::vector<double> depths;                 ///< m, one a surface vertex, 0 where no instrument presses
  std::vector<char> held;                     ///< 1: moved by an instrument and left there; empty with restoration
  std::vector<std::vector<char>> colliding;   ///< per piece, one a vertex: the paper's memory; empty for the flood
  std::vector<std::vector<int>> touching;     ///< per piece: vertices that were in contact in the last substep
  std::vector<Clearance> clearances;          ///< per piece
  std::vector<PlaceForce> pressing;           ///< what the contacts of the last substep bore
  double stiffening = 0.0;                    ///< of an explicit solid in the last substep; see stiffening()
  ActiveRegion region;                        ///< of the organ's own tetrahedra, with levels; or of its wall
  std::vector<LevelState> levels;             ///< the coarser ones, the finest first
  std::vector<std::vector<Vector3>> centres;  ///< per piece: m, rest places of what it touches or has just touched
  std::vector<double> untouched;              ///< per piece: s since it touched; of a wall's only list: per centre
  bool asleep = true;                         ///< at rest and untouched: nothing to integrate

  bool wakes_in_parts() const { return !region.mark.empty(); }
  bool holds(std::size_t vertex) const { return !held.empty() && held[vertex] != 0; }
};

/// Small, flat, copied to restore or compare.
struct State {
  std::vector<OrganState> organs;
};

State rest_state(const World& world);
OrganState rest_state(const World& world, int organ);

/// A number that differs when any bit of what an organ shows or moves by differs: positions, velocities, depths.
std::uint64_t hash_state(const OrganModel& model, const OrganState& organ, std::uint64_t seed);
std::uint64_t hash_word(std::uint64_t word, std::uint64_t seed);

/// Copies what the next step reads, between two states of one organ. With levels that is what is awake: the time
/// follows the contact.
void copy_state(const OrganModel& model, const OrganState& from, OrganState& to);

}  // namespace tissue_sim
