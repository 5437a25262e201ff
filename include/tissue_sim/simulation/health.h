#pragma once

#include "tissue_sim/simulation/state.h"

namespace tissue_sim {

/// Of what is simulated: every position and velocity is a finite number, no vertex is faster than sound in tissue, and
/// none is farther than ten times the organ's size from where it belongs.
bool healthy(const OrganModel& model, const OrganState& state);

/// Whether a vertex so fast (m/s) is beyond that; so is one whose speed is no number.
bool runs_away(double speed);

/// Of what the next step reads beside that: what is remembered of contacts, centres and levels is finite numbers.
bool remembers_numbers(const OrganState& state);

/// The same of an instrument's `vertices`.
bool remembers_numbers(const Clearance& clearance, const std::vector<int>& vertices);

/// Of all that there is for every vertex, asleep or not, used or not: finite numbers. Looks at some hundred vertices
/// a `turn`: at all of a small organ, at others of a large one when the turn is another.
bool healthy_in_turn(const OrganModel& model, const OrganState& state, std::uint64_t turn);

/// Puts the last good state back, at rest; what is computed anew before it is read is 0.
void recover(const OrganModel& model, const OrganState& last_good, OrganState& state);

}  // namespace tissue_sim
