#include <ros/network.h>

#include <cstdlib>
#include <iostream>
#include <stdexcept>

#include "tissue_sim/ros/master.h"
#include "tissue_sim/ros/node.h"

namespace {

/// Before ros::init, which waits for ever for a master to take the parameters of the command line.
void require_master(int argc, char** argv) {
  const char* environment = std::getenv("ROS_MASTER_URI");
  std::string uri = environment == nullptr ? "" : environment;
  const std::string remap = "__master:=";
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]).rfind(remap, 0) == 0) uri = std::string(argv[i]).substr(remap.size());
  }
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(uri, host, port)) {
    throw std::runtime_error("ROS_MASTER_URI is \"" + uri + "\"; set it, for example to http://localhost:11311");
  }
  if (!tissue_sim::master_answers(uri)) {
    throw std::runtime_error("no ROS master at " + uri + "; start roscore or set ROS_MASTER_URI");
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    require_master(argc, argv);
    ros::init(argc, argv, "tissue_sim");
    tissue_sim::Node node(tissue_sim::read_parameters());
    node.spin();
  } catch (const std::exception& error) {
    std::cerr << "tissue_sim_node: " << error.what() << std::endl;
    return 1;
  }
  return 0;
}
