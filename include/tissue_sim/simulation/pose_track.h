#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

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

/// Poses in the order of their stamps. Keeps its room: a std::deque takes a new block from the heap every few poses.
class PoseQueue {
 public:
  bool empty() const { return first_ == poses_.size(); }
  std::size_t size() const { return poses_.size() - first_; }
  const StampedPose& front() const { return poses_[first_]; }
  void push_back(const StampedPose& pose);
  void pop_front() { ++first_; }
  void clear();

 private:
  std::vector<StampedPose> poses_;
  std::size_t first_ = 0;  ///< those before it are gone
};

/// The poses of one instrument: where it is, and where it will be.
struct PoseTrack {
  bool placed = false;      ///< it has been given a pose that time has reached
  Pose pose;                ///< at the time the simulation has reached
  std::int64_t newest = 0;  ///< ns, the last stamp that was taken; 0: none
  PoseQueue ahead;          ///< later than the time the simulation has reached
};

/// What a pose is worth in itself: `used`, or why not. Normalises the quaternion; `normalised` is set to true where
/// that changed it by more than a thousandth.
PoseVerdict judge_pose(StampedPose& pose, bool& normalised);

}  // namespace tissue_sim
