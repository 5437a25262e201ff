#include "tissue_sim/ros/registration.h"

#include <ros/connection_manager.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <set>
#include <thread>

namespace tissue_sim {
namespace {

using Value = XmlRpc::XmlRpcValue;

constexpr std::chrono::seconds period(1);

/// One call to the master or to this node itself: [code, message, value] as every answer of ROS.
struct Answer {
  bool came = false;
  bool good = false;
  Value value;
};

Answer call(const std::string& uri, const std::string& method, const std::vector<std::string>& words,
            const Value& last = Value()) {
  std::string host;
  std::uint32_t port = 0;
  Answer answer;
  if (!ros::network::splitURI(uri, host, port)) return answer;
  Value request;
  request[0] = ros::this_node::getName();
  for (const std::string& word : words) request[request.size()] = word;
  if (last.valid()) request[request.size()] = last;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  Value response;
  answer.came = client.execute(method.c_str(), request, response) && !client.isFault();
  client.close();
  answer.came = answer.came && response.getType() == Value::TypeArray && response.size() == 3 &&
                response[0].getType() == Value::TypeInt;
  if (!answer.came) return answer;
  answer.good = static_cast<int>(response[0]) == 1;
  answer.value = response[2];
  return answer;
}

/// Where other nodes reach this one.
std::string own_uri() {
  return ros::XMLRPCManager::instance()->getServerURI();
}

std::string master_uri() {
  return "http://" + ros::master::getHost() + ":" + std::to_string(ros::master::getPort());
}

/// The publishers that the node hears on each topic, as their own URI: pairs of both.
std::set<std::pair<std::string, std::string>> heard_publishers() {
  std::set<std::pair<std::string, std::string>> heard;
  Answer info = call(own_uri(), "getBusInfo", {});
  for (int i = 0; info.good && i < info.value.size(); ++i) {
    Value& link = info.value[i];  // id, URI, direction, transport, topic, ...
    if (link.size() > 4 && static_cast<std::string>(link[2]) == "i") {
      heard.insert({static_cast<std::string>(link[4]), static_cast<std::string>(link[1])});
    }
  }
  return heard;
}

/// The publishers that a new master knows already, besides those that are heard: one that is not named is dropped.
void hear(const std::string& topic, Value publishers) {
  if (publishers.getType() != Value::TypeArray || publishers.size() == 0) return;
  for (const auto& [heard_topic, uri] : heard_publishers()) {
    if (heard_topic == topic) publishers[publishers.size()] = uri;
  }
  call(own_uri(), "publisherUpdate", {topic}, publishers);
}

/// False: the master is gone again.
bool register_all(const std::vector<std::string>& services) {
  Answer published = call(own_uri(), "getPublications", {});
  Answer subscribed = call(own_uri(), "getSubscriptions", {});
  if (!published.good || !subscribed.good) return false;
  for (int i = 0; i < published.value.size(); ++i) {
    Value& topic = published.value[i];
    if (!call(master_uri(), "registerPublisher", {topic[0], topic[1], own_uri()}).good) return false;
  }
  for (int i = 0; i < subscribed.value.size(); ++i) {
    Value& topic = subscribed.value[i];
    const Answer publishers = call(master_uri(), "registerSubscriber", {topic[0], topic[1], own_uri()});
    if (!publishers.good) return false;
    hear(topic[0], publishers.value);
  }
  const std::string service_uri =
      "rosrpc://" + ros::network::getHost() + ":" + std::to_string(ros::ConnectionManager::instance()->getTCPPort());
  for (const std::string& service : services) {
    if (!call(master_uri(), "registerService", {service, service_uri, own_uri()}).good) return false;
  }
  ROS_WARN_STREAM("the master at " << master_uri() << " was started anew: " << published.value.size() << " topics out, "
                                   << subscribed.value.size() << " in and " << services.size()
                                   << " services are registered again");
  return true;
}

}  // namespace

struct Registration::Watch {
  std::vector<std::string> services;
  std::mutex mutex;
  std::condition_variable changed;
  bool stopping = false;
  bool ended = false;
  bool answered = true;  ///< at the last look
  bool complete = true;  ///< nothing was left unregistered

  bool stop_within(std::chrono::milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, time, [this] { return stopping; });
  }

  void look() {
    const Answer known = call(master_uri(), "lookupNode", {ros::this_node::getName()});
    if (known.came != answered) {
      answered = known.came;
      if (!answered) {
        ROS_WARN_STREAM("the master at " << master_uri() << " does not answer: what is connected goes on, and the node "
                                         << "registers again when a master is back");
      }
    }
    if (!known.came || (known.good && complete) || !ros::ok() || ros::isShuttingDown()) return;
    complete = register_all(services);
  }

  void run() {
    while (!stop_within(period)) look();
    const std::lock_guard<std::mutex> lock(mutex);
    ended = true;
    changed.notify_all();
  }
};

Registration::Registration(const std::vector<std::string>& services) : watch_(std::make_shared<Watch>()) {
  watch_->services = services;
  std::thread([watch = watch_] { watch->run(); }).detach();
}

Registration::~Registration() {
  std::unique_lock<std::mutex> lock(watch_->mutex);
  watch_->stopping = true;
  watch_->changed.notify_all();
  // A call that hangs is left behind: it ends with the program.
  watch_->changed.wait_for(lock, std::chrono::seconds(2), [this] { return watch_->ended; });
}

}  // namespace tissue_sim
