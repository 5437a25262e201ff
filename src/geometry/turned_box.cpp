#include "tissue_sim/geometry/turned_box.h"

namespace tissue_sim {

Box scene_bounds(const Box& box, const Pose& pose) {
  const Vector3 centre = pose.apply(0.5 * (box.lower + box.upper));
  const Vector3 half = pose.orientation.toRotationMatrix().cwiseAbs() * (0.5 * box.size());
  return {centre - half, centre + half};
}

TurnedBox::TurnedBox(const Box& box, const Pose& pose)
    : box_(box),
      own_(box.grown(rounding)),
      in_scene_(scene_bounds(box, pose)),
      position_(pose.position),
      back_(pose.orientation.toRotationMatrix().transpose()),
      spread_(back_.cwiseAbs()) {}

}  // namespace tissue_sim
