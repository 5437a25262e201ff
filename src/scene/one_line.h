#pragma once

#include <algorithm>
#include <string>

namespace tissue_sim {

/// Values and messages from elsewhere may hold line breaks and worse; an error is one line.
inline std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

}  // namespace tissue_sim
