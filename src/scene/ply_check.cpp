#include "ply_check.h"

#include <cstdint>
#include <fstream>
#include <locale>
#include <map>
#include <sstream>
#include <vector>

namespace tissue_sim {
namespace {

const std::map<std::string, int> bytes_of{{"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},
                                          {"short", 2}, {"ushort", 2},  {"int16", 2},  {"uint16", 2},
                                          {"int", 4},   {"uint", 4},    {"int32", 4},  {"uint32", 4},
                                          {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};

struct Property {
  int count_bytes = 0;  ///< of a list's length; 0 for a single value
  int value_bytes = 0;
};

struct Element {
  std::string name;
  long long count = 0;
  std::vector<Property> properties;
};

enum class Format { ascii, little_endian, big_endian };

/// Reads the next value and returns it where it is a whole number, which lengths of lists are. False at the end.
bool next_value(std::istream& file, Format format, int bytes, double& value) {
  if (format == Format::ascii) return static_cast<bool>(file >> value);
  char raw[8];
  if (!file.read(raw, bytes)) return false;
  std::uint64_t whole = 0;
  for (int i = 0; i < bytes; ++i) {
    whole = whole << 8 | static_cast<unsigned char>(raw[format == Format::big_endian ? i : bytes - 1 - i]);
  }
  value = static_cast<double>(whole);
  return true;
}

bool has_whole_row(std::istream& file, Format format, const std::vector<Property>& properties) {
  double value = 0.0;
  for (const Property& property : properties) {
    double count = 1.0;
    if (property.count_bytes > 0 && !next_value(file, format, property.count_bytes, count)) return false;
    for (double i = 0.0; i < count; ++i) {
      if (!next_value(file, format, property.value_bytes, value)) return false;
    }
  }
  return true;
}

}  // namespace

std::string missing_in_ply(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  file.imbue(std::locale::classic());
  Format format = Format::ascii;
  std::vector<Element> elements;
  bool ended = false;
  for (std::string line; !ended && std::getline(file, line);) {
    std::istringstream words(line);
    std::string word, type, count_type;
    words >> word;
    if (word == "format") {
      words >> type;
      if (type == "binary_little_endian") format = Format::little_endian;
      if (type == "binary_big_endian") format = Format::big_endian;
    } else if (word == "element") {
      elements.emplace_back();
      words >> elements.back().name >> elements.back().count;
    } else if (word == "property") {
      words >> type;
      if (type == "list") words >> count_type >> type;
      const auto bytes = bytes_of.find(type), count_bytes = bytes_of.find(count_type);
      if (elements.empty() || bytes == bytes_of.end() || (!count_type.empty() && count_bytes == bytes_of.end())) {
        return "a known type in its header line '" + line + "'";
      }
      elements.back().properties.push_back({count_type.empty() ? 0 : count_bytes->second, bytes->second});
    }
    ended = word == "end_header" && !file.eof();
  }
  if (!ended) return "the line end_header";
  for (const Element& element : elements) {
    if (element.properties.empty()) return "properties of the element " + element.name;
    for (long long i = 0; i < element.count; ++i) {
      if (!has_whole_row(file, format, element.properties)) {
        return "element " + element.name + " " + std::to_string(i) + " of " + std::to_string(element.count);
      }
    }
  }
  return "";
}

}  // namespace tissue_sim
