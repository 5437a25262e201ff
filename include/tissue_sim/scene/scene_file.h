#pragma once

#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"

namespace tissue_sim {

/// Reads a scene file (YAML) and every mesh and URDF it names.
/// `warnings` receives one line for each thing that was mended. Throws SceneError.
Scene load_scene(const std::string& path, std::vector<std::string>& warnings);

}  // namespace tissue_sim
