#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "tissue_sim/ros/frames.h"
#include "tissue_sim/ros/holding.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/ros/registration.h"
#include "tissue_sim/ros/transform_feed.h"
#include "tissue_sim/simulation/accuracy.h"
#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim {

/// The private parameters of the node.
struct NodeParameters {
  std::string scene;      ///< path of the scene file
  bool realtime = false;  ///< advance: realtime instead of on_pose
  bool keep_all_poses = false;
  double tf_timeout = 0.1;  ///< s that a pose waits for its transform
  TimelineOptions timeline;
};

/// Reads and checks them. Throws std::runtime_error with one line that names the parameter and what is allowed.
NodeParameters read_parameters();

/// Instrument poses in, organs, contacts and forces out: topics and services around a Timeline.
///
/// One thread reads poses, steps, publishes and serves; only tf2, the clock and the registration have their own.
class Node {
 public:
  explicit Node(const NodeParameters& parameters);

  /// Works until ROS shuts down.
  void spin();

 private:
  struct Waiting {
    geometry_msgs::PoseStamped message;
    ros::SteadyTime arrival;
  };

  /// What the node keeps of an instrument.
  struct Input {
    ros::Subscriber subscriber;
    ros::Publisher wrench;
    boost::shared_ptr<geometry_msgs::WrenchStamped> wrench_message;  ///< see writable()
    std::deque<Waiting> waiting;  ///< for their transform, in the order in which they came
    FrameHistory frames;
    std::vector<ros::SteadyTime> last_warning = std::vector<ros::SteadyTime>(pose_verdicts + 1);  ///< by cause
  };

  /// What the node keeps of an organ.
  struct Output {
    ros::Publisher topology_publisher, state_publisher;
    TissueTopology topology;
    boost::shared_ptr<TissueState> state;  ///< see writable()
  };

  void advertise();
  bool take_poses();
  bool forces_wanted() const;
  void give_pose(std::size_t instrument, const FramedPose& pose);
  void step_while_poses_allow();
  void hold_in_realtime();
  void after_step(bool holding);
  void publish_contacts();
  void publish_states();
  void publish_markers();
  void publish_diagnostics();
  void diagnose_when_due();
  void warn(std::size_t instrument, int cause, const std::string& what);
  bool reset(ResetOrgan::Request& request, ResetOrgan::Response& response);
  bool get_topology(GetTopology::Request& request, GetTopology::Response& response);
  int organ_index(const std::string& name) const;
  std::string organ_names() const;

  NodeParameters parameters_;
  std::vector<ModelChoice> choices_;  ///< of the scene's accuracy; filled before the scene
  Scene scene_;
  Timeline timeline_;

  ros::NodeHandle node_, private_{"~"}, serving_{"~"};
  ros::CallbackQueue poses_, services_;
  tf2_ros::Buffer transforms_;
  TransformFeed transform_feed_{transforms_};
  std::vector<Input> inputs_;
  std::vector<Output> outputs_;
  ros::Publisher contacts_, markers_, diagnostics_;
  boost::shared_ptr<Contacts> contacts_message_;  ///< see writable()
  ros::ServiceServer reset_server_, topology_server_;
  std::unique_ptr<Registration> registration_;

  Holding holding_;  ///< for advance: realtime
  // Since the last diagnostics.
  StepProfile profile_;
  std::uint64_t period_steps_ = 0;
  std::int64_t period_nanoseconds_ = 0;  ///< of simulated time
  std::int64_t last_step_stamp_ = 0;
  std::uint64_t missing_transforms_ = 0;
  std::uint64_t reported_drops_ = 0, reported_recoveries_ = 0;
  bool pose_since_diagnostics_ = false;
  ros::SteadyTime last_diagnostics_, last_pose_;
};

}  // namespace tissue_sim
