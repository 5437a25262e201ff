#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <geometry_msgs/Pose.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/time.h>
#include <visualization_msgs/MarkerArray.h>

#include <cstdint>
#include <string>

#include "tissue_sim/ros/message_types.h"
#include "tissue_sim/simulation/timeline.h"

namespace tissue_sim {

/// Every conversion from the simulation to messages and back; the node and the replay both speak through these.

ros::Time to_ros_time(std::int64_t nanoseconds);

/// As it came: neither checked nor normalised, which is the timeline's business.
Pose to_pose(const geometry_msgs::Pose& message);

/// 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

/// A number made of the triangles and the rest positions, so that a state never fits another organ's topology.
TissueTopology topology_message(const Scene& scene, int organ);

TissueState state_message(const Scene& scene, const Timeline& timeline, int organ, std::uint32_t topology_id);

/// The contacts of the timeline's last step.
Contacts contacts_message(const Scene& scene, const StepReport& report);

/// The same into a message that was filled before: what fits into the room it has is not allocated again.
void fill_state(const Scene& scene, const Timeline& timeline, int organ, std::uint32_t topology_id,
                TissueState& message);
void fill_contacts(const Scene& scene, const StepReport& report, Contacts& message);

/// Force and torque about the tip, on the instrument, turned from the scene's frame into `frame`.
geometry_msgs::WrenchStamped wrench_message(const Wrench& wrench, std::int64_t stamp, const std::string& frame,
                                            const Eigen::Quaterniond& frame_to_scene);

/// Organs coloured by depth, contacts as spheres, forces on the instruments as arrows, instruments see-through.
visualization_msgs::MarkerArray markers_message(const Scene& scene, const Timeline& timeline);

void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, const std::string& value);
void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, double value);
void add_value(diagnostic_msgs::DiagnosticStatus& status, const std::string& key, std::uint64_t value);

}  // namespace tissue_sim
