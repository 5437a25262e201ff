#include "tissue_sim/ros/node.h"

#include <diagnostic_msgs/DiagnosticArray.h>

#include <algorithm>
#include <boost/make_shared.hpp>

namespace tissue_sim {
namespace {

constexpr double idle_wait = 0.002;               // s the loop sleeps where nothing is to be done; adds to the latency
constexpr double diagnostics_period = 1.0;        // s
constexpr double poses_stopped_after = 0.25;      // s without a pose; then the counts are final
constexpr double warning_period = 5.0;            // s between two warnings of one cause and topic
constexpr int missing_transform = pose_verdicts;  // a cause beside the timeline's

// advance: realtime stays this far behind the clock (ns), so that a pose that is late by less is still taken.
constexpr std::int64_t hold_off = 100'000'000;

// Live, the newest pose wins, and the ones before it are counted by the timeline: enough to see a burst whole. In a
// replay nothing may be lost, neither on the way in nor on the way out.
constexpr unsigned live_queue = 100;
constexpr unsigned live_state_queue = 10;
constexpr unsigned no_limit = 0;

Scene load(const std::string& path, std::vector<ModelChoice>& choices) {
  std::vector<std::string> warnings;
  Scene scene = load_chosen_scene(path, warnings, choices);
  for (const std::string& warning : warnings) ROS_WARN_STREAM(warning);
  for (const ModelChoice& choice : choices) {
    ROS_INFO_STREAM(to_text(choice));
    for (const std::string& rejected : choice.rejected)
      ROS_INFO_STREAM("organ " << choice.organ << ": not " << rejected);
  }
  return scene;
}

const char* cure(int cause) {
  switch (cause) {
    case static_cast<int>(PoseVerdict::zero_stamp):
      return "a pose has a zero stamp and is dropped: stamp poses with the time of the measurement";
    case static_cast<int>(PoseVerdict::non_finite):
      return "a pose has a value that is not finite and is dropped: look at its source";
    case static_cast<int>(PoseVerdict::zero_quaternion):
      return "a pose has a zero quaternion and is dropped: write orientation.w = 1 for no rotation";
    case static_cast<int>(PoseVerdict::late_stamp):
      return "a pose is stamped in the year 2106 and is dropped: look at the clock of its source";
    case static_cast<int>(PoseVerdict::too_far):
      return "a pose is farther than 1 km from the scene and is dropped: write metres, and look at the transforms";
    case static_cast<int>(PoseVerdict::stale):
      return "a pose is stamped no later than the one before and is dropped: send poses in the order of their stamps";
    default:
      return "";
  }
}

/// ns. Without a simulated clock one that nobody sets: the hour may be set while the node works.
std::int64_t clock_now() {
  return static_cast<std::int64_t>(ros::Time::isSimTime() ? ros::Time::now().toNSec()
                                                          : ros::SteadyTime::now().toNSec());
}

/// The message to fill and publish. Published as a pointer, it goes to subscribers in this process without a copy, and
/// they may keep it: then the next one is a new one. Subscribers elsewhere have got their bytes when publish() returns.
template <class Message>
Message& writable(boost::shared_ptr<Message>& message) {
  if (!message || message.use_count() > 1) message = boost::make_shared<Message>();
  return *message;
}

}  // namespace

Node::Node(const NodeParameters& parameters)
    : parameters_(parameters), scene_(load(parameters.scene, choices_)), timeline_(scene_, parameters.timeline) {
  node_.setCallbackQueue(&poses_);
  private_.setCallbackQueue(&poses_);
  serving_.setCallbackQueue(&services_);
  advertise();
}

void Node::advertise() {
  const unsigned queue = parameters_.keep_all_poses ? no_limit : live_queue;
  const unsigned state_queue = parameters_.keep_all_poses ? no_limit : live_state_queue;
  contacts_ = private_.advertise<Contacts>("contacts", queue);
  diagnostics_ = node_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  // Who looks on before the first pose sees the organs at rest.
  markers_ = serving_.advertise<visualization_msgs::MarkerArray>(
      "markers", 2,
      [this](const ros::SingleSubscriberPublisher& viewer) { viewer.publish(markers_message(scene_, timeline_)); });

  outputs_.resize(scene_.organs.size());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    Output& output = outputs_[i];
    const std::string& name = scene_.organs[i].name;
    output.topology = topology_message(scene_, static_cast<int>(i));
    output.state_publisher = private_.advertise<TissueState>(name + "/state", state_queue);
    output.topology_publisher = private_.advertise<TissueTopology>(name + "/topology", 1, true);
    output.topology_publisher.publish(output.topology);
  }
  reset_server_ = serving_.advertiseService("reset", &Node::reset, this);
  topology_server_ = serving_.advertiseService("get_topology", &Node::get_topology, this);

