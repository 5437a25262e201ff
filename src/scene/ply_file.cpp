#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <locale>
#include <map>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "mesh_formats.h"

namespace tissue_sim {
namespace {

enum class Kind { whole, negative_too, real };

struct Type {
  int bytes;
  Kind kind;
};

const std::map<std::string, Type> types{
    {"char", {1, Kind::negative_too}},  {"int8", {1, Kind::negative_too}},  {"uchar", {1, Kind::whole}},
    {"uint8", {1, Kind::whole}},        {"short", {2, Kind::negative_too}}, {"int16", {2, Kind::negative_too}},
    {"ushort", {2, Kind::whole}},       {"uint16", {2, Kind::whole}},       {"int", {4, Kind::negative_too}},
    {"int32", {4, Kind::negative_too}}, {"uint", {4, Kind::whole}},         {"uint32", {4, Kind::whole}},
    {"float", {4, Kind::real}},         {"float32", {4, Kind::real}},       {"double", {8, Kind::real}},
    {"float64", {8, Kind::real}}};

struct Property {
  std::string name;
  Type type;
  bool is_list = false;
  Type count_type;  ///< of a list's length
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

enum class Format { ascii, little_endian, big_endian };

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
  std::size_t end = 0;  ///< of the first byte behind it
};

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what);
}

Type type_of(const std::string& name, const std::string& line) {
  const auto type = types.find(name);
  if (type == types.end()) fail("there is no known type in its header line '" + line.substr(0, 60) + "'");
  return type->second;
}

Header read_header(const std::string& bytes) {
  Header header;
  std::istringstream lines(bytes);
  bool ended = false;
  for (std::string line; !ended && std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word, type, count_type;
    words >> word;
    if (word == "format") {
      words >> type;
      if (type == "binary_little_endian") header.format = Format::little_endian;
      if (type == "binary_big_endian") header.format = Format::big_endian;
    } else if (word == "element") {
      Element element;
      if (!(words >> element.name >> element.count) || element.count < 0) {
        fail("'" + line.substr(0, 60) + "' counts nothing");
      }
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) fail("a property stands before any element");
      Property property = {};
      words >> type;
      property.is_list = type == "list";
      if (property.is_list) {
        words >> count_type >> type;
        property.count_type = type_of(count_type, line);
        if (property.count_type.kind == Kind::real) fail("the length of a list is not a whole number");
      }
      property.type = type_of(type, line);
      words >> property.name;
      header.elements.back().properties.push_back(property);
    }
    ended = word == "end_header" && !lines.eof();
  }
  if (!ended) fail("its header has no line end_header");
  header.end = static_cast<std::size_t>(lines.tellg());
  return header;
}

/// The values behind the header, one after the other.
class Values {
 public:
  Values(const std::string& bytes, const Header& header) : bytes_(bytes), at_(header.end), format_(header.format) {
    if (format_ == Format::ascii) words_.str(bytes.substr(at_));
    word_.imbue(std::locale::classic());
  }

  /// False at the end.
  bool next(const Type& type, double& value) {
    return format_ == Format::ascii ? next_word(value) : next_bytes(type, value);
  }

 private:
  bool next_word(double& value) {
    std::string word;
    if (!(words_ >> word)) return false;
    word_.clear();
    word_.str(word);
    if (word_ >> value && word_.peek() == std::istringstream::traits_type::eof()) return true;
    if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf") {
      value = std::nan("");
      return true;
    }
    fail("'" + word.substr(0, 40) + "' is not a number");
  }

  bool next_bytes(const Type& type, double& value) {
    const auto count = static_cast<std::size_t>(type.bytes);
    if (bytes_.size() - at_ < count) return false;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t place = format_ == Format::big_endian ? i : count - 1 - i;
      bits = bits << 8 | static_cast<unsigned char>(bytes_[at_ + place]);
    }
    at_ += count;
    value = static_cast<double>(bits);
    if (type.kind == Kind::negative_too && bits >> (8 * count - 1) != 0) value -= std::ldexp(1.0, 8 * type.bytes);
    if (type.kind == Kind::real && count == 8) std::memcpy(&value, &bits, sizeof value);
    if (type.kind == Kind::real && count == 4) {
      const auto low = static_cast<std::uint32_t>(bits);
      float number = 0.0F;
      std::memcpy(&number, &low, sizeof number);
      value = number;
    }
    return true;
  }

  const std::string& bytes_;
  std::size_t at_;
  Format format_;
  std::istringstream words_, word_;
};

/// Reads a row of an element, property by property: a number, or a list of some.
template <class Take>
bool read_row(Values& values, const Element& element, Take take) {
  std::vector<double> list;
  for (const Property& property : element.properties) {
    double count = 1.0;
    if (property.is_list && !values.next(property.count_type, count)) return false;
    if (!(count >= 0.0) || count != std::floor(count)) fail("a list has a length that is not a whole number");
    list.clear();
    for (double i = 0.0; i < count; ++i) {
      double value = 0.0;
      if (!values.next(property.type, value)) return false;
      list.push_back(value);
    }
    take(property, list);
  }
  return true;
}

std::string line_of(const std::array<double, 3>& point) {
  std::string line = "v";
  for (const double x : point) {
    char text[32];
    std::snprintf(text, sizeof text, " %.17g", x);
    if (const char* const comma = std::strchr(text, ',')) text[comma - text] = '.';  // of some locales
    line += std::isfinite(x) ? text : " nan";
  }
  return line + "\n";
}

std::string line_of(const std::vector<double>& corners, std::int64_t vertices) {
  if (corners.size() < 3) return "";
  if (corners.size() > most_corners) fail("a face has more than 1000 corners");
  std::string line = "f";
  for (const double corner : corners) {
    if (!(corner >= 0.0 && corner < static_cast<double>(vertices)) || corner != std::floor(corner)) {
      fail("a face names a vertex that is not among the " + std::to_string(vertices));
    }
    line += " " + std::to_string(static_cast<std::int64_t>(corner) + 1);
  }
  return line + "\n";
}

}  // namespace

std::string plain_ply(const std::string& bytes) {
  const Header header = read_header(bytes);
  Values values(bytes, header);
  std::string plain;
  std::int64_t vertices = 0;
  bool faces = false;
  for (const Element& element : header.elements) {
    const bool of_vertices = element.name == "vertex", of_faces = element.name == "face";
    if (element.properties.empty()) fail("element " + element.name + " has no properties");
    if (of_vertices) vertices = element.count;
    for (std::int64_t i = 0; i < element.count; ++i) {
      std::array<double, 3> point{};
      const auto take = [&](const Property& property, const std::vector<double>& list) {
        const std::size_t axis = std::string("xyz").find(property.name);
        if (of_vertices && property.name.size() == 1 && axis < 3 && !property.is_list) point[axis] = list[0];
        if (of_faces && (property.name == "vertex_indices" || property.name == "vertex_index")) {
          const std::string line = line_of(list, vertices);
          faces = faces || !line.empty();
          plain += line;
        }
      };
      if (!read_row(values, element, take)) {
        fail("has not element " + element.name + " " + std::to_string(i) + " of " + std::to_string(element.count));
      }
      if (of_vertices) plain += line_of(point);
    }
  }
  return faces ? plain : "";
}

}  // namespace tissue_sim
