#pragma once

#include <string>
#include <vector>

#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

/// Does the path end in .msh, in small letters or large?
bool is_tetrahedral_mesh(const std::string& path);

/// The solid in a Gmsh file (.msh, ASCII, version 2.2 or 4.1; gmsh.info/doc/texinfo/gmsh.html, "Gmsh file formats"),
/// times `scale` (file units to metres): sound as inspect() has it, of one or more components.
///
/// First-order tetrahedra are kept. Points, lines and surface elements are skipped, as are all sections but
/// $MeshFormat, $Nodes and $Elements; other volume elements are refused. Warns of nodes dropped because no tetrahedron
/// names them, of inverted tetrahedra turned, and of several components. Throws SceneError for everything else, one
/// line `path:line: what was wrong, what to do`. The numbers are read alike in every locale.
TetrahedralMesh read_tetrahedral_mesh(const std::string& path, double scale, std::vector<std::string>& warnings);

}  // namespace tissue_sim
