#include "tissue_sim/scene/tetrahedral_mesh_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <locale>
#include <sstream>
#include <string_view>

#include "one_line.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {
namespace {

/// A larger file is refused: up to here lines, nodes and faces can be counted in an int. 40 million tetrahedra.
constexpr std::uintmax_t most_bytes = 2147483647;

/// What a line of a node or an element takes at least: "1 0 0 0\n", "1 15 0 1\n", and in version 4.1 "1\n" and
/// "0 0 0\n" of a node, "1 1\n" of an element, "0 1 0 0\n" of a block.
constexpr int bytes_of_node = 8;
constexpr int bytes_of_element = 9;
constexpr int bytes_of_element_41 = 4;
constexpr int bytes_of_block = 8;

constexpr std::int64_t largest = std::numeric_limits<std::int64_t>::max();

/// Element types by Gmsh's numbers.
struct ElementType {
  int type;
  int dimension;
  int nodes;
  const char* name;
};

constexpr int tetrahedron_type = 4;
constexpr ElementType element_types[] = {
    {1, 1, 2, "line"},
    {2, 2, 3, "triangle"},
    {3, 2, 4, "quadrangle"},
    {tetrahedron_type, 3, 4, "tetrahedron"},
    {5, 3, 8, "hexahedron"},
    {6, 3, 6, "prism"},
    {7, 3, 5, "pyramid"},
    {8, 1, 3, "second-order line"},
    {9, 2, 6, "second-order triangle"},
    {10, 2, 9, "second-order quadrangle"},
    {11, 3, 10, "second-order tetrahedron"},
    {12, 3, 27, "second-order hexahedron"},
    {13, 3, 18, "second-order prism"},
    {14, 3, 14, "second-order pyramid"},
    {15, 0, 1, "point"},
    {16, 2, 8, "second-order quadrangle"},
    {17, 3, 20, "second-order hexahedron"},
    {18, 3, 15, "second-order prism"},
    {19, 3, 13, "second-order pyramid"},
    {20, 2, 9, "third-order triangle"},
    {21, 2, 10, "third-order triangle"},
    {26, 1, 4, "third-order line"},
    {29, 3, 20, "third-order tetrahedron"},
    {30, 3, 35, "fourth-order tetrahedron"},
    {31, 3, 56, "fifth-order tetrahedron"},
};

std::string quoted(std::string_view text) {
  std::string result = "'" + std::string(text.substr(0, 40)) + (text.size() > 40 ? "..." : "") + "'";
  std::replace_if(
      result.begin(), result.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  return result;
}

/// "1 tetrahedron", "2 tetrahedra".
std::string counted(int n, const char* singular, const char* plural) {
  return std::to_string(n) + " " + (n == 1 ? singular : plural);
}

/// The file, read line by line and each line value by value.
class MshReader {
 public:
  MshReader(const std::string& path, const std::string& text) : path_(path), text_(text) {
    stream_.imbue(std::locale::classic());
  }

  int line_number() const { return line_number_; }
  std::string_view line() const { return line_; }

  [[noreturn]] void fail(const std::string& problem, int line) const {
    throw SceneError(path_ + ":" + std::to_string(line) + ": " + one_line(problem));
  }
  [[noreturn]] void fail(const std::string& problem) const { fail(problem, std::max(line_number_, 1)); }

  /// The next line that is not blank; false at the end of the file.
  bool next_line() {
    while (next_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', next_), text_.size());
      line_ = std::string_view(text_).substr(next_, end - next_);
      next_ = end + 1;
      ++line_number_;
      while (!line_.empty() && is_blank(line_.back())) line_.remove_suffix(1);
      skip_blanks();
      if (!line_.empty()) return true;
    }
    return false;
  }

  /// Goes to the line of `what` number `index` of `count`.
  void to_data(const char* what, std::int64_t index, std::int64_t count) {
    const bool there = next_line();
    if (there && line_.front() != '$') return;
    const std::string missing = std::string(what) + " " + std::to_string(index + 1) + " of " + std::to_string(count);
    if (!there) fail("the file ends before " + missing + ", it is cut short: write it again");
    fail(quoted(line_) + " stands where " + missing + " should, write the file again");
  }

  /// The line that closes a section of `counted`.
  void to_end(const std::string& section, const char* contents) {
    const std::string end = "$End" + section;
    if (!next_line()) fail("the file ends without " + end + ", it is cut short: write it again");
    if (line_ != end) {
      fail(quoted(line_) + " stands where " + end + " should, after as many " + contents + " as $" + section +
           " announces: write the file again");
    }
  }

  std::int64_t whole(const char* what, std::int64_t low, std::int64_t high) {
    const std::string_view word = next_word(what);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value < low || value > high) {
      const std::string range = high == largest ? "from " + std::to_string(low)
                                                : "from " + std::to_string(low) + " to " + std::to_string(high);
      fail(quoted(word) + " is not " + what + ", allowed are whole numbers " + range);
    }
    return value;
  }

  /// How many things of at least `bytes` each follow: not more than fit into what is left of the file, so that nothing
  /// is allocated for a count that is a lie.
  std::int64_t count(const char* what, int bytes) {
    const std::int64_t value = whole("a number of items", 0, largest);
    const std::int64_t left = static_cast<std::int64_t>(text_.size() - std::min(next_, text_.size())) + 1;
    if (value > left / bytes) {
      fail("announces " + std::to_string(value) + " " + what + ", but only " + std::to_string(left - 1) +
           " bytes follow, it is cut short or damaged: write the file again");
    }
    return value;
  }

  double number(const char* what) {
    const std::string_view word = next_word(what);
    double value = 0.0;
    stream_.clear();
    stream_.str(std::string(word));
    if (!(stream_ >> value) || stream_.peek() != std::istringstream::traits_type::eof() || !std::isfinite(value)) {
      fail(quoted(word) + " is not " + what + ", allowed are finite numbers");
    }
    return value;
  }

  std::string_view next_word(const char* what) {
    if (line_.empty()) fail(std::string("the line ends where ") + what + " should stand, write the file again");
    std::size_t length = 0;
    while (length < line_.size() && !is_blank(line_[length])) ++length;
    const std::string_view word = line_.substr(0, length);
    line_.remove_prefix(length);
    skip_blanks();
    return word;
  }

  void end_line() const {
    if (!line_.empty()) fail(quoted(line_) + " stands after the last value of the line, delete it");
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

  void skip_blanks() {
    while (!line_.empty() && is_blank(line_.front())) line_.remove_prefix(1);
  }

  const std::string& path_;
  const std::string& text_;
  std::size_t next_ = 0;
  int line_number_ = 0;
  std::string_view line_;  ///< what is left of the current line
  std::istringstream stream_;
};

struct NodeTag {
  std::int64_t tag;
  int node;
  int line;
};

struct Nodes {
  std::vector<Vector3> points;
  std::vector<NodeTag> tags;  ///< ascending once the section is read
};

struct Elements {
  std::vector<Tetrahedron> tetrahedra;
  std::vector<int> lines;  ///< of each tetrahedron
  std::int64_t skipped = 0;
};

bool is_version_41(MshReader& reader) {
  reader.to_data("line", 0, 1);
  const std::string_view version = reader.next_word("a version");
  if (version != "2.2" && version != "4.1") {
    reader.fail(quoted(version) +
                " is not a version that can be read, allowed are 2.2 and 4.1: `gmsh IN.msh -save "
                "-format msh41 -o OUT.msh`");
  }
  if (reader.whole("a file type", 0, 1) == 1) {
    reader.fail("file type 1 is binary, allowed is 0, ASCII: `gmsh IN.msh -save -format msh41 -o OUT.msh`");
  }
  reader.whole("a data size", 1, 16);
  reader.end_line();
  reader.to_end("MeshFormat", "lines");
  return version == "4.1";
}

Vector3 read_point(MshReader& reader) {
  const double x = reader.number("a coordinate");
  const double y = reader.number("a coordinate");
  return {x, y, reader.number("a coordinate")};
}

Nodes read_nodes_22(MshReader& reader) {
  Nodes nodes;
  reader.to_data("count", 0, 1);
  const std::int64_t count = reader.count("nodes", bytes_of_node);
  reader.end_line();
  nodes.points.reserve(static_cast<std::size_t>(count));
  nodes.tags.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    reader.to_data("node", i, count);
    nodes.tags.push_back({reader.whole("a node's tag", 1, largest), static_cast<int>(i), reader.line_number()});
    nodes.points.push_back(read_point(reader));
    reader.end_line();
  }
  return nodes;
}

Nodes read_nodes_41(MshReader& reader) {
  Nodes nodes;
  reader.to_data("line of counts", 0, 1);
  const std::int64_t blocks = reader.count("blocks", bytes_of_block);
  const std::int64_t count = reader.count("nodes", bytes_of_node);
  reader.whole("the lowest tag", 0, largest);
  reader.whole("the highest tag", 0, largest);
  reader.end_line();
  nodes.points.reserve(static_cast<std::size_t>(count));
  nodes.tags.reserve(static_cast<std::size_t>(count));
  std::int64_t read = 0;
  for (std::int64_t block = 0; block < blocks; ++block) {
    reader.to_data("block", block, blocks);
    const std::int64_t dimension = reader.whole("an entity's dimension", 0, 3);
    reader.whole("an entity's tag", -largest, largest);
    const bool parametric = reader.whole("0 or 1, for coordinates on the entity,", 0, 1) == 1;
    const std::int64_t in_block = reader.count("nodes", bytes_of_node);
    reader.end_line();
    if (in_block > count - read) {
      reader.fail("announces " + std::to_string(in_block) + " nodes, but of all " + std::to_string(count) + " only " +
                  std::to_string(count - read) + " are left, write the file again");
    }
    for (std::int64_t i = 0; i < in_block; ++i) {
      reader.to_data("node", read + i, count);
      const std::int64_t tag = reader.whole("a node's tag", 1, largest);
      reader.end_line();
      nodes.tags.push_back({tag, static_cast<int>(read + i), reader.line_number()});
    }
    for (std::int64_t i = 0; i < in_block; ++i) {
      reader.to_data("the point of node", read + i, count);
      nodes.points.push_back(read_point(reader));
      for (std::int64_t axis = 0; parametric && axis < dimension; ++axis) reader.number("a coordinate on the entity");
      reader.end_line();
    }
    read += in_block;
  }
  if (read < count) {
    reader.fail("the blocks hold " + std::to_string(read) + " of the " + std::to_string(count) +
                " nodes announced, write the file again");
  }
  return nodes;
}

void sort_tags(const MshReader& reader, Nodes& nodes) {
  std::sort(nodes.tags.begin(), nodes.tags.end(),
            [](const NodeTag& a, const NodeTag& b) { return a.tag != b.tag ? a.tag < b.tag : a.node < b.node; });
  const auto twice = std::adjacent_find(nodes.tags.begin(), nodes.tags.end(),
                                        [](const NodeTag& a, const NodeTag& b) { return a.tag == b.tag; });
  if (twice == nodes.tags.end()) return;
  reader.fail("node " + std::to_string(twice->tag) + " stands here and in line " + std::to_string(twice->line) +
                  ", give each node a tag of its own",
              twice[1].line);
}

int node_of(const MshReader& reader, const Nodes& nodes, std::int64_t tag) {
  const auto& tags = nodes.tags;
  // Most files number their nodes without gaps.
  if (!tags.empty() && tag >= tags.front().tag && tag - tags.front().tag < static_cast<std::int64_t>(tags.size())) {
    const NodeTag& guess = tags[static_cast<std::size_t>(tag - tags.front().tag)];
    if (guess.tag == tag) return guess.node;
  }
  const auto at =
      std::lower_bound(tags.begin(), tags.end(), tag, [](const NodeTag& a, std::int64_t b) { return a.tag < b; });
  if (at == tags.end() || at->tag != tag) {
    reader.fail("names node " + std::to_string(tag) + ", which is not among the " + std::to_string(tags.size()) +
                " of $Nodes, write the file again");
  }
  return at->node;
}

/// Reads an element type and refuses those that cannot be used.
const ElementType& read_type(MshReader& reader) {
  const std::int64_t type = reader.whole("an element's type", 1, 1000);
  const auto* const known = std::find_if(std::begin(element_types), std::end(element_types),
                                         [&](const ElementType& e) { return e.type == type; });
  if (known == std::end(element_types)) {
    reader.fail("element type " + std::to_string(type) +
                " is not known, allowed are first-order tetrahedra (type 4): mesh the solid with `gmsh -3 -order 1`");
  }
  if (known->dimension == 3 && known->type != tetrahedron_type) {
    const std::string cure = std::string_view(known->name).find("tetrahedron") != std::string_view::npos
                                 ? "mesh the solid with `gmsh -3 -order 1`"
                                 : "mesh the solid with `gmsh -3 -order 1`, nothing recombined or extruded in layers";
    reader.fail("element type " + std::to_string(type) + " is a " + known->name +
                ", allowed are first-order tetrahedra (type 4): " + cure);
  }
  return *known;
}

/// The rest of an element's line: its nodes.
void read_corners(MshReader& reader, const ElementType& type, const Nodes& nodes, Elements& elements) {
  if (type.type != tetrahedron_type) {
    for (int i = 0; i < type.nodes; ++i) reader.whole("a node's tag", 1, largest);
    reader.end_line();
    ++elements.skipped;
    return;
  }
  Tetrahedron corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::int64_t tag = reader.whole("a node's tag", 1, largest);
    corners[i] = node_of(reader, nodes, tag);
    if (std::find(corners.begin(), corners.begin() + i, corners[i]) != corners.begin() + i) {
      reader.fail("a tetrahedron names node " + std::to_string(tag) + " twice, mesh the solid again");
    }
  }
  reader.end_line();
  elements.tetrahedra.push_back(corners);
  elements.lines.push_back(reader.line_number());
}

