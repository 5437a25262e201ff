#include "tissue_sim/simulation/pose_track.h"

#include <algorithm>
#include <cmath>

namespace tissue_sim {

namespace {
constexpr double from_origin = 1000.0;                                                   ///< m from the scene's origin
constexpr std::int64_t latest = (4'294'967'295 - 86'400) * std::int64_t{1'000'000'000};  ///< ns: 2^32 s but for a day
constexpr double shortest_quaternion = 1e-6;
constexpr double off_unit_length = 1e-3;  ///< of a quaternion: rounding and drift stay well below

/// Eigen's own takes each from itself, which is a floating-point exception for infinity.
template <class Vector>
bool are_numbers(const Vector& vector) {
  return std::all_of(vector.data(), vector.data() + vector.size(), [](double x) { return std::isfinite(x); });
}
}  // namespace

const char* to_string(PoseVerdict verdict) {
  switch (verdict) {
    case PoseVerdict::used:
      return "used";
    case PoseVerdict::zero_stamp:
      return "zero stamp";
    case PoseVerdict::non_finite:
      return "non-finite";
    case PoseVerdict::zero_quaternion:
      return "zero quaternion";
    case PoseVerdict::stale:
      return "stale";
    case PoseVerdict::new_run:
      return "new run";
    case PoseVerdict::late_stamp:
      return "late stamp";
    case PoseVerdict::too_far:
      return "too far";
  }
  return "";
}

void PoseQueue::push_back(const StampedPose& pose) {
  if (empty()) clear();
  // Moved to the front only when that makes as much room as it moves: each pose is moved once or twice.
  if (poses_.size() == poses_.capacity() && 2 * first_ >= poses_.size()) {
    poses_.erase(poses_.begin(), poses_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
  poses_.push_back(pose);
}

void PoseQueue::clear() {
  poses_.clear();
  first_ = 0;
}

PoseVerdict judge_pose(StampedPose& pose, bool& normalised) {
  if (pose.stamp <= 0) return PoseVerdict::zero_stamp;
  if (pose.stamp > latest) return PoseVerdict::late_stamp;
  Eigen::Vector4d& q = pose.pose.orientation.coeffs();
  if (!are_numbers(pose.pose.position) || !are_numbers(q)) return PoseVerdict::non_finite;
  if (pose.pose.position.cwiseAbs().maxCoeff() > from_origin) return PoseVerdict::too_far;
  const double largest = q.cwiseAbs().maxCoeff();
  if (!(largest > shortest_quaternion)) return PoseVerdict::zero_quaternion;
  normalised = std::abs(q.stableNorm() - 1.0) > off_unit_length;
  q /= largest;  // squares of 1e300 would overflow
  q.normalize();
  return PoseVerdict::used;
}

}  // namespace tissue_sim
