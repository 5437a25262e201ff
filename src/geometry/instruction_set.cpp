#include "tissue_sim/geometry/instruction_set.h"

#include <stdexcept>
#include <string>

namespace tissue_sim {

namespace {

InstructionSet& used() {
  static InstructionSet set = available(InstructionSet::avx512) ? InstructionSet::avx512
                              : available(InstructionSet::avx2) ? InstructionSet::avx2
                                                                : InstructionSet::baseline;
  return set;
}

}  // namespace

bool available(InstructionSet set) {
#ifdef __x86_64__
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2") != 0;
  if (set == InstructionSet::avx512) {
    return available(InstructionSet::avx2) && __builtin_cpu_supports("avx512f") != 0 &&
           __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
           __builtin_cpu_supports("avx512vl") != 0;
  }
#endif
  return set == InstructionSet::baseline;
}

InstructionSet instruction_set() {
  return used();
}

void use_instruction_set(InstructionSet set) {
  if (!available(set)) throw std::invalid_argument(std::string("this processor has no ") + name(set));
  used() = set;
}

const char* name(InstructionSet set) {
  return set == InstructionSet::avx512 ? "avx512" : set == InstructionSet::avx2 ? "avx2" : "baseline";
}

}  // namespace tissue_sim