  inputs_.resize(scene_.instruments.size());
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const Instrument& instrument = scene_.instruments[i];
    inputs_[i].wrench = private_.advertise<geometry_msgs::WrenchStamped>(instrument.name + "/measured_cf", queue);
    const boost::function<void(const geometry_msgs::PoseStamped&)> take = [this, i](const auto& message) {
      inputs_[i].waiting.push_back({message, ros::SteadyTime::now()});
      last_pose_ = ros::SteadyTime::now();
      pose_since_diagnostics_ = true;
    };
    inputs_[i].subscriber = node_.subscribe<geometry_msgs::PoseStamped>(
        instrument.pose_topic, queue, take, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
    ROS_INFO_STREAM("instrument \"" << instrument.name << "\" follows " << inputs_[i].subscriber.getTopic());
  }
  const std::string& own = ros::this_node::getName();
  registration_ = std::make_unique<Registration>(std::vector<std::string>{
      reset_server_.getService(), topology_server_.getService(), own + "/get_loggers", own + "/set_logger_level"});
}

void Node::spin() {
  while (ros::ok()) {
    poses_.callAvailable(ros::WallDuration(idle_wait));
    while (ros::ok() && take_poses()) step_while_poses_allow();
    step_while_poses_allow();
    if (parameters_.realtime) hold_in_realtime();
    services_.callAvailable();
    diagnose_when_due();
  }
}

/// Gives the timeline the poses whose transforms are there. In a replay it is one pose at a time, as the offline
/// replay does: a pose that starts a new run must not reach the timeline before the steps of the old run are made.
bool Node::take_poses() {
  bool taken = false;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    std::deque<Waiting>& waiting = inputs_[i].waiting;
    while (!waiting.empty() && !(taken && parameters_.keep_all_poses)) {
      FramedPose pose;
      std::string why;
      if (into_scene_frame(transforms_, scene_.frame, waiting.front().message, pose, why)) {
        give_pose(i, pose);
        taken = true;
      } else if ((ros::SteadyTime::now() - waiting.front().arrival).toSec() < parameters_.tf_timeout) {
        break;
      } else {
        ++missing_transforms_;
        warn(i, missing_transform, why + "; the last pose is held");
      }
      waiting.pop_front();
    }
  }
  return taken;
}

void Node::give_pose(std::size_t instrument, const FramedPose& pose) {
  Input& input = inputs_[instrument];
  const PoseVerdict verdict = timeline_.add_pose(static_cast<int>(instrument), pose.in_scene);
  if (verdict == PoseVerdict::new_run) {
    ROS_INFO_STREAM("stamps on " << input.subscriber.getTopic() << " went back: a new run, organs at rest");
    for (Input& each : inputs_) each.frames.clear();
    // tf2 keeps refusing what is older than what it holds. On a simulated clock it clears itself.
    if (!ros::Time::isSimTime()) transforms_.clear();
  } else if (verdict != PoseVerdict::used) {
    warn(instrument, static_cast<int>(verdict), cure(static_cast<int>(verdict)));
    return;
  }
  input.frames.add(pose);
  holding_.pose(pose.in_scene.stamp, clock_now());
}

/// Contacts and wrenches carry forces, markers show them.
bool Node::forces_wanted() const {
  return contacts_.getNumSubscribers() > 0 || markers_.getNumSubscribers() > 0 ||
         std::any_of(inputs_.begin(), inputs_.end(),
                     [](const Input& input) { return input.wrench.getNumSubscribers() > 0; });
}

void Node::step_while_poses_allow() {
  while (ros::ok() && timeline_.step()) {
    after_step(false);
    services_.callAvailable();
    diagnose_when_due();
    if (parameters_.keep_all_poses) continue;
    poses_.callAvailable();  // a newer pose may have come
    take_poses();
  }
}

/// Where poses stop coming, simulated time goes on from the last one as fast as the clock, whatever the stamps are.
void Node::hold_in_realtime() {
  if (!holding_.begun()) return;
  const std::int64_t until = holding_.until(clock_now(), hold_off);
  while (ros::ok() && poses_.isEmpty() && timeline_.now() < until && timeline_.step_holding(until)) {
    after_step(true);
    services_.callAvailable();
    diagnose_when_due();
  }
}

