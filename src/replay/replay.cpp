#include "tissue_sim/replay/replay.h"

#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>

#include "bag_check.h"
#include "tissue_sim/ros/frames.h"
#include "tissue_sim/ros/messages.h"

namespace tissue_sim {
namespace {

const std::string pose_type = "geometry_msgs/PoseStamped";

const std::vector<std::string> transform_topics{"/tf", "tf", "/tf_static", "tf_static"};

void open_to_read(rosbag::Bag& bag, const Scene& scene, const std::string& path) {
  if (!std::ifstream(path)) throw std::runtime_error(path + ": cannot be read; give the path of a bag file");
  std::set<std::string> topics;
  for (const std::string& topic : transform_topics) topics.insert(without_slash(topic));
  for (const Instrument& instrument : scene.instruments) topics.insert(without_slash(instrument.pose_topic));
  const std::string fault = fault_in_bag(path, topics);
  if (!fault.empty()) throw std::runtime_error(path + ": not a bag that can be read (" + fault + ")");
  try {
    bag.open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw std::runtime_error(path + ": the bag has no index (its recording was cut off); run: rosbag reindex " + path);
  } catch (const std::exception& error) {  // ros::Time has exceptions of its own
    throw std::runtime_error(path + ": not a bag that can be read (" + error.what() + ")");
  }
}

/// The topic in the bag that each instrument follows, as the bag spells it.
std::vector<std::string> find_topics(const Scene& scene, const rosbag::Bag& bag, const std::string& path) {
  std::map<std::string, std::string> types;
  rosbag::View everything(bag);
  for (const rosbag::ConnectionInfo* connection : everything.getConnections()) {
    types[connection->topic] = connection->datatype;
  }
  std::string available;
  for (const auto& [topic, type] : types) {
    if (type == pose_type) available += (available.empty() ? "" : ", ") + topic;
  }
  if (available.empty()) available = "none";

  std::vector<std::string> topics;
  for (const Instrument& instrument : scene.instruments) {
    const auto found = std::find_if(types.begin(), types.end(), [&](const auto& entry) {
      return without_slash(entry.first) == without_slash(instrument.pose_topic);
    });
    const std::string wanted =
        path + ": topic " + instrument.pose_topic + " of instrument \"" + instrument.name + "\" ";
    if (found == types.end()) {
      throw std::runtime_error(wanted + "is not in the bag; its " + pose_type + " topics: " + available);
    }
    if (found->second != pose_type) {
      throw std::runtime_error(wanted + "is " + found->second + ", not " + pose_type + "; the bag has: " + available);
    }
    topics.push_back(found->first);
  }
  return topics;
}

/// All transforms at once, before the first pose: one that the node would have waited for is then there too.
void read_transforms(rosbag::Bag& bag, const std::string& path, tf2::BufferCore& transforms) {
  rosbag::View view(bag, rosbag::TopicQuery(transform_topics));
  std::vector<std::uint8_t> bytes;
  for (const rosbag::MessageInstance& instance : view) {
    if (instance.getMD5Sum() != ros::message_traits::md5sum<tf2_msgs::TFMessage>()) continue;
    bytes.resize(instance.size());
    ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
    instance.write(stream);
    tf2_msgs::TFMessage message;
    if (!deserialize_transforms(bytes, message)) {
      throw std::runtime_error(path + ": a message on " + instance.getTopic() + " is damaged (it is cut short)");
    }
    const bool is_static = without_slash(instance.getTopic()) == "tf_static";
    for (const auto& transform : message.transforms) give_transform(transform, "bag", is_static, transforms);
  }
}

/// How long tf2 has to remember: all of the bag, and no longer than a ros::Duration can say (68 years).
ros::Duration duration(rosbag::Bag& bag) {
  rosbag::View view(bag);
  if (view.size() == 0) return ros::Duration(0.0);
  return ros::Duration(std::min(view.getEndTime().toSec() - view.getBeginTime().toSec(), 2e9));
}

double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

std::uint64_t non_finite(const std::vector<float>& values) {
  return static_cast<std::uint64_t>(
      std::count_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); }));
}

std::uint64_t non_finite(const Vector3& v) {
  return v.allFinite() ? 0U : 1U;
}

/// A bag under another name until it is whole; an unfinished one is removed.
class OutputBag {
 public:
  explicit OutputBag(const std::string& path) : path_(path), unfinished_(path + ".unfinished") {
    try {
      bag_.open(unfinished_, rosbag::bagmode::Write);
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error(path + ": cannot be written (" + error.what() + ")");
    }
  }
  OutputBag(const OutputBag&) = delete;
  OutputBag& operator=(const OutputBag&) = delete;
  ~OutputBag() {
    if (finished_) return;
    try {
      bag_.close();
    } catch (const rosbag::BagException&) {
      // It goes anyway.
    }
    std::remove(unfinished_.c_str());
  }

