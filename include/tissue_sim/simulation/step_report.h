#pragma once

#include <cstdint>
#include <vector>

#include "tissue_sim/contact/contact.h"
#include "tissue_sim/geometry/pose.h"

namespace tissue_sim {

/// Force and torque about the tip, on the instrument, scene frame; N and N m.
struct Wrench {
  Vector3 force = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
};

/// Wall time of the stages of one step, s, summed over its substeps.
struct StepProfile {
  double refit = 0.0;        ///< trees of what moved
  double detection = 0.0;    ///< stage 1
  double penetration = 0.0;  ///< stage 2
  double propagation = 0.0;  ///< stage 3
  double response = 0.0;
  double deformation = 0.0;  ///< elements, integration, restoration
  double health = 0.0;
  double total = 0.0;
};

/// Adds `part` of every stage of a step to those of a sum.
inline void add(const StepProfile& step, double part, StepProfile& sum) {
  for (double StepProfile::*stage :
       {&StepProfile::refit, &StepProfile::detection, &StepProfile::penetration, &StepProfile::propagation,
        &StepProfile::response, &StepProfile::deformation, &StepProfile::health, &StepProfile::total}) {
    sum.*stage += part * (step.*stage);
  }
}

/// What one step did. Valid until the next one.
struct StepReport {
  std::uint64_t step = 0;     ///< counts from 1; never goes back, not even at a reset
  std::int64_t stamp = 0;     ///< ns, the simulated time that the states show
  bool pose_reached = false;  ///< the step ended on the stamp of a pose
  bool state_due = false;     ///< state_period has passed since the last state that was due
  bool recovered = false;     ///< the health check put the last good state back
  int substeps = 0;
  std::vector<OrganContact> contacts;
  std::vector<Wrench> wrenches;  ///< one an instrument
  std::vector<Pose> poses;       ///< one an instrument, at `stamp`; meaningful where `placed`
  std::vector<char> placed;      ///< one an instrument: it has been given a pose
  StepProfile profile;
};

}  // namespace tissue_sim
