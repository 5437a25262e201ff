#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace tissue_sim {

/// As printf, up to 1023 characters.
__attribute__((format(printf, 1, 2))) inline std::string text(const char* format, ...) {
  char buffer[1024];
  va_list values;
  va_start(values, format);
  std::vsnprintf(buffer, sizeof buffer, format, values);
  va_end(values);
  return buffer;
}

/// The rows of a `--json` file as they are made; nothing is written before all of them are there.
struct JsonRows {
  std::string rows;
  std::string fault;  ///< what should hold and does not: the program says it and its status is 1
  void add(const std::string& row) { rows += (rows.empty() ? "\n    {" : ",\n    {") + row + "}"; }
};

}  // namespace tissue_sim
