#include "tissue_sim/study/bench.h"

#include <algorithm>
#include <cstdlib>

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

bool BenchWords::take_number(const std::string& name, int least, int most, int& number) {
  const std::string value = take_value(name);
  if (value.empty()) return true;
  char* end = nullptr;
  const long given = std::strtol(value.c_str(), &end, 10);
  if (*end != 0 || given < least || given > most) return false;
  number = static_cast<int>(given);
  return true;
}

}  // namespace tissue_sim
