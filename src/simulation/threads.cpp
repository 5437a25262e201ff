#include "tissue_sim/simulation/threads.h"

#include <stdexcept>
#include <string>

namespace tissue_sim {

namespace {

constexpr unsigned part_bits = 12;
constexpr std::uint64_t part_mask = (std::uint64_t{1} << part_bits) - 1;

/// Looks before a thread sleeps: some 30 us, longer than from one part of a substep's forces to the next. To wake one
/// costs the caller a few microseconds, and it comes some 50 later.
constexpr int looks = 1000;

// A ticket: the number of the work, the next part, how many parts there are.
std::uint64_t next_of(std::uint64_t ticket) {
  return (ticket >> part_bits) & part_mask;
}
std::uint64_t parts_of(std::uint64_t ticket) {
  return ticket & part_mask;
}
bool has_parts(std::uint64_t ticket) {
  return next_of(ticket) < parts_of(ticket);
}
std::uint64_t after(std::uint64_t ticket, std::size_t parts) {
  return (((ticket >> (2 * part_bits)) + 1) << (2 * part_bits)) | parts;
}

/// Leaves the core's other half and the cache line alone for a moment.
void pause() {
#ifdef __x86_64__
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

}  // namespace

Threads::Threads(int count) {
  if (count < 1 || count > most_threads) {
    throw std::invalid_argument("threads: expected 1 to " + std::to_string(most_threads));
  }
  workers_.reserve(static_cast<std::size_t>(count - 1));
  try {
    for (int i = 1; i < count; ++i) workers_.emplace_back([this] { look_for_work(); });
  } catch (...) {
    stop();
    throw;
  }
}

Threads::~Threads() {
  stop();
}

void Threads::stop() {
  {
    const std::lock_guard<std::mutex> lock(sleep_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
}

/// Takes the next part of the present work, of which `ticket` is what was last seen. False: none is left.
bool Threads::take_part(std::uint64_t& ticket, std::size_t& part) {
  while (has_parts(ticket)) {
    const std::uint64_t taken = next_of(ticket);
    if (ticket_.compare_exchange_weak(ticket, ticket + (std::uint64_t{1} << part_bits))) {
      part = static_cast<std::size_t>(taken);
      ticket += std::uint64_t{1} << part_bits;
      return true;
    }
  }
  return false;
}

void Threads::run_parts(std::size_t parts, Call call, const void* work) {
  if (parts > part_mask) throw std::invalid_argument("threads: too many parts");
  if (workers_.empty() || parts < 2) {
    for (std::size_t part = 0; part < parts; ++part) call(work, part);
    return;
  }
  call_ = call;
  work_ = work;
  done_.store(0, std::memory_order_relaxed);
  std::uint64_t ticket = after(ticket_.load(std::memory_order_relaxed), parts);
  // In one order with what a thread does that goes to sleep: either it sees the work, or it is seen asleep.
  ticket_.store(ticket);
  if (asleep_.load() > 0) {
    const std::lock_guard<std::mutex> lock(sleep_);
    wake_.notify_all();
  }
  std::size_t part = 0;
  std::size_t mine = 0;
  while (take_part(ticket, part)) {
    call(work, part);
    ++mine;
  }
  for (int look = 0; done_.load(std::memory_order_acquire) + mine < parts; ++look) {
    if (look < looks) {
      pause();
    } else {
      std::this_thread::yield();  // whoever has the last part may be waiting for this core
    }
  }
}

void Threads::look_for_work() {
  while (!stopping_) {
    std::uint64_t ticket = ticket_.load();
    for (int look = 0; look < looks && !has_parts(ticket) && !stopping_; ++look) {
      pause();
      ticket = ticket_.load();
    }
    std::size_t part = 0;
    if (!has_parts(ticket)) {
      sleep_until(ticket);
      continue;
    }
    while (take_part(ticket, part)) {
      call_(work_, part);
      done_.fetch_add(1, std::memory_order_release);
    }
  }
}

/// Until there is other work than that of the ticket `seen`, or none ever again.
void Threads::sleep_until(std::uint64_t seen) {
  std::unique_lock<std::mutex> lock(sleep_);
  ++asleep_;
  wake_.wait(lock, [&] { return ticket_.load() != seen || stopping_; });
  --asleep_;
}

}  // namespace tissue_sim
