#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "entries.h"
#include "floating_point_traps.h"

namespace tissue_sim::corpus_test {
namespace {

const std::map<std::string, Door> doors = {{"scene", enter_scene}, {"urdf", enter_urdf}, {"obj", enter_obj},
                                           {"stl", enter_stl},     {"ply", enter_ply},   {"dae", enter_dae},
                                           {"msh", enter_msh},     {"bag", enter_bag},   {"messages", enter_messages}};

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class EveryFile : public testing::TestWithParam<std::map<std::string, Door>::value_type> {};

/// What the fuzzers started from and what they found: a valid load, or a named error; the doors check which.
TEST_P(EveryFile, LoadsOrIsRefusedByName) {
  const auto& [door, enter] = GetParam();
  int taken = 0, refused = 0;
  for (const auto& file : std::filesystem::directory_iterator(TISSUE_SIM_SOURCE_DIR "/test/fuzz/corpus/" + door)) {
    SCOPED_TRACE(file.path().string());
    std::string line;
    const WithoutTraps off;  // numbers that are none, or too large to square
    EXPECT_NO_THROW(line = enter(bytes_of(file.path())));
    ++(line.empty() ? taken : refused);
  }
  EXPECT_GT(taken, 0) << "nothing in the corpus is valid, so nothing behind the first check is tried";
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(OfACorpus, EveryFile, testing::ValuesIn(doors),
                         [](const auto& door) { return door.param.first; });

struct Found {
  const char* door;
  const char* file;
  const char* refusal;  ///< a part of it
};

/// What ended the program, never ended, or was believed, before it was refused.
const Found found[] = {
    {"scene", "comma.yaml", "holds more than one YAML document"},
    {"scene", "end_of_transmission.yaml", ":3:1: scene: holds byte 4"},
    {"scene", "time_step_of_a_picosecond.yaml", "time_step: is '1e-12', allowed is a number from 1e-6"},
    {"scene", "wall_of_1e300.yaml", "time_step: "},
    {"urdf", "circle.urdf", "several joints lead to link"},
    {"urdf", "diamonds.urdf", "several joints lead to link 'c"},
    {"urdf", "nested.urdf", "stands in more than 100 elements"},
    {"urdf", "mesh_named_in_control_characters.urdf", "cannot be fetched"},
    {"obj", "index_of_2147483648.obj", "names vertex 2147483648 of 6"},
    {"obj", "index_of_-2147483648.obj", "'-2147483648' is not a vertex"},
    {"stl", "count_that_wraps.stl", "announces 2147483656 triangles in 484 bytes"},
    {"ply", "list_of_4294967295.ply", "has not element face 0 of 1"},
    {"ply", "list_of_reals.ply", "the length of a list is not a whole number"},
    {"ply", "face_index_out_of_range.ply", "a face names a vertex that is not among the 6"},
    {"dae", "node_in_itself.dae", "leads back to itself"},
    {"dae", "node_in_its_own_scene.dae", "leads back to itself"},
    {"dae", "nodes_that_double.dae", "multiplies to more than 10000 nodes"},
    {"dae", "nested.dae", "stands in more than 100 elements"},
    {"dae", "stride_2147483648.dae", "<accessor> has stride '2147483648'"},
    {"dae", "accessor_4294967295.dae", "<accessor> has count '4294967295'"},
    {"dae", "vcount_of_4294967295.dae", "<vcount> holds what is no index"},
    {"dae", "matrix.dae", "<skew> is not read"},
    {"dae", "skin.dae", "export it without one"},
    {"msh", "section_named_in_control_characters.msh", "$En"},
    {"bag", "index_points_outside.bag", "points to a message that is not there"},
    {"bag", "index_points_between.bag", "points to a message that is not there"},
    {"bag", "index_time_out_of_range.bag", "Time is out of dual 32-bit range"},
    {"bag", "chunk_info_points_outside.bag", "points to a chunk that is not there"},
    {"bag", "bz2_chunk_size_larger.bag", "unpacks to less than it announces"},
    {"bag", "lz4_chunk_size_larger.bag", "cannot be unpacked"},
    {"bag", "transforms_1000000.bag", "a message on /tf is damaged"},
    {"bag", "version_12.bag", "rosbag fix"},
    {"messages", "last_second.bin", "late stamp"},
    {"messages", "last_second_held.bin", "late stamp"},
    {"messages", "transforms_4294967295.bin", "transforms are cut short"},
};

TEST(Corpus, WhatWasFoundIsRefusedForItsReason) {
  for (const Found& one : found) {
    SCOPED_TRACE(std::string(one.door) + "/" + one.file);
    const std::string bytes =
        bytes_of(std::string(TISSUE_SIM_SOURCE_DIR "/test/fuzz/corpus/") + one.door + "/" + one.file);
    EXPECT_FALSE(bytes.empty());
    std::string line;
    const WithoutTraps off;  // numbers that are none, or too large to square
    EXPECT_NO_THROW(line = doors.at(one.door)(bytes));
    EXPECT_NE(line.find(one.refusal), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace tissue_sim::corpus_test
