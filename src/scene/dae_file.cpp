#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <stdexcept>
#include <vector>

#include "mesh_formats.h"
#include "xml_tags.h"

namespace tissue_sim {
namespace {

/// A scene names no more of its nodes in all: what is drawn many times over is no organ and no tool.
constexpr double most_nodes = 10000;

/// ... nor one through more others: assimp calls itself for each.
constexpr int longest_chain = 1000;

/// Values that a vertex has in one list: positions, normals, several textures.
constexpr std::uint64_t most_offsets = 64;

const std::set<std::string> not_needed = {"library_animations",
                                          "library_controllers",
                                          "library_animation_clips",
                                          "library_cameras",
                                          "library_effects",
                                          "library_images",
                                          "library_lights",
                                          "library_materials",
                                          "library_physics_materials",
                                          "library_physics_models",
                                          "library_physics_scenes",
                                          "library_force_fields",
                                          "extra",
                                          "bind_material"};

/// Kinds of primitives, and how many vertices a list of indices needs at least.
const std::map<std::string, std::uint64_t> primitives = {{"triangles", 0}, {"polylist", 0},   {"polygons", 0},
                                                         {"lines", 0},     {"linestrips", 2}, {"trifans", 3},
                                                         {"tristrips", 3}};

[[noreturn]] void fail(const XmlTag& tag, const std::string& what) {
  throw std::runtime_error(std::to_string(tag.line) + ": <" + tag.name + "> " + what);
}

/// Places of things with a name that others refer to.
template <class Thing>
using Named = std::map<std::string, Thing, std::less<>>;

/// An array of numbers, by its id; what it says of its length.
using Arrays = Named<std::uint64_t>;

/// A node of the scene, with what it holds and what it names.
struct Node {
  XmlTag tag;
  std::vector<int> children;
  std::vector<std::string> instances;  ///< ids or names of other nodes
  double size = -1.0;                  ///< nodes that come of it; 0 while they are counted, -1 before
};

/// Reads a file once, from its first tag to its last.
class DaeCheck {
 public:
  explicit DaeCheck(std::string text) : text_(std::move(text)) {}

  std::string run() {
    XmlTags tags(text_);
    for (XmlTag tag; tags.next(tag);) {
      if (tag.kind == XmlTag::Kind::close) {
        close(tag);
      } else if (not_needed_.name.empty()) {
        if (tag.kind == XmlTag::Kind::open && not_needed.count(tag.name) > 0) {
          not_needed_ = tag;
        } else {
          open(tag);
        }
      }
    }
    if (!tags.fault().empty()) throw std::runtime_error(tags.fault());
    for (std::size_t node = 0; node < nodes_.size(); ++node) size_of(static_cast<int>(node), 0);
    for (const auto& [begin, end] : blanked_) {
      std::replace_if(
          text_.begin() + static_cast<long>(begin), text_.begin() + static_cast<long>(end),
          [](char c) { return c != '\n'; }, ' ');
    }
    return std::move(text_);
  }

 private:
  std::uint64_t number(const XmlTag& tag, const char* name, std::uint64_t otherwise, std::uint64_t most) const {
    const std::string_view value = attribute(text_, tag, name);
    if (value.empty()) return otherwise;
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error != std::errc() || end != value.data() + value.size() || number > most) {
      fail(tag, std::string("has ") + name + " '" + std::string(value.substr(0, 40)) +
                    "', allowed is a whole number up to " + std::to_string(most));
    }
    return number;
  }
  std::uint64_t count(const XmlTag& tag) const { return number(tag, "count", 0, text_.size()); }

  /// What stands between a tag and the next: whole numbers and blanks.
  std::vector<std::uint64_t> numbers_behind(const XmlTag& tag) const {
    std::vector<std::uint64_t> numbers;
    const std::size_t end = std::min(text_.find('<', tag.end), text_.size());
    const char* const last = text_.data() + end;
    for (const char* at = text_.data() + tag.end; at < last;) {
      if (*at == ' ' || *at == '\t' || *at == '\r' || *at == '\n') {
        ++at;
        continue;
      }
      if (*at == '-') ++at;  // some exporters write -1
      std::uint64_t value = 0;
      const auto [next, error] = std::from_chars(at, last, value);
      if (error != std::errc() || next == at || value > 2147483647) fail(tag, "holds what is no index");
      numbers.push_back(value);
      at = next;
    }
    return numbers;
  }

