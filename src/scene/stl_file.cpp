#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "mesh_formats.h"

namespace tissue_sim {
namespace {

constexpr std::size_t header_bytes = 84;    ///< 80 of anything, the number of triangles in 4
constexpr std::size_t triangle_bytes = 50;  ///< a normal, three corners of 3 floats, 2 of anything

std::uint32_t whole(const char* bytes) {
  std::uint32_t number = 0;
  for (int i = 3; i >= 0; --i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
  return number;
}

double real(const char* bytes) {
  const std::uint32_t bits = whole(bytes);
  float number = 0.0F;
  std::memcpy(&number, &bits, sizeof number);
  return number;
}

/// Three more vertices, which are a triangle.
void add_triangle(TriangleMesh& mesh) {
  const int first = static_cast<int>(mesh.vertices.size()) - 3;
  mesh.triangles.push_back({first, first + 1, first + 2});
}

TriangleMesh read_binary(const std::string& bytes) {
  const std::size_t count = whole(&bytes[80]);
  if (count > (bytes.size() - header_bytes) / triangle_bytes) {
    throw std::runtime_error("announces " + std::to_string(count) + " triangles in " + std::to_string(bytes.size()) +
                             " bytes, it is cut short or damaged");
  }
  TriangleMesh mesh;
  mesh.vertices.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (std::size_t t = 0; t < count; ++t) {
    const char* corner = &bytes[header_bytes + t * triangle_bytes + 12];
    for (int i = 0; i < 3; ++i, corner += 12)
      mesh.vertices.emplace_back(real(corner), real(corner + 4), real(corner + 8));
    add_triangle(mesh);
  }
  return mesh;
}

TriangleMesh read_ascii(const std::string& text) {
  TriangleMesh mesh;
  std::istringstream words(text), number;
  number.imbue(std::locale::classic());
  int corners = 0;  // of the triangle that is being read
  const auto coordinate = [&] {
    std::string word;
    words >> word;
    double value = std::nan("");
    number.clear();
    number.str(word);
    if (number >> value && number.peek() == std::istringstream::traits_type::eof()) return value;
    if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf") return std::nan("");
    throw std::runtime_error("'" + word.substr(0, 40) + "' is not a coordinate");
  };
  for (std::string word; words >> word;) {
    if (word == "vertex") {
      const double x = coordinate(), y = coordinate(), z = coordinate();
      mesh.vertices.emplace_back(x, y, z);
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3) throw std::runtime_error("a facet has " + std::to_string(corners) + " corners");
      add_triangle(mesh);
      corners = 0;
    }
  }
  if (corners != 0) throw std::runtime_error("ends in a facet, it is cut short");
  return mesh;
}

}  // namespace

TriangleMesh read_stl(const std::string& bytes) {
  const bool headed = bytes.size() >= header_bytes;
  // Some exporters begin a binary file with "solid" too: then its length is what its count says.
  const bool exact = headed && header_bytes + triangle_bytes * whole(&bytes[80]) == bytes.size();
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  const bool solid = first != std::string::npos && bytes.compare(first, 5, "solid") == 0;
  if (solid && !exact) return read_ascii(bytes);
  if (!headed) throw std::runtime_error("is neither an ASCII nor a binary STL file");
  return read_binary(bytes);
}

}  // namespace tissue_sim
