#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace tissue_sim {

/// Looks every second whether the master still knows this node, and registers all its topics and services where a
/// master that was started anew does not. roscpp registers once: nobody would find the node again, though connections
/// that are there go on without a master. In a thread of its own: a master on a machine that has gone takes minutes not
/// to answer.
class Registration {
 public:
  /// `services`: names, resolved, that the node serves; roscpp can be asked for its topics, but not for these.
  explicit Registration(const std::vector<std::string>& services);
  ~Registration();
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;

 private:
  struct Watch;
  std::shared_ptr<Watch> watch_;
};

}  // namespace tissue_sim
