#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "entries.h"

namespace tissue_sim {
namespace {

const std::map<std::string, Door> doors = {{"scene", enter_scene}, {"urdf", enter_urdf}, {"obj", enter_obj},
                                           {"stl", enter_stl},     {"ply", enter_ply},   {"dae", enter_dae},
                                           {"msh", enter_msh},     {"bag", enter_bag},   {"messages", enter_messages}};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Corpus : public testing::TestWithParam<std::map<std::string, Door>::value_type> {};

/// What the fuzzers started from and what they found: a valid load, or a named error; the doors check which.
TEST_P(Corpus, LoadsOrIsRefusedByName) {
  const auto& [door, enter] = GetParam();
  int taken = 0, refused = 0;
  for (const auto& file : std::filesystem::directory_iterator(TISSUE_SIM_SOURCE_DIR "/test/fuzz/corpus/" + door)) {
    SCOPED_TRACE(file.path().string());
    std::string line;
    EXPECT_NO_THROW(line = enter(bytes_of(file.path())));
    ++(line.empty() ? taken : refused);
  }
  EXPECT_GT(taken, 0) << "nothing in the corpus is valid, so nothing behind the first check is tried";
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(EveryDoor, Corpus, testing::ValuesIn(doors),
                         [](const auto& door) { return door.param.first; });

}  // namespace
}  // namespace tissue_sim
