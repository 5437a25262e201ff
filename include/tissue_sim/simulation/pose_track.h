#pragma once

#include <array>
#include <cstdint>
#include <deque>

#include "tissue_sim/geometry/pose.h"

namespace tissue_sim {

/// Pose of an instrument's tip link in the scene's frame.
struct StampedPose {
  std::int64_t stamp = 0;  ///< ns
  Pose pose;
};

/// late_stamp: within a day of the end of a ROS stamp (the year 2106), or behind it: time could not go on from there.
/// too_far: farther than 1 km from the scene's origin. stale: not later than the pose before it, but by no more than
/// time_jump_threshold. new_run: taken as the first pose of a new run, since the stamps jumped.
enum class PoseVerdict { used, zero_stamp, non_finite, zero_quaternion, stale, new_run, late_stamp, too_far };
constexpr int pose_verdicts = 8;
const char* to_string(PoseVerdict verdict);

/// The causes to drop a pose for.
constexpr std::array<PoseVerdict, 6> dropped_verdicts{PoseVerdict::zero_stamp,      PoseVerdict::late_stamp,
                                                      PoseVerdict::non_finite,      PoseVerdict::too_far,
                                                      PoseVerdict::zero_quaternion, PoseVerdict::stale};

/// The poses of one instrument: where it is, and where it will be.
struct PoseTrack {
  bool placed = false;            ///< it has been given a pose that time has reached
  Pose pose;                      ///< at the time the simulation has reached
  std::int64_t newest = 0;        ///< ns, the last stamp that was taken; 0: none
  std::deque<StampedPose> ahead;  ///< later than the time the simulation has reached
};

/// What a pose is worth in itself: `used`, or why not. Normalises the quaternion; `normalised` is set to true where
/// that changed it by more than a thousandth.
PoseVerdict judge_pose(StampedPose& pose, bool& normalised);

}  // namespace tissue_sim
