#include "tissue_sim/study/bench.h"

#include <algorithm>

namespace tissue_sim {

bool BenchWords::take(const std::string& name) {
  const auto found = std::find(words.begin(), words.end(), name);
  if (found == words.end()) return false;
  words.erase(found);
  return true;
}

std::string BenchWords::take_value(const std::string& name) {
  const auto found = std::find(words.begin(), words.end(), name);
  if (found == words.end() || found + 1 == words.end()) return "";
  const std::string value = *(found + 1);
  words.erase(found, found + 2);
  return value;
}

}  // namespace tissue_sim
