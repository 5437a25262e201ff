#pragma once

#include <string>

#include "tissue_sim/geometry/triangle_mesh.h"

namespace tissue_sim {

/// The surface in a file of each format, and nothing else of it. assimp's readers believe what a file says of itself (a
/// list of four billion corners, a node that holds itself) and end the program, so they get a text in which every count
/// and every index has been held against what is there. All throw std::runtime_error, `line: what is wrong`.

/// Polygons of more corners are refused: cutting them into triangles takes the cube of it.
constexpr std::size_t most_corners = 1000;

/// Vertices and faces of an OBJ file, as an OBJ text: without normals, textures, materials, groups, lines and points.
std::string plain_obj(const std::string& text);

/// Vertices and faces of a PLY file, ASCII or binary, as an OBJ text.
std::string plain_ply(const std::string& bytes);

/// A COLLADA text with all blanked out that a rigid shape does not need: materials, pictures, lights, cameras,
/// animations. Skeletons are refused, and nodes that lead back to themselves or multiply.
std::string plain_dae(std::string text);

/// The triangles of an STL file, ASCII or binary, each with corners of its own.
TriangleMesh read_stl(const std::string& bytes);

}  // namespace tissue_sim
