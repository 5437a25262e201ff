#pragma once

#include <string>

#include "tissue_sim/study/accuracy_study.h"

namespace tissue_sim {

/// A ball of 6 mm pressed 2 mm into a block of 30 x 30 x 15 mm that is held at its bottom.
StudyCase sphere_into_block(bool quick);

/// The bundled probe pressed 10 mm into the bundled liver, which is attached as in config/scenes/demo.yaml.
/// `organs`, `instruments`: the folders of config. Throws SceneError where a file cannot be read.
StudyCase probe_into_organ(bool quick, const std::string& config);

/// The same with the poses of a recording, stamps from any start.
StudyCase demo_recording(bool quick, const std::string& config, std::vector<StampedPose> poses);

}  // namespace tissue_sim
