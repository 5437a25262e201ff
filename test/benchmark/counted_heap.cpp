#include "benchmark/counted_heap.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> allocations{0};
std::atomic<std::size_t> live{0}, peak{0};  ///< bytes

void* taken(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  void* const memory = std::malloc(size > 0 ? size : 1);
  if (!memory) throw std::bad_alloc();
  const std::size_t now = live += malloc_usable_size(memory);
  if (now > peak) peak = now;
  return memory;
}

void given_back(void* memory) {
  if (memory) live -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

// Of the whole program: the standard library's are replaced.
void* operator new(std::size_t size) {
  return taken(size);
}
void* operator new[](std::size_t size) {
  return taken(size);
}
// The standard library's calls the one above, a sanitizer's does not, and then sees it freed by another.
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  try {
    return taken(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void operator delete(void* memory) noexcept {
  given_back(memory);
}
void operator delete[](void* memory) noexcept {
  given_back(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  given_back(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  given_back(memory);
}

namespace tissue_sim {

std::size_t counted_allocations() {
  return allocations.load(std::memory_order_relaxed);
}

std::size_t live_bytes() {
  return live;
}

std::size_t peak_bytes() {
  return peak;
}

void forget_peak() {
  peak = live.load();
}

}  // namespace tissue_sim
