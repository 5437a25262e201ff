#pragma once

#include <cfenv>

namespace tissue_sim {

/// What ends a test program on the spot: operations without a meaning, divisions by zero, and overflow. Rounding and
/// underflow are everyday.
constexpr int trapped_exceptions = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;

/// Lets them pass until the end of the scope: for tests that feed numbers that are none on purpose, and for what is not
/// ours. What was raised in the scope is forgotten.
class WithoutTraps {
 public:
  WithoutTraps() : trapped_(fedisableexcept(trapped_exceptions)) {}
  ~WithoutTraps() {
    std::feclearexcept(trapped_exceptions);
    feenableexcept(trapped_ & trapped_exceptions);
  }
  WithoutTraps(const WithoutTraps&) = delete;
  WithoutTraps& operator=(const WithoutTraps&) = delete;

 private:
  int trapped_;
};

}  // namespace tissue_sim
