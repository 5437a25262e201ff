#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace tissue_sim {

/// Numbers 0 .. n - 1 that come out once each and in order, without sorting: a bit for each, a bit for each 64 of
/// those, and so on, so that what is not there costs nothing.
class AscendingSet {
 public:
  void prepare(std::size_t n) {
    for (std::vector<std::uint64_t>& level : levels_) {
      n = n / 64 + 1;
      level.assign(n, 0);
    }
  }
  void add(int number) {
    auto n = static_cast<std::uint64_t>(number);
    for (std::vector<std::uint64_t>& level : levels_) {
      std::uint64_t& word = level[n / 64];
      const bool known_above = word != 0;
      word |= std::uint64_t{1} << (n % 64);
      if (known_above) return;
      n /= 64;
    }
  }
  /// Appends what has been added to `list`, and starts again with nothing.
  void drain_to(std::vector<int>& list) {
    for (std::size_t word = 0; word < levels_.back().size(); ++word) drain(levels_.size() - 1, word, list);
  }

 private:
  void drain(std::size_t level, std::size_t word, std::vector<int>& list) {
    std::uint64_t& bits = levels_[level][word];
    for (; bits != 0; bits &= bits - 1) {
      const std::size_t n = 64 * word + static_cast<std::size_t>(__builtin_ctzll(bits));
      if (level == 0) {
        list.push_back(static_cast<int>(n));
      } else {
        drain(level - 1, n, list);
      }
    }
  }

  std::array<std::vector<std::uint64_t>, 3> levels_;
};

}  // namespace tissue_sim
