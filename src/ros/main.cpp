#include <ros/console.h>
#include <ros/master.h>

#include <iostream>

#include "tissue_sim/ros/node.h"

namespace {

/// roscpp prints a line of its own where there is no master; the one with the cure is enough.
bool master_answers() {
  const bool quiet = ros::console::set_logger_level("ros", ros::console::levels::Fatal);
  if (quiet) ros::console::notifyLoggerLevelsChanged();
  const bool answers = ros::master::check();
  if (quiet && ros::console::set_logger_level("ros", ros::console::levels::Info)) {
    ros::console::notifyLoggerLevelsChanged();
  }
  return answers;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    ros::init(argc, argv, "tissue_sim");
    if (!master_answers()) {
      throw std::runtime_error("no ROS master at " + ros::master::getURI() + "; start roscore or set ROS_MASTER_URI");
    }
    tissue_sim::Node node(tissue_sim::read_parameters());
    node.spin();
  } catch (const std::exception& error) {
    std::cerr << "tissue_sim_node: " << error.what() << std::endl;
    return 1;
  }
  return 0;
}
