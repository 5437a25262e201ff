#pragma once

#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// Corners around a URDF cylinder, and slices and stacks of a URDF sphere: 4 mm in radius then misses the round
/// shape by 0.03 and 0.14 mm.
constexpr int cylinder_segments = 24;
constexpr int sphere_slices = 12;

/// The rigid pieces of a URDF, every joint at zero, in the frame of `tip_link`: one part for each <collision> of
/// each link. A link without one falls back to its <visual>, with a warning; primitives of zero size are skipped,
/// with a warning. Throws SceneError.
std::vector<InstrumentPart> load_instrument(const std::string& path, const std::string& tip_link,
                                            std::vector<std::string>& warnings);

}  // namespace tissue_sim
