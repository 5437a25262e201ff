#include "tissue_sim/scene/tetrahedral_mesh_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <locale>
#include <random>
#include <set>
#include <sstream>

#include "floating_point_traps.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::tetrahedral_mesh_file_test {
namespace {

const std::string folder = TISSUE_SIM_SOURCE_DIR "/test/malformed/msh/";

struct Case {
  const char* file;  ///< name without .msh
  int line;
  const char* said;  ///< a piece of the error
};

/// Each file is good_22.msh or good_41.msh with one thing wrong.
const Case cases[] = {
    // clang-format off
    {"empty", 1, "$MeshFormat is missing"},
    {"not_gmsh", 1, "'solid cube' stands where $MeshFormat should"},
    {"version_1", 2, "'1' is not a version that can be read, allowed are 2.2 and 4.1"},
    {"version_40", 2, "'4.0' is not a version that can be read"},
    {"binary", 2, "is binary, allowed is 0, ASCII: `gmsh IN.msh -save"},
    {"file_type", 2, "'text' is not a file type, allowed are whole numbers from 0 to 1"},
    {"format_short", 2, "the line ends where a data size should stand"},
    {"format_not_ended", 3, "'$PhysicalNames' stands where $EndMeshFormat should"},
    {"no_format", 1, "$Nodes stands before $MeshFormat"},
    {"no_nodes", 7, "$Nodes is missing"},
    {"no_elements", 15, "$Elements is missing"},
    {"elements_first", 4, "$Elements stands before $Nodes"},
    {"nodes_twice", 23, "$Nodes stands here and in line 8"},
    {"names_not_ended", 4, "$PhysicalNames has no $EndPhysicalNames"},
    {"end_of_nothing", 8, "'$EndComments' ends no section"},
    {"between_sections", 8, "'hello' stands between two sections"},
    {"node_count_huge", 9, "announces 2147483648 nodes, but only 151 bytes follow"},
    {"node_count_overflow", 9, "allowed are whole numbers from 0"},
    {"node_count_negative", 9, "'-5' is not"},
    {"node_count_small", 14, "'12 10 10 10' stands where $EndNodes should"},
    {"node_count_large", 15, "'$EndNodes' stands where node 6 of 6 should"},
    {"node_count_trailing", 9, "'5' stands after the last value of the line"},
    {"node_nan", 12, "'nan' is not a coordinate, allowed are finite numbers"},
    {"node_infinite", 12, "'1e999' is not a coordinate"},
    {"node_hexadecimal", 12, "'0xA' is not a coordinate"},
    {"node_comma", 12, "'10,5' is not a coordinate"},
    {"node_text", 12, "'ten' is not a coordinate"},
    {"node_short", 12, "the line ends where a coordinate should stand"},
    {"node_long", 12, "'0' stands after the last value of the line"},
    {"node_tag_zero", 12, "'0' is not a node's tag, allowed are whole numbers from 1"},
    {"node_tag_half", 12, "'7.5' is not a node's tag"},
    {"node_tag_twice", 14, "node 7 stands here and in line 12"},
    {"cut_in_nodes", 9, "announces 5 nodes, but only 27 bytes follow"},
    {"cut_in_elements", 20, "the file ends before element 4 of 4"},
    {"cut_at_the_end", 21, "the file ends without $EndElements"},
    {"nodes_not_ended", 15, "'$Elements' stands where $EndNodes should"},
    {"element_count_huge", 17, "announces 1000000000 elements, but only 80 bytes follow"},
    {"element_count_small", 21, "'4 4 0 3 7 40 12' stands where $EndElements should"},
    {"element_count_large", 22, "'$EndElements' stands where element 5 of 5 should"},
    {"element_node_missing", 21, "names node 13, which is not among the 5 of $Nodes"},
    {"element_node_text", 21, "'x' is not a node's tag"},
    {"element_short", 21, "the line ends where a node's tag should stand"},
    {"element_long", 21, "'10' stands after the last value of the line"},
    {"element_corner_twice", 21, "names node 3 twice"},
    {"element_groups", 21, "'-1' is not a number of an element's groups"},
    {"second_order", 21, "type 11 is a second-order tetrahedron, allowed are first-order tetrahedra (type 4): mesh the solid with `gmsh -3 -order 1`"},
    {"hexahedron", 21, "type 5 is a hexahedron, allowed are first-order tetrahedra"},
    {"type_unknown", 21, "type 77 is not known"},
    {"triangle_long", 19, "'40' stands after the last value of the line"},
    {"only_a_surface", 16, "holds no tetrahedra (2 other elements), mesh its volume"},
    {"flat", 21, "1 tetrahedron is flat, the first of them here"},
    {"duplicate", 16, "1 tetrahedron stands twice"},
    {"overlap", 16, "overlap at 1 face"},
    {"touching_edge", 17, "touches itself in 1 edge and 0 vertices"},
    {"block_nodes_huge", 15, "announces 2000000000 nodes, but only 121 bytes follow"},
    {"block_nodes_more", 15, "announces 4 nodes, but of all 5 only 3 are left"},
    {"block_nodes_less", 21, "the blocks hold 5 of the 6 nodes announced"},
    {"blocks_huge", 9, "announces 99999999 blocks, but only 172 bytes follow"},
    {"blocks_less", 14, "the blocks hold 2 of the 5 nodes announced"},
    {"block_parametric", 13, "the line ends where a coordinate on the entity should stand"},
    {"block_dimension", 15, "'4' is not an entity's dimension, allowed are whole numbers from 0 to 3"},
    {"block_tag_twice", 17, "node 10 stands here and in line 11"},
    {"block_point_missing", 21, "'$EndNodes' stands where the point of node 5 of 5 should"},
    {"block_elements_huge", 27, "announces 2000000000 elements, but only 37 bytes follow"},
    {"block_elements_more", 27, "announces 3 elements, but of all 3 only 2 are left"},
    {"block_elements_less", 29, "the blocks hold 3 of the 4 elements announced"},
    {"block_hexahedra", 27, "type 5 is a hexahedron"},
    {"block_not_a_type", 27, "'tetrahedra' is not an element's type"}
    // clang-format on
};

/// The error's line, or a failure of the test.
std::string error_of(const std::string& path, double scale = 0.001) {
  std::vector<std::string> warnings;
  try {
    read_tetrahedral_mesh(path, scale, warnings);
  } catch (const SceneError& error) {
    return error.what();
  }
  ADD_FAILURE() << path << " was read";
  return "";
}

TetrahedralMesh read(const std::string& path, double scale = 1.0) {
  std::vector<std::string> warnings;
  TetrahedralMesh mesh = read_tetrahedral_mesh(path, scale, warnings);
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  return mesh;
}

class MalformedMsh : public testing::TestWithParam<Case> {};

TEST_P(MalformedMsh, IsRefusedWithItsLine) {
  const std::string path = folder + GetParam().file + ".msh";
  const WithoutTraps off;  // of 1e999 the C library says that it overflows
  const std::string what = error_of(path);
  const std::string start = path + ":" + std::to_string(GetParam().line) + ": ";
  ASSERT_EQ(what.substr(0, start.size()), start) << what;
  EXPECT_NE(what.find(GetParam().said), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
}

INSTANTIATE_TEST_SUITE_P(Files, MalformedMsh, testing::ValuesIn(cases),
                         [](const testing::TestParamInfo<Case>& tested) { return std::string(tested.param.file); });

TEST(MalformedMshFiles, AreAllTested) {
  std::set<std::string> files, tested = {"good_22", "good_41"};
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.insert(entry.path().stem().string());
  for (const Case& one : cases) tested.insert(one.file);
  EXPECT_EQ(files, tested);
}

TEST(TetrahedralMeshFile, ReadsBothVersionsAlike) {
  const TetrahedralMesh mesh = read(folder + "good_22.msh", 0.001);
  const std::vector<Vector3> expected = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}, {0.01, 0.01, 0.01}};
  ASSERT_EQ(mesh.vertices.size(), 5u);
  for (std::size_t v = 0; v < 5; ++v) EXPECT_TRUE(mesh.vertices[v].isApprox(expected[v], 1e-15)) << v;
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
  const TetrahedralMesh other = read(folder + "good_41.msh", 0.001);
  EXPECT_EQ(other.vertices, mesh.vertices);
  EXPECT_EQ(other.tetrahedra, mesh.tetrahedra);
}

