#pragma once

#include <string>

namespace tissue_sim {

/// Whether a ROS master answers at `uri` (`http://localhost:11311`). Needs no ros::init. False for what is no such
/// address.
bool master_answers(const std::string& uri);

}  // namespace tissue_sim
