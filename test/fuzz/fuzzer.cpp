#include <cstddef>
#include <cstdint>
#include <string>

#include "entries.h"

/// One program a door: the build names the function.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tissue_sim::TISSUE_SIM_FUZZ_ENTRY(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