TEST(TetrahedralMeshFile, IsToldByItsEnding) {
  EXPECT_TRUE(is_tetrahedral_mesh("a/liver.msh"));
  EXPECT_TRUE(is_tetrahedral_mesh("LIVER.MSH"));
  EXPECT_FALSE(is_tetrahedral_mesh("liver.msh.obj"));
  EXPECT_FALSE(is_tetrahedral_mesh("msh"));
}

TEST(TetrahedralMeshFile, NamesWhatIsNotAFile) {
  const TemporaryFolder temporary;
  EXPECT_NE(error_of((temporary.path / "gone.msh").string()).find("gone.msh:1: there is no such file"),
            std::string::npos);
  EXPECT_NE(error_of(temporary.path.string()).find(":1: is not a file"), std::string::npos);
}

std::string text_22(const std::string& nodes, const std::string& elements) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + nodes + "$EndNodes\n$Elements\n" + elements +
         "$EndElements\n";
}

TEST(TetrahedralMeshFile, TakesLineEndsBlanksAndSectionsAsTheyCome) {
  const TemporaryFolder temporary;
  const std::string text =
      "$Comments\n$Nodes is what I say\n$EndComments\r\n"
      "$MeshFormat\r\n2.2 0 8\r\n$EndMeshFormat\r\n\r\n$Nodes\r\n 4 \r\n1 0 0 0\r\n2\t1 0 0  \r\n\n3 0 +1.0e0 0\r\n"
      "9000000000000000000 0 0 .1E+1\r\n$EndNodes\r\n$Elements\r\n1\r\n1 4 3 0 1 2 1 2 3 9000000000000000000\r\n"
      "$EndElements\r\n$NodeData\r\n1\r\n\"A view\"\r\n$EndNodeData";
  const TetrahedralMesh mesh = read(temporary.write("a.msh", text));
  EXPECT_EQ(mesh.vertices, (std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  EXPECT_EQ(mesh.tetrahedra, (std::vector<Tetrahedron>{{0, 1, 2, 3}}));
}

TEST(TetrahedralMeshFile, WarnsOfWhatItMends) {
  const TemporaryFolder temporary;
  const std::string path = temporary.write(
      "a.msh", text_22("11\n1 9 9 9\n2 0 0 0\n3 1 0 0\n4 0 1 0\n5 0 0 1\n6 8 8 8\n7 5 0 0\n8 6 0 0\n9 5 1 0\n"
                       "10 5 0 1\n11 7 7 7\n",
                       "2\n1 4 0 2 3 4 5\n2 4 0 7 9 8 10\n"));
  std::vector<std::string> warnings;
  const TetrahedralMesh mesh = read_tetrahedral_mesh(path, 1.0, warnings);
  EXPECT_EQ(warnings, (std::vector<std::string>{path + ": dropped 3 nodes that no tetrahedron names",
                                                path + ": turned 1 inverted tetrahedron",
                                                path + ": consists of 2 solids that share no vertex"}));
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_DOUBLE_EQ(solid_volume(mesh), 2.0 / 6.0);
  EXPECT_TRUE(inspect(mesh).sound());
}

TEST(TetrahedralMeshFile, RefusesAScaleThatLosesTheSolid) {
  const WithoutTraps off;  // it overflows
  EXPECT_NE(error_of(folder + "good_22.msh", 1e308).find("good_22.msh:11: node 3 is not finite once scaled"),
            std::string::npos);
  EXPECT_NE(error_of(folder + "good_22.msh", 0.0).find("good_22.msh:20: 2 tetrahedra are flat"), std::string::npos);
}

TEST(TetrahedralMeshFile, ShortensAndCleansWhatItQuotes) {
  const TemporaryFolder temporary;
  const std::string what = error_of(temporary.write("a.msh", std::string(1000, 'x') + "\n"));
  EXPECT_LT(what.size(), temporary.path.string().size() + 150);
  EXPECT_NE(error_of(temporary.write("b.msh", "\x1b[31m\n")).find("'?[31m'"), std::string::npos);
}

/// A decimal comma, as in many countries.
struct Comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(TetrahedralMeshFile, ReadsAlikeInEveryLocale) {
  const TemporaryFolder temporary;
  const std::string path =
      temporary.write("a.msh", text_22("4\n1 0 0 0\n2 1.25 0 0\n3 0 1000.5 0\n4 0 0 1e-3\n", "1\n1 4 0 1 2 3 4\n"));
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
  std::vector<std::string> warnings;
  TetrahedralMesh mesh;
  EXPECT_NO_THROW(mesh = read_tetrahedral_mesh(path, 1.0, warnings));
  std::locale::global(before);
  EXPECT_EQ(mesh.vertices, (std::vector<Vector3>{{0, 0, 0}, {1.25, 0, 0}, {0, 1000.5, 0}, {0, 0, 1e-3}}));
}

/// Version 2.2 or 4.1 with every node's and element's tag `stride` apart and 17 digits.
std::string text_of(const TetrahedralMesh& mesh, bool version_41, int stride) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(17);
  const std::size_t nodes = mesh.vertices.size(), elements = mesh.tetrahedra.size();
  const auto tag = [&](std::size_t v) { return 1 + v * static_cast<std::size_t>(stride); };
  text << "$MeshFormat\n" << (version_41 ? "4.1" : "2.2") << " 0 8\n$EndMeshFormat\n$Nodes\n";
  if (version_41) {
    text << "1 " << nodes << " 1 " << tag(nodes - 1) << "\n3 1 0 " << nodes << "\n";
    for (std::size_t v = 0; v < nodes; ++v) text << tag(v) << "\n";
    for (const Vector3& p : mesh.vertices) text << p.x() << " " << p.y() << " " << p.z() << "\n";
    text << "$EndNodes\n$Elements\n1 " << elements << " 1 " << elements << "\n3 1 4 " << elements << "\n";
  } else {
    text << nodes << "\n";
    for (std::size_t v = 0; v < nodes; ++v) {
      const Vector3& p = mesh.vertices[v];
      text << tag(v) << " " << p.x() << " " << p.y() << " " << p.z() << "\n";
    }
    text << "$EndNodes\n$Elements\n" << elements << "\n";
  }
  for (std::size_t t = 0; t < elements; ++t) {
    text << t + 1 << (version_41 ? "" : " 4 0");
    for (const int v : mesh.tetrahedra[t]) text << " " << tag(static_cast<std::size_t>(v));
    text << "\n";
  }
  text << "$EndElements\n";
  return text.str();
}

TEST(TetrahedralMeshFile, GivesBackWhatWasWritten) {
  const TemporaryFolder temporary;
  TetrahedralMesh mesh = make_block({0.03, 0.05, 0.07}, {3, 5, 7});
  std::mt19937 random(5);
  std::shuffle(mesh.tetrahedra.begin(), mesh.tetrahedra.end(), random);
  for (const bool version_41 : {false, true}) {
    for (const int stride : {1, 1000}) {
      const TetrahedralMesh back = read(temporary.write("a.msh", text_of(mesh, version_41, stride)));
      EXPECT_EQ(back.vertices, mesh.vertices);
      EXPECT_EQ(back.tetrahedra, mesh.tetrahedra);
    }
  }
}

TEST(TetrahedralMeshFile, EveryCutAndEveryChangedByteIsReadOrRefusedInOneLine) {
  const TemporaryFolder temporary;
  std::mt19937 random(9);
  for (const bool version_41 : {false, true}) {
    const std::string good = text_of(make_block({1, 1, 1}, {1, 1, 1}), version_41, 3);
    const auto expect_one_line = [&](const std::string& text) {
      std::vector<std::string> warnings;
      const std::string path = temporary.write("a.msh", text);
      try {
        EXPECT_TRUE(inspect(read_tetrahedral_mesh(path, 1.0, warnings)).sound());
      } catch (const SceneError& error) {
        const std::string what = error.what();
        EXPECT_EQ(what.find('\n'), std::string::npos);
        EXPECT_GT(std::atoi(what.substr(path.size() + 1).c_str()), 0) << what;
      }
    };
    for (std::size_t length = 0; length + 1 < good.size(); length += 5) {
      EXPECT_NE(error_of(temporary.write("a.msh", good.substr(0, length))), "");
    }
    for (int round = 0; round < 300; ++round) {
      std::string bad = good;
      for (int changes = 0; changes <= round % 3; ++changes)
        bad[random() % bad.size()] = "0123456789 -.$\nx\0"[random() % 17];
      expect_one_line(bad);
    }
  }
}

}  // namespace
}  // namespace tissue_sim::tetrahedral_mesh_file_test
