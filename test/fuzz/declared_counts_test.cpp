#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "benchmark/counted_heap.h"
#include "entries.h"

namespace tissue_sim::declared_counts_test {
namespace {

constexpr std::size_t allowed = 16'000'000;

struct Claim {
  const char* door;
  const char* file;  ///< in the door's corpus
  Door enter;
};

const Claim claims[] = {
    {"stl", "count_of_2147483648.stl", enter_stl},
    {"stl", "count_of_2147483647.stl", enter_stl},
    {"stl", "count_of_4294967295.stl", enter_stl},
    {"stl", "count_that_wraps.stl", enter_stl},
    {"obj", "index_of_2147483648.obj", enter_obj},
    {"ply", "vertices_2147483648.ply", enter_ply},
    {"ply", "vertices_2147483648_binary.ply", enter_ply},
    {"ply", "vertices_without_properties.ply", enter_ply},
    {"ply", "faces_9000000000000000000.ply", enter_ply},
    {"ply", "list_of_4294967295.ply", enter_ply},
    {"ply", "ascii_list_of_1e18.ply", enter_ply},
    {"dae", "float_array_2147483648.dae", enter_dae},
    {"dae", "triangles_2147483648.dae", enter_dae},
    {"dae", "vcount_of_4294967295.dae", enter_dae},
    {"dae", "offset_2147483647.dae", enter_dae},
    {"dae", "stride_2147483648.dae", enter_dae},
    {"msh", "nodes_2147483648.msh", enter_msh},
    {"msh", "elements_9223372036854775807.msh", enter_msh},
    {"msh", "blocks_2147483648.msh", enter_msh},
    {"bag", "header_length_4294967295.bag", enter_bag},
    {"bag", "index_count_2147483648.bag", enter_bag},
    {"bag", "connections_4294967295.bag", enter_bag},
    {"bag", "chunks_4294967295.bag", enter_bag},
    {"bag", "chunk_size_4294967295.bag", enter_bag},
    {"bag", "lz4_chunk_size_4294967295.bag", enter_bag},
    {"bag", "transforms_4294967295.bag", enter_bag},
    {"bag", "pose_frame_4294967295.bag", enter_bag},
    {"messages", "string_of_4294967295.bin", enter_messages},
    {"messages", "transforms_4294967295.bin", enter_messages},
};

/// Each says that 2^31 things or more follow, and they do not: it is refused before there is room for them.
TEST(DeclaredCounts, AreHeldAgainstTheBytesThatAreThere) {
  for (const Claim& claim : claims) {
    SCOPED_TRACE(std::string(claim.door) + "/" + claim.file);
    const std::string path = std::string(TISSUE_SIM_SOURCE_DIR "/test/fuzz/corpus/") + claim.door + "/" + claim.file;
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    ASSERT_FALSE(bytes.empty());
    ASSERT_LT(bytes.size(), 5000U);
    claim.enter("");  // what a door keeps ready for all files is no part of the claim
    const std::size_t before = live_bytes();
    forget_peak();
    std::string refusal;
    EXPECT_NO_THROW(refusal = claim.enter(bytes));
    EXPECT_FALSE(refusal.empty());
    EXPECT_LT(peak_bytes() - before, allowed) << refusal;
  }
}

}  // namespace
}  // namespace tissue_sim::declared_counts_test