void Node::after_step(bool holding) {
  const StepReport& report = timeline_.report();
  timeline_.set_forces_wanted(forces_wanted());  // in the next step: a subscriber may have come or gone
  add(report.profile, 1.0, profile_);
  ++period_steps_;
  // Zero before the first step, and a new run goes back: neither is time that was simulated.
  if (last_step_stamp_ > 0 && report.stamp > last_step_stamp_) period_nanoseconds_ += report.stamp - last_step_stamp_;
  last_step_stamp_ = report.stamp;
  if (report.recovered) ROS_ERROR_STREAM("step " << report.step << " went bad: the last good state is back");

  if (report.pose_reached || (holding && report.state_due)) publish_contacts();
  if (!report.state_due) return;
  publish_states();
  publish_markers();
}

/// Contacts, and the forces of the instruments.
void Node::publish_contacts() {
  const StepReport& report = timeline_.report();
  if (contacts_.getNumSubscribers() > 0) {
    fill_contacts(scene_, report, writable(contacts_message_));
    contacts_.publish(contacts_message_);
  }
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    Input& input = inputs_[i];
    const FramedPose* pose = input.frames.at(report.stamp);  // also where nobody listens: it forgets the older ones
    if (pose == nullptr || input.wrench.getNumSubscribers() == 0) continue;
    writable(input.wrench_message) =
        wrench_message(report.wrenches[i], report.stamp, pose->frame, pose->frame_to_scene);
    input.wrench.publish(input.wrench_message);
  }
}

void Node::publish_states() {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    Output& output = outputs_[i];
    if (output.state_publisher.getNumSubscribers() == 0) continue;
    fill_state(scene_, timeline_, static_cast<int>(i), output.topology.topology_id, writable(output.state));
    output.state_publisher.publish(output.state);
  }
}

void Node::publish_markers() {
  if (markers_.getNumSubscribers() > 0) markers_.publish(markers_message(scene_, timeline_));
}

void Node::diagnose_when_due() {
  const ros::SteadyTime now = ros::SteadyTime::now();
  const bool stopped = pose_since_diagnostics_ && (now - last_pose_).toSec() > poses_stopped_after;
  if (!stopped && (now - last_diagnostics_).toSec() < diagnostics_period) return;
  if (diagnostics_.getNumSubscribers() > 0) publish_diagnostics();
  profile_ = {};
  period_steps_ = 0;
  period_nanoseconds_ = 0;
  last_diagnostics_ = now;
  if (stopped) pose_since_diagnostics_ = false;
}

