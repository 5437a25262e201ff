// What `tissue_sim_bench frame` runs: from the pose of an instrument to the state that shows it, between two processes.

#include <arpa/inet.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <fcntl.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "tissue_sim/ros/master.h"
#include "tissue_sim/ros/messages.h"
#include "tissue_sim/scene/resource_path.h"
#include "tissue_sim/simulation/accuracy.h"
#include "tissue_sim/study/json_rows.h"

namespace {

using namespace tissue_sim;
using Clock = std::chrono::steady_clock;

constexpr const char* usage =
    "usage: tissue_sim_bench frame [--scene FILE] [--bag FILE] [--rate HZ] [--poses N] [--json FILE]\n"
    "  Runs tissue_sim_node on a scene, with a master of its own where none answers, publishes the poses of a bag\n"
    "  through TCPROS and takes the time until the state, the contacts and the force of each pose are there.\n"
    "  --scene FILE  package://tissue_sim/config/scenes/demo.yaml\n"
    "  --bag FILE    poses of the scene's first instrument: package://tissue_sim/config/demo.bag\n"
    "  --rate HZ     poses a second: 1000, or fewer where the step takes longer than half of that\n"
    "  --poses N     no more than N, a time step of motion apart (all of the bag)\n"
    "  --json FILE   write the rows to FILE\n";

constexpr double fastest_rate = 1000.0;  // Hz
constexpr double busy = 0.5;  // of the time between two poses that a step may take, so that a slow one is made up for
constexpr int probing_contacts = 200;                  // steps with contact that say how long a step takes
constexpr double patience = 20.0;                      // s for a program to start
constexpr std::int64_t after_motion = 60'000'000'000;  // ns: stamps this much later are no part of the motion
constexpr double drain = 3.0;                          // s without an answer, after the last pose

struct Arguments {
  std::string scene = "package://tissue_sim/config/scenes/demo.yaml";
  std::string bag = "package://tissue_sim/config/demo.bag";
  double rate = 0.0;  ///< Hz; 0: as the step allows
  std::size_t poses = 0;
  std::string json;
};

bool read_arguments(int argc, char** argv, Arguments& arguments) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (i + 1 == argc) return false;
    const std::string value = argv[++i];
    if (word == "--scene") {
      arguments.scene = value;
    } else if (word == "--bag") {
      arguments.bag = value;
    } else if (word == "--json") {
      arguments.json = value;
    } else if (word == "--rate" || word == "--poses") {
      char* end = nullptr;
      const double number = std::strtod(value.c_str(), &end);
      if (*end != '\0' || !(number >= 1.0 && number <= 1e6)) return false;
      if (word == "--rate") {
        arguments.rate = number;
      } else {
        arguments.poses = static_cast<std::size_t>(number);
      }
    } else {
      return false;
    }
  }
  return true;
}