  template <class Message>
  void write(const std::string& topic, std::int64_t stamp, const Message& message) {
    bag_.write("/tissue_sim/" + topic, std::max(ros::TIME_MIN, to_ros_time(stamp)), message);
  }

  void finish() {
    bag_.close();
    if (std::rename(unfinished_.c_str(), path_.c_str()) != 0) {
      throw std::runtime_error(path_ + ": cannot be written");
    }
    finished_ = true;
  }

 private:
  std::string path_, unfinished_;
  rosbag::Bag bag_;
  bool finished_ = false;
};

/// A line a step, where they are asked for.
class HashFile {
 public:
  explicit HashFile(const std::string& path) : path_(path) {
    if (!path.empty()) file_.open(path);
    check();
  }

  void write(const StepReport& report, std::uint64_t hash) {
    if (!path_.empty()) file_ << report.step << ' ' << report.stamp << ' ' << hash_text(hash) << '\n';
  }

  void finish() {
    if (!path_.empty()) file_.close();
    check();
  }

 private:
  void check() const {
    if (!file_) throw std::runtime_error(path_ + ": cannot be written: check the folder, its rights and its room");
  }

  std::string path_;
  std::ofstream file_;
};

/// One replay from the first pose to the last.
class Replay {
 public:
  Replay(const Scene& scene, const ReplayOptions& options)
      : scene_(scene), options_(options), timeline_(scene, options.timeline), frames_(scene.instruments.size()) {}

  ReplaySummary run() {
    rosbag::Bag input;
    open_to_read(input, scene_, options_.input);
    const std::vector<std::string> topics = find_topics(scene_, input, options_.input);
    tf2::BufferCore transforms(duration(input) + ros::Duration(10.0));
    read_transforms(input, options_.input, transforms);

    HashFile hashes(options_.hashes);
    hashes_ = &hashes;
    OutputBag output(options_.output);
    output_ = &output;
    rosbag::View poses(input, rosbag::TopicQuery(topics));
    for (const rosbag::MessageInstance& instance : poses) {
      const auto message = instance.instantiate<geometry_msgs::PoseStamped>();
      if (!message)
        throw std::runtime_error(options_.input + ": " + instance.getTopic() + " has an unknown definition");
      for (std::size_t i = 0; i < topics.size(); ++i) {
        if (topics[i] == instance.getTopic()) give_pose(transforms, i, *message);
      }
    }
    if (timeline_.report().step > 0) {
      const std::int64_t until = timeline_.now() + std::llround(options_.hold * 1e9);
      while (timeline_.now() < until && timeline_.step_holding(until)) after_step(true);
    }
    if (!topologies_written_) write_topologies(0);
    hashes.finish();
    output.finish();
    finish_summary();
    return std::move(summary_);
  }

 private:
  void give_pose(const tf2::BufferCore& transforms, std::size_t instrument, const geometry_msgs::PoseStamped& message) {
    FramedPose pose;
    std::string why;
    if (!into_scene_frame(transforms, scene_.frame, message, pose, why)) {
      if (summary_.poses_missing_transform++ == 0) summary_.warnings.push_back(options_.input + ": " + why);
      return;
    }
    const PoseVerdict verdict = timeline_.add_pose(static_cast<int>(instrument), pose.in_scene);
    if (verdict == PoseVerdict::new_run) {
      for (FrameHistory& frames : frames_) frames.clear();
      last_stamp_ = 0;
    }
    if (verdict != PoseVerdict::used && verdict != PoseVerdict::new_run) return;
    if (!topologies_written_) write_topologies(pose.in_scene.stamp);
    if (last_stamp_ == 0) last_stamp_ = pose.in_scene.stamp;
    frames_[instrument].add(pose);
    while (timeline_.step()) after_step(false);
  }

  void write_topologies(std::int64_t stamp) {
    for (std::size_t i = 0; i < scene_.organs.size(); ++i) {
      const TissueTopology topology = topology_message(scene_, static_cast<int>(i));
      topology_ids_.push_back(topology.topology_id);
      output_->write(topology.organ + "/topology", stamp, topology);
    }
    topologies_written_ = true;
  }

