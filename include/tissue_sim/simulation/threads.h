#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace tissue_sim {

constexpr int most_threads = 64;

/// Threads that wait for work of a few ten microseconds: they look for it for a while and then sleep. Nothing is
/// allocated after construction. Belongs to the one thread that calls run().
class Threads {
 public:
  /// `count` with the caller's, 1 to most_threads; std::invalid_argument otherwise, std::system_error where the system
  /// has none left.
  explicit Threads(int count);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  int count() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls work(part) once for each part from 0 on, less than 4096 of them, by whichever thread is free; the caller's
  /// takes its share and returns when all is done. It waits for no thread that has not begun: one that is late costs
  /// nothing. `work` must not throw.
  template <class Work>
  void run(std::size_t parts, const Work& work) {
    run_parts(
        parts, [](const void* w, std::size_t part) { (*static_cast<const Work*>(w))(part); }, &work);
  }

 private:
  using Call = void (*)(const void* work, std::size_t part);
  void run_parts(std::size_t parts, Call call, const void* work);
  bool take_part(std::uint64_t& ticket, std::size_t& part);
  void look_for_work();
  void sleep_until(std::uint64_t seen);
  void stop();

  /// Of the present work. Written only while no part of it is left and none is being done.
  Call call_ = nullptr;
  const void* work_ = nullptr;

  /// Which work it is, the next part of it, and how many it has, in one word: whoever is late with the old one takes
  /// nothing of the new.
  alignas(64) std::atomic<std::uint64_t> ticket_{0};
  alignas(64) std::atomic<std::size_t> done_{0};  ///< parts of the present work
  alignas(64) std::atomic<int> asleep_{0};
  std::atomic<bool> stopping_{false};
  std::mutex sleep_;
  std::condition_variable wake_;
  std::vector<std::thread> workers_;
};

/// The same by one thread where there are no others, one part after another.
template <class Work>
void run(Threads* threads, std::size_t parts, const Work& work) {
  if (threads != nullptr) return threads->run(parts, work);
  for (std::size_t part = 0; part < parts; ++part) work(part);
}

}  // namespace tissue_sim