/// A program that ends with this one. Interrupted first, so that it can tell the master.
class Child {
 public:
  Child(const std::string& program, const std::vector<std::string>& arguments) : name_(program) {
    std::vector<char*> words = {const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    id_ = fork();
    if (id_ < 0) throw std::runtime_error(program + ": cannot be started");
    if (id_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGINT);
    const int nowhere = open("/dev/null", O_WRONLY);
    dup2(nowhere, STDOUT_FILENO);
    execvp(words[0], words.data());
    _exit(127);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    for (const int signal : {SIGINT, SIGKILL}) {
      if (!running()) return;
      kill(id_, signal);
      for (int i = 0; i < 1000 && running(); ++i) usleep(10000);
    }
  }

  bool running() {
    if (id_ > 0 && waitpid(id_, nullptr, WNOHANG) != 0) id_ = 0;
    return id_ > 0;
  }

  /// Throws where the program ends before `ready`, or takes too long.
  void wait_until(const std::function<bool()>& ready) {
    const Clock::time_point start = Clock::now();
    while (!ready()) {
      if (!running()) throw std::runtime_error(name_ + " has ended before it was ready; its last lines say why");
      if (Clock::now() - start > std::chrono::duration<double>(patience)) {
        throw std::runtime_error(name_ + " is not ready after 20 s");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

 private:
  std::string name_;
  pid_t id_ = 0;
};

/// A TCP port that nobody has.
int free_port() {
  const int handle = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool found = bind(handle, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     getsockname(handle, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  close(handle);
  if (!found) throw std::runtime_error("no free TCP port for a ROS master");
  return ntohs(address.sin_port);
}

/// Null where a master answers already.
std::unique_ptr<Child> start_master() {
  const char* environment = std::getenv("ROS_MASTER_URI");
  if (environment != nullptr && master_answers(environment)) return nullptr;
  const std::string port = std::to_string(free_port());
  const std::string uri = "http://localhost:" + port;
  setenv("ROS_MASTER_URI", uri.c_str(), 1);
  auto master = std::make_unique<Child>("rosmaster", std::vector<std::string>{"--core", "-p", port});
  master->wait_until([&] { return master_answers(uri); });
  return master;
}

/// The motion of the bag's poses, one a time step.
std::vector<StampedPose> read_motion(const std::string& path, const Scene& scene, std::size_t limit) {
  const std::string& topic = scene.instruments[0].pose_topic;
  std::vector<StampedPose> recorded;
  try {
    rosbag::Bag bag(path, rosbag::bagmode::Read);
    rosbag::View view(bag, rosbag::TopicQuery(std::vector<std::string>{topic, "/" + topic}));
    for (const rosbag::MessageInstance& instance : view) {
      const auto message = instance.instantiate<geometry_msgs::PoseStamped>();
      if (!message) continue;
      if (message->header.frame_id != scene.frame) {
        throw std::runtime_error(path + ": its poses are in frame \"" + message->header.frame_id +
                                 "\", give a bag with poses in the scene's, \"" + scene.frame + "\"");
      }
      StampedPose pose = {static_cast<std::int64_t>(message->header.stamp.toNSec()), to_pose(message->pose)};
      bool normalised = false;
      if (judge_pose(pose, normalised) != PoseVerdict::used) continue;
      if (recorded.empty() || pose.stamp > recorded.back().stamp) recorded.push_back(pose);
    }
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(path + ": not a bag that can be read (" + error.what() + ")");
  }
  if (recorded.size() < 2) throw std::runtime_error(path + ": has not two poses on " + topic);
  const std::int64_t step = std::llround(1e9 * scene.time_step);
  std::vector<StampedPose> motion;
  std::size_t next = 1;
  for (std::int64_t t = recorded[0].stamp; t <= recorded.back().stamp; t += step) {
    while (recorded[next].stamp < t) ++next;
    const StampedPose& a = recorded[next - 1];
    const StampedPose& b = recorded[next];
    const double part = static_cast<double>(t - a.stamp) / static_cast<double>(b.stamp - a.stamp);
    motion.push_back({t, interpolate(a.pose, b.pose, part)});
    if (motion.size() == limit) break;
  }
  return motion;
}

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Waits for the next tick of `rate` Hz.
class Pace {
 public:
  explicit Pace(double rate) : period_(std::chrono::nanoseconds(std::llround(1e9 / rate))) {}
  void wait() {
    next_ += period_;
    std::this_thread::sleep_until(next_);
  }

 private:
  std::chrono::nanoseconds period_;
  Clock::time_point next_ = Clock::now();
};

/// The steps alone, in this process.
struct Steps {
  std::vector<double> seconds;  ///< one a pose
  std::vector<char> contact;    ///< 1: something touched
};

TimelineOptions options_for(const Scene& scene) {
  TimelineOptions options;
  options.state_period = std::llround(1e9 * scene.time_step);
  return options;
}

/// `rate` 0: as fast as it goes, until there were enough steps with contact.
Steps make_steps(const Scene& scene, const std::vector<StampedPose>& motion, double rate) {
  Timeline timeline(scene, options_for(scene));
  Steps steps;
  int contacts = 0;
  Pace pace(rate > 0.0 ? rate : 1e9);
  for (const StampedPose& pose : motion) {
    if (rate > 0.0) pace.wait();
    const Clock::time_point start = Clock::now();
    timeline.add_pose(0, pose);
    while (timeline.step()) {
    }
    steps.seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
    steps.contact.push_back(timeline.report().contacts.empty() ? 0 : 1);
    contacts += steps.contact.back();
    if (rate <= 0.0 && contacts == probing_contacts) break;
  }
  return steps;
}

/// Of `values`, those of poses with contact; all where nothing was touched.
std::vector<double> in_contact(const std::vector<double>& values, const Steps& steps) {
  std::vector<double> chosen;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (steps.contact[i]) chosen.push_back(values[i]);
  }
  return chosen.empty() ? values : chosen;
}

/// When each pose's message on one topic was there. A pose that came while an older one waited has passed that over:
/// no contacts carry the older one's stamp then, a state may, since its step is on the way to the newer one.
struct Output {
  std::string topic;
  ros::Subscriber subscriber;
  std::vector<Clock::time_point> arrival;  ///< zero: not received
  std::size_t received = 0;
  std::size_t strangers = 0;         ///< stamps that no pose has
  std::atomic<bool> greeted{false};  ///< a message came for a pose that is later than the motion
};

/// The client: publishes poses, listens.
class Client {
 public:
  Client(const Scene& scene, const std::vector<StampedPose>& motion, const std::string& space)
      : scene_(scene), motion_(motion), node_(space), sent_(motion.size()) {
    node_.setCallbackQueue(&queue_);
    listen<TissueState>(outputs_[0], "tissue_sim/" + scene.organs[0].name + "/state");
    listen<Contacts>(outputs_[1], "tissue_sim/contacts");
    listen<geometry_msgs::WrenchStamped>(outputs_[2], "tissue_sim/" + scene.instruments[0].name + "/measured_cf");
    const boost::function<void(const diagnostic_msgs::DiagnosticArray&)> note = [this](const auto& message) {
      note_diagnostics(message);
    };
    diagnostics_ = node_.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10, note);
    const std::string& topic = scene.instruments[0].pose_topic;
    poses_ = node_.advertise<geometry_msgs::PoseStamped>(topic, 100);
  }

  /// Publishes a pose, standing where the motion starts and later than all of it, and waits a moment. True once all
  /// outputs have answered such a pose: no connection is still being made then, on either side. The motion that follows
  /// is a new run for the node, from rest, since its stamps are earlier.
  bool greet() {
    publish({motion_.back().stamp + after_motion + greetings_++ * std::llround(1e9 * scene_.time_step),
             motion_.front().pose});
    queue_.callAvailable(ros::WallDuration(0.01));
    return std::all_of(outputs_.begin(), outputs_.end(), [](const Output& output) { return output.greeted.load(); });
  }

  /// Publishes all poses and waits for what comes back.
  void run(double rate, Child& node) {
    ros::AsyncSpinner spinner(1, &queue_);
    spinner.start();
    Pace pace(rate);
    for (std::size_t i = 0; i < motion_.size() && node.running() && ros::ok(); ++i) {
      pace.wait();
      sent_[i] = Clock::now();
      publish(motion_[i]);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(drain));
    spinner.stop();
    if (!node.running()) throw std::runtime_error("tissue_sim_node has ended; its last lines say why");
  }

  const std::array<Output, 3>& outputs() const { return outputs_; }

  /// Pose published to message received, s; one a pose, below zero where none came.
  std::vector<double> latencies(const Output& output) const {
    std::vector<double> seconds;
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      const bool came = output.arrival[i] != Clock::time_point();
      seconds.push_back(came ? std::chrono::duration<double>(output.arrival[i] - sent_[i]).count() : -1.0);
    }
    return seconds;
  }

  /// What the node says of itself, mean, ms.
  double node_step() const { return node_steps_ > 0.0 ? node_ms_ / node_steps_ : 0.0; }

 private:
  void publish(const StampedPose& pose) {
    geometry_msgs::PoseStamped message;
    message.header.frame_id = scene_.frame;
    message.header.stamp = to_ros_time(pose.stamp);
    message.pose.position.x = pose.pose.position.x();
    message.pose.position.y = pose.pose.position.y();
    message.pose.position.z = pose.pose.position.z();
    message.pose.orientation.x = pose.pose.orientation.x();
    message.pose.orientation.y = pose.pose.orientation.y();
    message.pose.orientation.z = pose.pose.orientation.z();
    message.pose.orientation.w = pose.pose.orientation.w();
    poses_.publish(message);
  }

  template <class Message>
  void listen(Output& output, const std::string& topic) {
    output.topic = topic.substr(topic.find('/') + 1);
    output.arrival.resize(motion_.size());
    const boost::function<void(const boost::shared_ptr<const Message>&)> take = [this, &output](const auto& message) {
      const Clock::time_point now = Clock::now();
      const std::int64_t stamp = static_cast<std::int64_t>(message->header.stamp.toNSec());
      const auto pose = std::lower_bound(motion_.begin(), motion_.end(), stamp,
                                         [](const StampedPose& p, std::int64_t t) { return p.stamp < t; });
      if (stamp >= motion_.back().stamp + after_motion) {
        output.greeted = true;
        return;
      }
      if (pose == motion_.end() || pose->stamp != stamp) {
        ++output.strangers;
        return;
      }
      output.arrival[static_cast<std::size_t>(pose - motion_.begin())] = now;
      ++output.received;
    };
    output.subscriber =
        node_.subscribe<Message>(topic, 100, take, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  }

  void note_diagnostics(const diagnostic_msgs::DiagnosticArray& message) {
    double steps = 0.0;
    double ms = 0.0;
    for (const auto& value : message.status[0].values) {
      if (value.key == "steps") steps = std::stod(value.value);
      if (value.key == "ms_per_step") ms = std::stod(value.value);
    }
    node_ms_ += ms * (steps - node_steps_);
    node_steps_ = steps;
  }

  const Scene& scene_;
  const std::vector<StampedPose>& motion_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Publisher poses_;
  ros::Subscriber diagnostics_;
  std::vector<Clock::time_point> sent_;
  std::array<Output, 3> outputs_;
  std::int64_t greetings_ = 0;
  double node_ms_ = 0.0, node_steps_ = 0.0;
};

/// Two digits, downward.
double rounded_down(double rate) {
  const double unit = std::pow(10.0, std::floor(std::log10(rate)) - 1.0);
  return unit * std::floor(rate / unit);
}

void write_json(const std::string& path, const std::string& scene, const JsonRows& json) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file != nullptr) {
    std::fprintf(file, "{\n  \"bench\": \"frame\",\n  \"scene\": \"%s\",\n  \"rows\": [%s\n  ]\n}\n", scene.c_str(),
                 json.rows.c_str());
  }
  if (file == nullptr || std::fclose(file) != 0) {
    throw std::runtime_error(path + ": cannot be written: check the folder and its rights");
  }
}

JsonRows report(const Client& client, const Steps& steps, double rate) {
  JsonRows json;
  const std::vector<double> step = in_contact(steps.seconds, steps);
  std::printf("\n%-24s  received  missed   median     p99   step median   beyond it: median     p99  [ms]\n", "output");
  for (const Output& output : client.outputs()) {
    const std::vector<double> latencies = client.latencies(output);
    std::vector<double> whole;
    std::vector<double> beyond;
    for (std::size_t i = 0; i < latencies.size(); ++i) {
      if (latencies[i] < 0.0) continue;
      const bool counts = steps.contact[i] || step.size() == steps.seconds.size();
      if (!counts) continue;
      whole.push_back(1e3 * latencies[i]);
      beyond.push_back(1e3 * (latencies[i] - steps.seconds[i]));
    }
    const std::size_t missed = latencies.size() - output.received;
    const double step_median = 1e3 * quantile(step, 0.5);
    std::printf("%-24s  %8zu  %6zu  %7.3f %7.3f  %12.3f  %18.3f %7.3f\n", output.topic.c_str(), output.received, missed,
                quantile(whole, 0.5), quantile(whole, 0.99), step_median, quantile(beyond, 0.5),
                quantile(beyond, 0.99));
    json.add(
        text("\"output\": \"%s\", \"ms_median\": %.6g, \"ms_p99\": %.6g, \"ms_step_median\": %.6g, "
             "\"ms_beyond_step_median\": %.6g, \"ms_beyond_step_p99\": %.6g, \"rate_hz\": %.6g, \"published\": %zu, "
             "\"received\": %zu, \"missed\": %zu, \"unknown_stamps\": %zu, \"poses_in_contact\": %zu",
             output.topic.c_str(), quantile(whole, 0.5), quantile(whole, 0.99), step_median, quantile(beyond, 0.5),
             quantile(beyond, 0.99), rate, latencies.size(), output.received, missed, output.strangers,
             static_cast<std::size_t>(std::count(steps.contact.begin(), steps.contact.end(), 1))));
  }
  return json;
}

std::filesystem::path this_program() {
  return std::filesystem::read_symlink("/proc/self/exe");
}

/// A path is relative to the folder that the user stands in; the package is found from where this program lies too.
std::string file_of(const std::string& argument) {
  const bool path = argument.find("://") == std::string::npos;
  return resolve_path(argument, path ? std::filesystem::absolute("here").string() : this_program().string());
}

void bench(const Arguments& arguments, int argc, char** argv) {
  const std::string scene_file = file_of(arguments.scene);
  std::vector<std::string> warnings;
  std::vector<ModelChoice> choices;
  const Scene scene = load_chosen_scene(scene_file, warnings, choices);
  const std::vector<StampedPose> motion = read_motion(file_of(arguments.bag), scene, arguments.poses);

  const Steps probe = make_steps(scene, motion, 0.0);
  const double step = quantile(in_contact(probe.seconds, probe), 0.5);
  const double allowed = std::min(fastest_rate, rounded_down(busy / step));
  const double rate = arguments.rate > 0.0 ? arguments.rate : allowed;
  std::printf("%s: %zu poses, %.4g ms of motion apart, published at %.4g Hz\n", scene_file.c_str(), motion.size(),
              1e3 * scene.time_step, rate);
  if (rate < fastest_rate) {
    std::printf("(a step takes %.3f ms: at %.4g Hz poses would queue for it)\n", 1e3 * step, fastest_rate);
  }
  std::fflush(stdout);

  const std::unique_ptr<Child> master = start_master();
  ros::init(argc, argv, "tissue_sim_bench_frame", ros::init_options::AnonymousName | ros::init_options::NoRosout);
  const std::string space = "/frame_" + std::to_string(getpid());
  {
    Child node((this_program().parent_path() / "tissue_sim_node").string(),
               {"__name:=tissue_sim", "__ns:=" + space, "_scene:=" + scene_file,
                "_state_period:=" + text("%.9f", scene.time_step)});
    Client client(scene, motion, space);
    node.wait_until([&] { return client.greet(); });
    client.run(rate, node);
    const Steps steps = make_steps(scene, motion, rate);
    const double all = std::accumulate(steps.seconds.begin(), steps.seconds.end(), 0.0);
    std::printf("A step alone, in this process at the same rate: mean %.3f ms; the node says of its own: %.3f ms\n",
                1e3 * all / static_cast<double>(steps.seconds.size()), client.node_step());
    std::printf(
        "Times of the %zu poses in contact: pose published to message received; beyond the step of that pose alone.\n"
        "The two were not made at once: what disturbed one of them only is in the 99th percentile.\n"
        "Missed: poses that the node passed over, since a newer one had come.\n",
        in_contact(steps.seconds, steps).size());
    const JsonRows json = report(client, steps, rate);
    if (!arguments.json.empty()) write_json(arguments.json, arguments.scene, json);
  }
  ros::shutdown();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--help") {
    std::fputs(usage, stdout);
    return 0;
  }
  Arguments arguments;
  if (!read_arguments(argc, argv, arguments)) {
    std::fputs(usage, stderr);
    return 2;
  }
  try {
    bench(arguments, argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tissue_sim_bench frame: %s\n", error.what());
    return 1;
  }
  return 0;
}
