#pragma once

#include "geometry/twins.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/scene.h"

/// Solid organs to test with.
namespace tissue_sim {

/// Every vertex that is not on the surface of the block is moved by up to `part` of `edge` along each axis.
inline void jitter_inside(TetrahedralMesh& block, const Vector3& size, double edge, double part) {
  Random random(7);
  for (Vector3& v : block.vertices) {
    const Vector3 to_side(0.5 * size.x() - std::abs(v.x()), 0.5 * size.y() - std::abs(v.y()),
                          std::min(-v.z(), v.z() + size.z()));
    const Vector3 way = random_point(random, part * edge);
    if (to_side.minCoeff() > 1e-9) v += way;
  }
}

inline std::vector<double> volumes_of(const TetrahedralMesh& mesh) {
  std::vector<double> volumes;
  for (const Tetrahedron& t : mesh.tetrahedra) volumes.push_back(tetrahedron_volume(mesh, t));
  return volumes;
}

/// Moves one vertex that is not among the first `surface_vertices` so close to the opposite face of one of its
/// tetrahedra that this has `part` of the volume of the smallest of the vertex's others. Of all such moves the one that
/// leaves the others largest. Returns the sliver's index.
inline int make_one_sliver(TetrahedralMesh& mesh, int surface_vertices, double part) {
  const std::vector<double> volumes = volumes_of(mesh);
  double mean = 0.0;
  for (const double v : volumes) mean += v / static_cast<double>(volumes.size());
  struct Move {
    int sliver = -1;
    int vertex = -1;
    Vector3 place = Vector3::Zero();
    double others = 0.0;  ///< m^3, the smallest of the vertex's other tetrahedra
  } best;
  for (int t = 0; t < static_cast<int>(mesh.tetrahedra.size()); ++t) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const int vertex = mesh.tetrahedra[t][corner];
      if (vertex < surface_vertices) continue;
      const Vector3 before = mesh.vertices[vertex];
      Vector3 middle = Vector3::Zero();
      for (const int v : mesh.tetrahedra[t])
        middle += v == vertex ? Vector3::Zero().eval() : Vector3(mesh.vertices[v] / 3.0);
      const auto smallest_other = [&](double height) {
        mesh.vertices[vertex] = middle + height * (before - middle);
        double smallest = 1e300;
        for (int s = 0; s < static_cast<int>(mesh.tetrahedra.size()); ++s) {
          const Tetrahedron& other = mesh.tetrahedra[s];
          if (s == t || std::find(other.begin(), other.end(), vertex) == other.end()) continue;
          smallest = std::min(smallest, tetrahedron_volume(mesh, other));
        }
        return smallest;
      };
      const double others = smallest_other(0.0);
      const double height = part * others / volumes[t];
      if (others > best.others) {
        smallest_other(height);
        best = {t, vertex, mesh.vertices[vertex], others};
      }
      mesh.vertices[vertex] = before;
    }
  }
  if (best.others > 0.02 * mean) mesh.vertices[best.vertex] = best.place;
  return best.others > 0.02 * mean ? best.sliver : -1;
}

/// A block with its top at z = 0, held at its bottom, as a solid of its own surface.
inline Organ solid_organ(TetrahedralMesh block, const Vector3& size, Model model) {
  Organ organ;
  organ.name = "block";
  organ.solid = std::move(block);
  organ.mesh = take_surface(organ.solid);
  organ.model = model;
  organ.material = {5400.0, 0.45, 1060.0, 0.1, 0.0};
  for (int v = 0; v < static_cast<int>(organ.solid.vertices.size()); ++v) {
    if (organ.solid.vertices[v].z() < -size.z() + 1e-9) organ.attached.push_back(v);
  }
  return organ;
}

/// A fine sphere of `radius` carried by a coarse block around it, which is held at its bottom.
inline Organ embedded_sphere(double radius, int slices, int cells, Model model) {
  const Vector3 size = Vector3::Constant(2.2 * radius);
  Organ organ = solid_organ(make_block(size, {cells, cells, cells}), size, model);
  organ.mesh = make_sphere(radius, slices);
  for (Vector3& v : organ.mesh.vertices) v.z() -= 0.5 * size.z();
  organ.embedded = true;
  return organ;
}

}  // namespace tissue_sim