Elements read_elements_22(MshReader& reader, const Nodes& nodes) {
  Elements elements;
  reader.to_data("count", 0, 1);
  const std::int64_t count = reader.count("elements", bytes_of_element);
  reader.end_line();
  for (std::int64_t i = 0; i < count; ++i) {
    reader.to_data("element", i, count);
    reader.whole("an element's tag", 1, largest);
    const ElementType& type = read_type(reader);
    const std::int64_t labels = reader.whole("a number of an element's groups", 0, 1000000);
    for (std::int64_t label = 0; label < labels; ++label) reader.whole("a group", -largest, largest);
    read_corners(reader, type, nodes, elements);
  }
  return elements;
}

Elements read_elements_41(MshReader& reader, const Nodes& nodes) {
  Elements elements;
  reader.to_data("line of counts", 0, 1);
  const std::int64_t blocks = reader.count("blocks", bytes_of_block);
  const std::int64_t count = reader.count("elements", bytes_of_element_41);
  reader.whole("the lowest tag", 0, largest);
  reader.whole("the highest tag", 0, largest);
  reader.end_line();
  std::int64_t read = 0;
  for (std::int64_t block = 0; block < blocks; ++block) {
    reader.to_data("block", block, blocks);
    reader.whole("an entity's dimension", 0, 3);
    reader.whole("an entity's tag", -largest, largest);
    const ElementType& type = read_type(reader);
    const std::int64_t in_block = reader.count("elements", bytes_of_element_41);
    reader.end_line();
    if (in_block > count - read) {
      reader.fail("announces " + std::to_string(in_block) + " elements, but of all " + std::to_string(count) +
                  " only " + std::to_string(count - read) + " are left, write the file again");
    }
    for (std::int64_t i = 0; i < in_block; ++i) {
      reader.to_data("element", read + i, count);
      reader.whole("an element's tag", 1, largest);
      read_corners(reader, type, nodes, elements);
    }
    read += in_block;
  }
  if (read < count) {
    reader.fail("the blocks hold " + std::to_string(read) + " of the " + std::to_string(count) +
                " elements announced, write the file again");
  }
  return elements;
}

