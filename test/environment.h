#pragma once

#include <cstdlib>
#include <string>

namespace tissue_sim {

/// Sets an environment variable while it lives.
struct Environment {
  const char* name;
  bool was_set;
  std::string before;

  Environment(const char* variable, const std::string& value)
      : name(variable), was_set(std::getenv(variable)), before(was_set ? std::getenv(variable) : "") {
    setenv(variable, value.c_str(), 1);
  }
  ~Environment() { was_set ? setenv(name, before.c_str(), 1) : unsetenv(name); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
};

}  // namespace tissue_sim
