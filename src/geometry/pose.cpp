#include "tissue_sim/geometry/pose.h"

#include <cmath>
#include <limits>

#include "tissue_sim/geometry/elementary.h"

namespace tissue_sim {

namespace {

/// Shoemake 1985. Where the two are the same to the last digit there is no arc, and the line does.
Eigen::Quaterniond slerp(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double fraction) {
  const double across = from.dot(to);
  const double part = std::abs(across);
  double of_from = 1.0 - fraction;
  double of_to = fraction;
  if (part < 1.0 - std::numeric_limits<double>::epsilon()) {
    const double angle = arc_cosine(part);
    const double whole = sine(angle);
    of_from = sine(of_from * angle) / whole;
    of_to = sine(of_to * angle) / whole;
  }
  if (across < 0.0) of_to = -of_to;
  return Eigen::Quaterniond(of_from * from.coeffs() + of_to * to.coeffs());
}

}  // namespace

Eigen::Quaterniond turn(double angle, const Eigen::Vector3d& axis) {
  const Eigen::Vector3d along = sine(0.5 * angle) * axis;
  return {cosine(0.5 * angle), along.x(), along.y(), along.z()};
}

double angle_between(const Pose& a, const Pose& b) {
  // Most instruments do not turn in most substeps, and the angle costs as much as a step far from any organ.
  if (a.orientation.coeffs() == b.orientation.coeffs()) return 0.0;
  const Eigen::Quaterniond turned = a.orientation * b.orientation.conjugate();
  return 2.0 * angle_of(turned.vec().norm(), std::abs(turned.w()));
}

Pose interpolate(const Pose& from, const Pose& to, double fraction) {
  if (fraction <= 0.0) return from;
  if (fraction >= 1.0) return to;
  return {from.position + fraction * (to.position - from.position), slerp(from.orientation, to.orientation, fraction)};
}

}  // namespace tissue_sim