  void after_step(bool holding) {
    const StepReport& report = timeline_.report();
    hashes_->write(report, timeline_.hash());
    step_ms_.push_back(report.profile.total * 1e3);
    step_seconds_ += report.profile.total;
    if (report.stamp > last_stamp_) simulated_nanoseconds_ += report.stamp - last_stamp_;
    last_stamp_ = report.stamp;

    ReplayRow row;
    row.t = static_cast<double>(report.stamp) * 1e-9;
    row.contacts = report.contacts.size();
    for (const OrganContact& contact : report.contacts) {
      row.depth = std::max(row.depth, contact.depth);
      summary_.non_finite += non_finite(contact.point) + non_finite(contact.direction) + non_finite(contact.force) +
                             (std::isfinite(contact.depth) ? 0U : 1U);
    }
    for (const Wrench& wrench : report.wrenches) {
      row.force = std::max(row.force, wrench.force.norm());
      summary_.non_finite += non_finite(wrench.force) + non_finite(wrench.torque);
    }
    if (row.contacts > 0) {
      ++summary_.contact_steps;
      contact_step_ms_.push_back(report.profile.total * 1e3);
    }
    summary_.contacts_max = std::max(summary_.contacts_max, row.contacts);
    summary_.depth_max = std::max(summary_.depth_max, row.depth);
    summary_.force_max = std::max(summary_.force_max, row.force);

    if (report.pose_reached || (holding && report.state_due)) write_contacts(report, row);
    if (report.state_due) write_states(report);
  }

  void write_contacts(const StepReport& report, const ReplayRow& row) {
    summary_.rows.push_back(row);
    output_->write("contacts", report.stamp, contacts_message(scene_, report));
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const FramedPose* pose = frames_[i].at(report.stamp);
      if (pose == nullptr) continue;
      output_->write(scene_.instruments[i].name + "/measured_cf", report.stamp,
                     wrench_message(report.wrenches[i], report.stamp, pose->frame, pose->frame_to_scene));
    }
  }

  void write_states(const StepReport& report) {
    for (std::size_t i = 0; i < scene_.organs.size(); ++i) {
      const TissueState state = state_message(scene_, timeline_, static_cast<int>(i), topology_ids_[i]);
      summary_.non_finite += non_finite(state.positions) + non_finite(state.depths);
      output_->write(state.organ + "/state", report.stamp, state);
    }
  }

  void finish_summary() {
    summary_.steps = step_ms_.size();
    summary_.sim_seconds = static_cast<double>(simulated_nanoseconds_) * 1e-9;
    summary_.counters = timeline_.counters();
    const auto& poses = summary_.counters.poses;
    summary_.poses_used =
        poses[static_cast<std::size_t>(PoseVerdict::used)] + poses[static_cast<std::size_t>(PoseVerdict::new_run)];
    summary_.ms_per_step_p50 = percentile(step_ms_, 0.50);
    summary_.ms_per_step_p99 = percentile(step_ms_, 0.99);
    summary_.ms_per_contact_step_p50 = percentile(contact_step_ms_, 0.50);
    for (std::size_t i = 0; i < scene_.organs.size(); ++i) {
      const Organ& organ = scene_.organs[i];
      summary_.organs.push_back({organ.name, organ.model, timeline_.summary(static_cast<int>(i))});
    }
    summary_.real_time_factor = step_seconds_ > 0.0 ? summary_.sim_seconds / step_seconds_ : 0.0;
    summary_.hash = timeline_.hash();
  }

  const Scene& scene_;
  const ReplayOptions& options_;
  Timeline timeline_;
  std::vector<FrameHistory> frames_;
  OutputBag* output_ = nullptr;  ///< for the length of run()
  HashFile* hashes_ = nullptr;   ///< the same
  std::vector<std::uint32_t> topology_ids_;
  bool topologies_written_ = false;
  std::int64_t last_stamp_ = 0, simulated_nanoseconds_ = 0;
  std::vector<double> step_ms_, contact_step_ms_;
  double step_seconds_ = 0.0;
  ReplaySummary summary_;
};

}  // namespace

std::uint64_t ReplaySummary::poses_dropped() const {
  std::uint64_t dropped = poses_missing_transform + counters.poses_superseded;
  for (const PoseVerdict verdict : dropped_verdicts) dropped += counters.poses[static_cast<std::size_t>(verdict)];
  return dropped;
}

ReplaySummary replay(const Scene& scene, const ReplayOptions& options) {
  if (options.input == options.output) {
    throw std::runtime_error(options.output + ": is the input too; give the output another name");
  }
  try {
    return Replay(scene, options).run();
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(options.input + " to " + options.output + ": " + error.what());
  } catch (const ros::Exception& error) {
    throw std::runtime_error(options.input + ": a message is damaged (" + error.what() + ")");
  }
}

}  // namespace tissue_sim