void skip_section(MshReader& reader, const std::string& name) {
  const int first = reader.line_number();
  const std::string end = "$End" + name;
  while (reader.next_line()) {
    if (reader.line() == end) return;
  }
  reader.fail("$" + name + " has no " + end + ", the file is cut short: write it again", first);
}

std::string read_text(const std::string& path) {
  std::error_code error;
  const auto fail = [&](const std::string& problem) { throw SceneError(path + ":1: " + problem); };
  if (!std::filesystem::exists(path, error)) fail("there is no such file, check the path");
  if (!std::filesystem::is_regular_file(path, error)) fail("is not a file, name a .msh file");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > most_bytes) {
    fail("is " + std::to_string(size) + " bytes large, allowed are " + std::to_string(most_bytes) +
         ": mesh the solid with longer edges");
  }
  std::ifstream file(path, std::ios::binary);
  std::string text(error ? 0 : static_cast<std::size_t>(size), '\0');
  if (error || !file.read(text.data(), static_cast<std::streamsize>(size))) fail("cannot be read, check its rights");
  return text;
}

/// Scales and mends the solid; `line` is that of $Elements.
TetrahedralMesh make_solid(const MshReader& reader, const std::string& path, Nodes nodes, Elements elements, int line,
                           double scale, std::vector<std::string>& warnings) {
  const auto warn = [&](int n, const std::string& what) {
    if (n > 0) warnings.push_back(path + ": " + what);
  };
  for (const NodeTag& tag : nodes.tags) {
    Vector3& p = nodes.points[tag.node];
    p *= scale;
    if (!p.allFinite())
      reader.fail("node " + std::to_string(tag.tag) + " is not finite once scaled, is the scale right?", tag.line);
  }
  TetrahedralMesh mesh = {std::move(nodes.points), std::move(elements.tetrahedra)};
  int flat = 0;
  int first_flat = 0;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const auto& [a, b, c, d] = mesh.tetrahedra[t];
    if (!is_flat(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c], mesh.vertices[d])) continue;
    if (flat++ == 0) first_flat = elements.lines[t];
  }
  if (flat > 0) {
    reader.fail(counted(flat, "tetrahedron is", "tetrahedra are") +
                    " flat, the first of them here: mesh the solid again, with another edge "
                    "length or `gmsh -optimize_netgen`",
                first_flat);
  }
  const int dropped = drop_unreferenced(mesh);
  warn(dropped, "dropped " + counted(dropped, "node that no tetrahedron names", "nodes that no tetrahedron names"));
  const int turned = orient(mesh);
  warn(turned, "turned " + counted(turned, "inverted tetrahedron", "inverted tetrahedra"));
  const TetrahedralFaults faults = inspect(mesh);
  if (faults.duplicates > 0) {
    reader.fail(counted(faults.duplicates, "tetrahedron stands", "tetrahedra stand") +
                    " twice: give each volume one physical group at most, or none",
                line);
  }
  if (faults.crowded_faces + faults.overlapping_faces > 0) {
    reader.fail("its tetrahedra overlap at " +
                    counted(faults.crowded_faces + faults.overlapping_faces, "face", "faces") +
                    ": do not mesh a volume twice",
                line);
  }
  if (faults.non_manifold_surface_edges + faults.non_manifold_surface_vertices > 0) {
    reader.fail("its surface touches itself in " + counted(faults.non_manifold_surface_edges, "edge", "edges") +
                    " and " + counted(faults.non_manifold_surface_vertices, "vertex", "vertices") +
                    ": mesh the solid with another edge length",
                line);
  }
  if (!faults.sound()) reader.fail("is not a sound solid, mesh it again", line);
  warn(faults.components - 1, "consists of " + std::to_string(faults.components) + " solids that share no vertex");
  return mesh;
}

}  // namespace

