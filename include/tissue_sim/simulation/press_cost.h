#pragma once

#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim {

/// What a step costs while the first instrument is pressed into an organ and slides there.
struct PressCost {
  double step = 0.0;    ///< s of wall time, the median over the steps in contact from half the depth on
  int steps = 0;        ///< that this is taken over; 0: none was in contact, and it is over all
  StepProfile profile;  ///< the mean over the same steps
};

/// m. How deep time_press() goes, or a quarter of the organ's thinnest extent: what the recordings at hand press.
constexpr double timed_press = 0.010;

/// Presses into the organ where it is freest, for about `seconds` of wall time. Needs a timeline of that scene which
/// has made no step.
PressCost time_press(const Scene& scene, int organ, double seconds, Timeline& timeline);

/// The same with the instrument far away: s of wall time a step.
double time_apart(const Scene& scene, double seconds, Timeline& timeline);

}  // namespace tissue_sim
