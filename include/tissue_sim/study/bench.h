#pragma once

#include <string>
#include <vector>

#include "tissue_sim/study/json_rows.h"

namespace tissue_sim {

/// The words behind the name of a command of tissue_sim_bench. A command takes those that it knows; what is left over
/// is an error.
struct BenchWords {
  std::vector<std::string> words;

  /// Takes the word `name` out. False: it is not there.
  bool take(const std::string& name);

  /// Takes the word `name` and the one after it out. Empty: they are not there.
  std::string take_value(const std::string& name);

  /// The same for a whole number, which is left as it is where they are not there. False: not a number from `least` to
  /// `most`.
  bool take_number(const std::string& name, int least, int most, int& number);
};

/// Takes its options, prints its table and adds its rows. False, and nothing is run: words that it does not know.
using BenchRun = bool (*)(BenchWords& words, JsonRows& json);

/// One a file src/study/<name>_bench.cpp, in the table of bench_main.cpp.
bool bench_paper(BenchWords& words, JsonRows& json);
bool bench_peers(BenchWords& words, JsonRows& json);
bool bench_scale(BenchWords& words, JsonRows& json);
bool bench_limits(BenchWords& words, JsonRows& json);
bool bench_elements(BenchWords& words, JsonRows& json);
bool bench_levels(BenchWords& words, JsonRows& json);
bool bench_load(BenchWords& words, JsonRows& json);
bool bench_soak(BenchWords& words, JsonRows& json);

}  // namespace tissue_sim