bool is_tetrahedral_mesh(const std::string& path) {
  std::string ending = path.size() < 4 ? "" : path.substr(path.size() - 4);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".msh";
}

TetrahedralMesh read_tetrahedral_mesh(const std::string& path, double scale, std::vector<std::string>& warnings) {
  const std::string text = read_text(path);
  MshReader reader(path, text);
  Nodes nodes;
  Elements elements;
  int format_line = 0, nodes_line = 0, elements_line = 0;
  bool version_41 = false;
  while (reader.next_line()) {
    if (reader.line().front() != '$') {
      reader.fail(quoted(reader.line()) + (format_line == 0 ? " stands where $MeshFormat should, is this a Gmsh file?"
                                                            : " stands between two sections, delete it"));
    }
    const std::string name(reader.line().substr(1));
    const auto begin = [&](int& line) {
      if (line > 0) reader.fail("$" + name + " stands here and in line " + std::to_string(line) + ", delete one");
      if (&line != &format_line && format_line == 0) {
        reader.fail("$" + name + " stands before $MeshFormat, write the file again");
      }
      line = reader.line_number();
    };
    if (name == "MeshFormat") {
      begin(format_line);
      version_41 = is_version_41(reader);
    } else if (name == "Nodes") {
      begin(nodes_line);
      nodes = version_41 ? read_nodes_41(reader) : read_nodes_22(reader);
      reader.to_end(name, "nodes");
      sort_tags(reader, nodes);
    } else if (name == "Elements") {
      begin(elements_line);
      if (nodes_line == 0) reader.fail("$Elements stands before $Nodes, write the file again");
      elements = version_41 ? read_elements_41(reader, nodes) : read_elements_22(reader, nodes);
      reader.to_end(name, "elements");
    } else if (name.compare(0, 3, "End") == 0) {
      reader.fail(quoted(reader.line()) + " ends no section, delete it");
    } else {
      skip_section(reader, name);
    }
  }
  if (format_line == 0) reader.fail("$MeshFormat is missing, is this a Gmsh file?");
  if (nodes_line == 0) reader.fail("$Nodes is missing, the file is cut short: write it again");
  if (elements_line == 0) reader.fail("$Elements is missing, the file is cut short: write it again");
  if (elements.tetrahedra.empty()) {
    reader.fail("holds no tetrahedra (" + std::to_string(elements.skipped) +
                    " other elements), mesh its volume: `gmsh -3`, or scripts/make_solid for a surface",
                elements_line);
  }
  return make_solid(reader, path, std::move(nodes), std::move(elements), elements_line, scale, warnings);
}

}  // namespace tissue_sim