void Node::publish_diagnostics() {
  const TimelineCounters& counters = timeline_.counters();
  const StepReport& report = timeline_.report();
  const auto count = [&](PoseVerdict verdict) { return counters.poses[static_cast<std::size_t>(verdict)]; };

  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  array.status.resize(1);
  diagnostic_msgs::DiagnosticStatus& status = array.status[0];
  status.name = ros::this_node::getName().substr(1) + ": simulation";
  status.hardware_id = parameters_.scene;

  add_value(status, "steps", report.step);
  add_value(status, "simulated_time_s", static_cast<double>(report.stamp) * 1e-9);
  add_value(status, "state_hash", hash_text(timeline_.hash()));
  add_value(status, "contacts", static_cast<std::uint64_t>(report.contacts.size()));
  add_value(status, "active_vertices", static_cast<std::uint64_t>(timeline_.active_vertices()));
  add_value(status, "substeps", static_cast<std::uint64_t>(report.substeps));
  add_value(status, "kinetic_energy_J", timeline_.kinetic_energy());
  add_value(status, "elastic_energy_J", timeline_.elastic_energy());

  // Over the steps since the last diagnostics; how much faster than simulated time they were made.
  const double per_step = period_steps_ > 0 ? 1e3 / static_cast<double>(period_steps_) : 0.0;
  const double simulated = static_cast<double>(period_nanoseconds_) * 1e-9;
  add_value(status, "real_time_factor", profile_.total > 0.0 ? simulated / profile_.total : 0.0);
  add_value(status, "ms_per_step", profile_.total * per_step);
  add_value(status, "ms_refit", profile_.refit * per_step);
  add_value(status, "ms_detection", profile_.detection * per_step);
  add_value(status, "ms_penetration", profile_.penetration * per_step);
  add_value(status, "ms_propagation", profile_.propagation * per_step);
  add_value(status, "ms_response", profile_.response * per_step);
  add_value(status, "ms_deformation", profile_.deformation * per_step);
  add_value(status, "ms_health", profile_.health * per_step);

  add_value(status, "poses_used", count(PoseVerdict::used) + count(PoseVerdict::new_run));
  add_value(status, "new_runs", count(PoseVerdict::new_run));
  std::uint64_t drops = missing_transforms_;
  for (const PoseVerdict verdict : dropped_verdicts) {
    std::string cause = to_string(verdict);
    std::replace_if(
        cause.begin(), cause.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
    add_value(status, "dropped_" + cause, count(verdict));
    drops += count(verdict);
  }
  add_value(status, "dropped_missing_transform", missing_transforms_);
  add_value(status, "superseded", counters.poses_superseded);
  add_value(status, "normalised_quaternions", counters.normalised_quaternions);
  add_value(status, "recoveries", counters.recoveries);
  add_value(status, "resets", counters.resets);

  for (std::size_t i = 0; i < scene_.organs.size(); ++i) {
    const Organ& organ = scene_.organs[i];
    const OrganSummary summary = timeline_.summary(static_cast<int>(i));
    add_value(status, "model_" + organ.name, std::string(to_string(organ.model)));
    add_value(status, "integrator_" + organ.name, std::string(to_string(summary.integrator)));
    add_value(status, "integrator_reason_" + organ.name, summary.integrator_reason);
    add_value(status, "added_mass_kg_" + organ.name, summary.added_mass);
  }
  for (const ModelChoice& choice : choices_) {
    add_value(status, "solid_" + choice.organ, choice.solid);
    add_value(status, "expected_error_" + choice.organ, choice.expected_error);
    add_value(status, "measured_ms_" + choice.organ, 1e3 * choice.measured);
    add_value(status, "chosen_because_" + choice.organ, choice.why);
  }

  status.level = diagnostic_msgs::DiagnosticStatus::OK;
  status.message = report.step > 0 ? "running" : "waiting for poses";
  if (drops > reported_drops_) {
    status.level = diagnostic_msgs::DiagnosticStatus::WARN;
    status.message = "poses were dropped";
  }
  if (counters.recoveries > reported_recoveries_) {
    status.level = diagnostic_msgs::DiagnosticStatus::ERROR;
    status.message = "a state went bad and the last good one was restored";
  }
  diagnostics_.publish(array);

  reported_drops_ = drops;
  reported_recoveries_ = counters.recoveries;
}

void Node::warn(std::size_t instrument, int cause, const std::string& what) {
  const ros::SteadyTime now = ros::SteadyTime::now();
  ros::SteadyTime& last = inputs_[instrument].last_warning[static_cast<std::size_t>(cause)];
  if ((now - last).toSec() < warning_period) return;
  last = now;
  ROS_WARN_STREAM(inputs_[instrument].subscriber.getTopic() << ": " << what);
}

bool Node::reset(ResetOrgan::Request& request, ResetOrgan::Response& response) {
  response.step = timeline_.report().step;
  const int organ = organ_index(request.organ);
  if (organ < 0 && !request.organ.empty()) {
    response.message = "no organ \"" + request.organ + "\"; the scene has: " + organ_names();
    return true;
  }
  timeline_.reset(organ);
  publish_markers();
  response.success = true;
  return true;
}

bool Node::get_topology(GetTopology::Request& request, GetTopology::Response& response) {
  const int organ = organ_index(request.organ);
  if (organ < 0) {
    response.message = "no organ \"" + request.organ + "\"; the scene has: " + organ_names();
    return true;
  }
  response.topology = outputs_[static_cast<std::size_t>(organ)].topology;
  response.success = true;
  return true;
}

/// -1 where there is none.
int Node::organ_index(const std::string& name) const {
  const auto found =
      std::find_if(scene_.organs.begin(), scene_.organs.end(), [&](const Organ& organ) { return organ.name == name; });
  return found == scene_.organs.end() ? -1 : static_cast<int>(found - scene_.organs.begin());
}

std::string Node::organ_names() const {
  std::string names;
  for (const Organ& organ : scene_.organs) names += (names.empty() ? "" : ", ") + organ.name;
  return names;
}

}  // namespace tissue_sim