  void open(const XmlTag& tag) {
    const std::string id(attribute(text_, tag, "id"));
    if (tag.name == "instance_controller") {
      fail(tag, "moves the mesh by a skeleton: export it without one");
    } else if (tag.name == "skew") {
      fail(tag, "is not read: apply the transforms of the mesh");
    } else if (tag.name == "float_array" || tag.name == "Name_array" || tag.name == "IDREF_array") {
      if (!arrays_.emplace(id, tag.name == "float_array" ? count(tag) : 0).second) fail(tag, "has the id of another");
    } else if (tag.name == "source") {
      if (!sources_.insert(id).second) fail(tag, "has the id of another");
    } else if (tag.name == "accessor") {
      open_accessor(tag);
    } else if (tag.name == "param") {
      if (++params_ > stride_ || params_ > 4) fail(tag, "is one more than the stride of its accessor, or than four");
      if (attribute(text_, tag, "type") == "float4x4") fail(tag, "is a matrix in a mesh");
    } else if (tag.name == "vertices") {
      in_vertices_ = tag.kind == XmlTag::Kind::open;
      positions_ = false;
    } else if (tag.name == "input") {
      open_input(tag);
    } else if (primitives.count(tag.name) > 0) {
      primitive_ = tag;
      faces_ = count(tag);
      offsets_ = 1;
      corners_ = tag.name == "triangles" ? 3 * faces_ : tag.name == "lines" ? 2 * faces_ : 0;
      has_vertex_ = has_corners_ = false;
    } else if (tag.name == "vcount") {
      for (const std::uint64_t corners : numbers_behind(tag)) corners_ += corners;
      check_room(tag);
      has_corners_ = true;
    } else if (tag.name == "p") {
      open_indices(tag);
    } else if (tag.name == "node") {
      nodes_.push_back({tag, {}, {}, -1.0});
      const int node = static_cast<int>(nodes_.size()) - 1;
      if (!in_nodes_.empty()) nodes_[in_nodes_.back()].children.push_back(node);
      if (tag.kind == XmlTag::Kind::open) in_nodes_.push_back(node);
      by_name_[id].push_back(node);
      const std::string name(attribute(text_, tag, "name"));
      if (name != id) by_name_[name].push_back(node);
    } else if (tag.name == "instance_node" && !in_nodes_.empty()) {
      const std::string_view url = attribute(text_, tag, "url");
      nodes_[in_nodes_.back()].instances.emplace_back(url.substr(std::min<std::size_t>(1, url.size())));
    }
  }

  void close(const XmlTag& tag) {
    if (!not_needed_.name.empty()) {
      if (tag.name != not_needed_.name || tag.depth != not_needed_.depth) return;
      blanked_.emplace_back(not_needed_.begin, tag.end);
      not_needed_ = {};
    } else if (tag.name == "node") {
      in_nodes_.pop_back();
    } else if (tag.name == "vertices") {
      if (!positions_) fail(tag, "has no <input> with the positions");
      in_vertices_ = false;
    }
  }

  void open_accessor(const XmlTag& tag) {
    const std::string_view source = attribute(text_, tag, "source");
    const auto array = arrays_.find(source.substr(std::min<std::size_t>(1, source.size())));
    if (array == arrays_.end()) fail(tag, "names an array that does not stand before it");
    const std::uint64_t size = text_.size();
    stride_ = number(tag, "stride", 1, size);
    params_ = 0;
    const std::uint64_t end = number(tag, "offset", 0, size) + count(tag) * stride_;
    if (stride_ == 0 || end > array->second) {
      fail(tag, "reaches to value " + std::to_string(end) + " of " + std::to_string(array->second));
    }
  }

  void open_input(const XmlTag& tag) {
    const std::string_view semantic = attribute(text_, tag, "semantic");
    if (in_vertices_) {
      positions_ = positions_ || semantic == "POSITION";
      return;
    }
    if (semantic == "POSITION") fail(tag, "with positions stands outside of <vertices>");
    has_vertex_ = has_vertex_ || semantic == "VERTEX";
    offsets_ = std::max(offsets_, number(tag, "offset", 0, most_offsets) + 1);
    check_room(tag);
  }

  /// An index takes a digit and a blank.
  void check_room(const XmlTag& tag) const {
    if (corners_ * offsets_ > text_.size() / 2) {
      fail(tag, "needs " + std::to_string(corners_) + " times " + std::to_string(offsets_) + " indices in a file of " +
                    std::to_string(text_.size()) + " bytes");
    }
  }

  void open_indices(const XmlTag& tag) {
    const auto kind = primitives.find(primitive_.name);
    if (kind == primitives.end() || !has_vertex_) fail(tag, "stands before an <input> with the vertices");
    if (primitive_.name == "polylist" && faces_ > 0 && !has_corners_) fail(tag, "stands before its <vcount>");
    check_room(tag);
    if (numbers_behind(tag).size() < kind->second * offsets_) fail(tag, "has too few indices for a strip or fan");
  }

  /// As many nodes as come of one, with all that it names; refuses one that leads back to itself.
  double size_of(int index, int chain) {
    if (nodes_[index].size == 0.0) fail(nodes_[index].tag, "leads back to itself");
    if (nodes_[index].size > 0.0) return nodes_[index].size;
    if (chain > longest_chain) fail(nodes_[index].tag, "is named by a chain of more than 1000 nodes");
    nodes_[index].size = 0.0;
    double size = 1.0;
    for (const int child : nodes_[index].children) size += size_of(child, chain + 1);
    for (const std::string& name : nodes_[index].instances) {
      const auto named = by_name_.find(name);
      if (named == by_name_.end()) continue;
      for (const int node : named->second) size += size_of(node, chain + 1);
    }
    if (size > most_nodes) fail(nodes_[index].tag, "multiplies to more than 10000 nodes");
    return nodes_[index].size = size;
  }

  std::string text_;
  XmlTag not_needed_;  ///< the element that is being skipped; without a name: none
  std::vector<std::pair<std::size_t, std::size_t>> blanked_;

  Arrays arrays_;
  std::set<std::string, std::less<>> sources_;
  std::uint64_t stride_ = 0, params_ = 0;  ///< of the last accessor
  bool in_vertices_ = false, positions_ = false;

  XmlTag primitive_;                                     ///< the last
  std::uint64_t faces_ = 0, offsets_ = 1, corners_ = 0;  ///< of it
  bool has_vertex_ = false, has_corners_ = false;

  std::vector<Node> nodes_;
  std::vector<int> in_nodes_;  ///< those that are open
  Named<std::vector<int>> by_name_;
};

}  // namespace

std::string plain_dae(std::string text) {
  return DaeCheck(std::move(text)).run();
}

}  // namespace tissue_sim
