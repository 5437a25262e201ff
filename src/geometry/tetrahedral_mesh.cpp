#include "tissue_sim/geometry/tetrahedral_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "tissue_sim/geometry/aabb_tree.h"

namespace tissue_sim {
namespace {

/// Volume over the cube of the longest edge at which a tetrahedron has no volume that could be told from rounding.
constexpr double flat_ratio = 1e-12;

/// A face of a tetrahedron but for its smallest vertex. `place` is 4 * tetrahedron + the opposite corner.
struct Face {
  int middle;
  int high;
  int place;
};

/// Faces of all tetrahedra, grouped by their smallest vertex and sorted by the other two, then by place. A counting
/// sort over the smallest vertex: 500,000 tetrahedra take a fifth of a second.
struct Faces {
  std::vector<int> first;
  std::vector<Face> faces;
};

Triangle face_of(const Tetrahedron& t, int corner) {
  const auto& face = outward_faces[corner];
  return {t[face[0]], t[face[1]], t[face[2]]};
}

Faces sort_faces(int vertex_count, const std::vector<Tetrahedron>& tetrahedra) {
  Faces sorted;
  sorted.first.assign(static_cast<std::size_t>(vertex_count) + 1, 0);
  sorted.faces.resize(4 * tetrahedra.size());
  const auto for_each = [&](auto&& visit) {
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
      for (int corner = 0; corner < 4; ++corner) {
        Triangle face = face_of(tetrahedra[t], corner);
        std::sort(face.begin(), face.end());
        visit(face, 4 * static_cast<int>(t) + corner);
      }
    }
  };
  for_each([&](const Triangle& face, int) { ++sorted.first[face[0] + 1]; });
  std::partial_sum(sorted.first.begin(), sorted.first.end(), sorted.first.begin());
  std::vector<int> next(sorted.first.begin(), sorted.first.end() - 1);
  for_each([&](const Triangle& face, int place) { sorted.faces[next[face[0]]++] = {face[1], face[2], place}; });
  for (std::size_t v = 0; v + 1 < sorted.first.size(); ++v) {
    std::sort(sorted.faces.begin() + sorted.first[v], sorted.faces.begin() + sorted.first[v + 1],
              [](const Face& a, const Face& b) {
                if (a.middle != b.middle) return a.middle < b.middle;
                return a.high != b.high ? a.high < b.high : a.place < b.place;
              });
  }
  return sorted;
}

/// Calls visit(first, last) with the tetrahedra at each face.
template <typename Visit>
void for_each_face(const Faces& sorted, Visit visit) {
  for (std::size_t low = 0; low + 1 < sorted.first.size(); ++low) {
    const Face* face = sorted.faces.data() + sorted.first[low];
    const Face* const end = sorted.faces.data() + sorted.first[low + 1];
    while (face != end) {
      const Face* last = face;
      while (last != end && last->middle == face->middle && last->high == face->high) ++last;
      visit(face, last);
      face = last;
    }
  }
}

std::vector<Triangle> surface_triangles(const Faces& sorted, const std::vector<Tetrahedron>& tetrahedra) {
  std::vector<int> places;
  for_each_face(sorted, [&](const Face* face, const Face* last) {
    if (last - face == 1) places.push_back(face->place);
  });
  std::sort(places.begin(), places.end());
  std::vector<Triangle> triangles;
  triangles.reserve(places.size());
  for (const int place : places) triangles.push_back(face_of(tetrahedra[place / 4], place % 4));
  return triangles;
}

/// Does the face run through its vertices in ascending order, turned around or not?
bool runs_upward(const Triangle& face) {
  return (face[0] < face[1]) + (face[1] < face[2]) + (face[2] < face[0]) == 2;
}

int count_duplicates(std::vector<Tetrahedron> sorted) {
  for (Tetrahedron& t : sorted) std::sort(t.begin(), t.end());
  std::sort(sorted.begin(), sorted.end());
  int duplicates = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) duplicates += sorted[i] == sorted[i - 1];
  return duplicates;
}

bool repeats_a_corner(Tetrahedron t) {
  std::sort(t.begin(), t.end());
  return std::adjacent_find(t.begin(), t.end()) != t.end();
}

/// How many sets of vertices the tetrahedra join; `referenced` is how many vertices they name.
int count_components(int vertex_count, const std::vector<Tetrahedron>& tetrahedra, int referenced) {
  std::vector<int> parent(static_cast<std::size_t>(vertex_count));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  int joined = 0;
  for (const Tetrahedron& t : tetrahedra) {
    for (std::size_t i = 1; i < 4; ++i) {
      const auto [low, high] = std::minmax({root(t[0]), root(t[i])});
      joined += low != high;
      parent[high] = low;
    }
  }
  return referenced - joined;
}

/// Vertex old[i] becomes vertex i; those not in `old` are dropped and no tetrahedron may name them.
void renumber(TetrahedralMesh& mesh, const std::vector<int>& old) {
  std::vector<int> renamed(mesh.vertices.size(), -1);
  std::vector<Vector3> vertices(old.size());
  for (std::size_t i = 0; i < old.size(); ++i) {
    renamed[old[i]] = static_cast<int>(i);
    vertices[i] = mesh.vertices[old[i]];
  }
  mesh.vertices = std::move(vertices);
  for (Tetrahedron& t : mesh.tetrahedra) {
    for (int& v : t) v = renamed[v];
  }
}

/// Leaves two zero bits between each two of the lower 21.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

}  // namespace

std::vector<int> along_curve(const std::vector<Vector3>& points) {
  const Box box = bounds_of(points);
  const double longest = points.empty() ? 0.0 : box.size().maxCoeff();
  const double cells = longest > 0.0 ? 2097151.0 / longest : 0.0;
  std::vector<std::pair<std::uint64_t, int>> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3 cell = (points[i] - box.lower) * cells;
    std::uint64_t code = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) code = code << 1 | spread(static_cast<std::uint64_t>(cell[axis]));
    order[i] = {code, static_cast<int>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<int> indices(points.size());
  std::transform(order.begin(), order.end(), indices.begin(), [](const auto& entry) { return entry.second; });
  return indices;
}

double squared_longest_edge(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (d - a).squaredNorm(), (c - b).squaredNorm(),
                   (d - b).squaredNorm(), (d - c).squaredNorm()});
}

bool is_flat(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const double longest2 = squared_longest_edge(a, b, c, d);
  return !(std::abs(tetrahedron_volume(a, b, c, d)) > flat_ratio * longest2 * std::sqrt(longest2));
}

bool TetrahedralFaults::sound() const {
  return components > 0 && non_finite_vertices + bad_indices + repeated_corners + flat + inverted + duplicates +
                                   crowded_faces + overlapping_faces + non_manifold_surface_edges +
                                   non_manifold_surface_vertices + unreferenced_vertices ==
                               0;
}

TetrahedralFaults inspect(const TetrahedralMesh& mesh) {
  TetrahedralFaults faults;
  const int vertex_count = static_cast<int>(mesh.vertices.size());
  for (const Tetrahedron& t : mesh.tetrahedra) {
    faults.bad_indices += std::any_of(t.begin(), t.end(), [&](int v) { return v < 0 || v >= vertex_count; });
  }
  if (faults.bad_indices > 0) return faults;

  for (const Vector3& p : mesh.vertices) faults.non_finite_vertices += !p.allFinite();

  std::vector<char> referenced(mesh.vertices.size(), 0);
  std::vector<char> inverted;
  std::vector<Tetrahedron> sound;  // those with four corners; the others have no faces to speak of
  sound.reserve(mesh.tetrahedra.size());
  inverted.reserve(mesh.tetrahedra.size());
  for (const Tetrahedron& t : mesh.tetrahedra) {
    for (const int v : t) referenced[v] = 1;
    if (repeats_a_corner(t)) {
      ++faults.repeated_corners;
      continue;
    }
    const bool flat = is_flat(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]);
    sound.push_back(t);
    inverted.push_back(!flat && tetrahedron_volume(mesh, t) < 0.0);
    faults.flat += flat;
    faults.inverted += inverted.back();
  }
  const int named = static_cast<int>(std::count(referenced.begin(), referenced.end(), 1));
  faults.unreferenced_vertices = vertex_count - named;
  faults.components = count_components(vertex_count, mesh.tetrahedra, named);
  faults.duplicates = count_duplicates(sound);

  const Faces faces = sort_faces(vertex_count, sound);
  for_each_face(faces, [&](const Face* face, const Face* last) {
    const auto upward = [&](const Face& f) {
      return runs_upward(face_of(sound[f.place / 4], f.place % 4)) != static_cast<bool>(inverted[f.place / 4]);
    };
    faults.crowded_faces += last - face > 2;
    faults.overlapping_faces += last - face == 2 && upward(face[0]) == upward(face[1]);
  });
  const MeshFaults surface = inspect(TriangleMesh{mesh.vertices, surface_triangles(faces, sound)});
  faults.non_manifold_surface_edges = surface.boundary_edges + surface.non_manifold_edges;
  faults.non_manifold_surface_vertices = surface.non_manifold_vertices;
  return faults;
}

int orient(TetrahedralMesh& mesh) {
  int swapped = 0;
  for (Tetrahedron& t : mesh.tetrahedra) {
    if (!(tetrahedron_volume(mesh, t) < 0.0)) continue;
    std::swap(t[2], t[3]);
    ++swapped;
  }
  return swapped;
}

int drop_unreferenced(TetrahedralMesh& mesh) {
  std::vector<char> referenced(mesh.vertices.size(), 0);
  for (const Tetrahedron& t : mesh.tetrahedra) {
    for (const int v : t) referenced[v] = 1;
  }
  std::vector<int> kept;
  for (std::size_t v = 0; v < referenced.size(); ++v) {
    if (referenced[v]) kept.push_back(static_cast<int>(v));
  }
  const int dropped = static_cast<int>(mesh.vertices.size() - kept.size());
  if (dropped > 0) renumber(mesh, kept);
  return dropped;
}

TriangleMesh take_surface(TetrahedralMesh& mesh) {
  const int vertex_count = static_cast<int>(mesh.vertices.size());
  TriangleMesh surface;
  surface.triangles = surface_triangles(sort_faces(vertex_count, mesh.tetrahedra), mesh.tetrahedra);
  std::vector<char> outer(mesh.vertices.size(), 0);
  for (const Triangle& t : surface.triangles) {
    for (const int v : t) outer[v] = 1;
  }
  std::vector<int> old(mesh.vertices.size());
  std::iota(old.begin(), old.end(), 0);
  const auto inner = std::stable_partition(old.begin(), old.end(), [&](int v) { return outer[v] != 0; });
  std::vector<int> renamed(mesh.vertices.size());
  for (std::size_t i = 0; i < old.size(); ++i) renamed[old[i]] = static_cast<int>(i);
  for (Triangle& t : surface.triangles) {
    for (int& v : t) v = renamed[v];
  }
  renumber(mesh, old);
  surface.vertices.assign(mesh.vertices.begin(), mesh.vertices.begin() + (inner - old.begin()));
  return surface;
}

void sort_for_locality(TetrahedralMesh& mesh) {
  std::vector<Vector3> centroids;
  centroids.reserve(mesh.tetrahedra.size());
  for (const auto& [a, b, c, d] : mesh.tetrahedra) {
    centroids.push_back(0.25 * (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c] + mesh.vertices[d]));
  }
  std::vector<Tetrahedron> sorted;
  sorted.reserve(mesh.tetrahedra.size());
  for (const int t : along_curve(centroids)) sorted.push_back(mesh.tetrahedra[t]);
  mesh.tetrahedra = std::move(sorted);
}

void sort_vertices_for_locality(TetrahedralMesh& mesh) {
  renumber(mesh, along_curve(mesh.vertices));
}

TetrahedralMesh make_block(const Vector3& size, const std::array<int, 3>& cells) {
  const Vector3 lowest = {-0.5, -0.5, -1.0};
  std::array<std::vector<double>, 3> planes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    for (int i = 0; i <= cells[axis]; ++i) {
      planes[axis].push_back(size[at] * (static_cast<double>(i) / cells[axis] + lowest[at]));
    }
  }
  return make_block(planes);
}

TetrahedralMesh make_block(const std::array<std::vector<double>, 3>& planes) {
  TetrahedralMesh mesh;
  for (const double z : planes[2]) {
    for (const double y : planes[1]) {
      for (const double x : planes[0]) mesh.vertices.emplace_back(x, y, z);
    }
  }
  const std::array<int, 3> count = {static_cast<int>(planes[0].size()), static_cast<int>(planes[1].size()),
                                    static_cast<int>(planes[2].size())};
  const std::array<int, 3> step = {1, count[0], count[0] * count[1]};  // from a vertex to the next along each axis
  // Each tetrahedron is a way along the cell's edges from one corner to the opposite: one step along each axis. Cells
  // in odd places are mirrored, so that the diagonals have no common direction.
  constexpr std::array<std::array<int, 3>, 6> ways = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int k = 0; k + 1 < count[2]; ++k) {
    for (int j = 0; j + 1 < count[1]; ++j) {
      for (int i = 0; i + 1 < count[0]; ++i) {
        const std::array<int, 3> odd = {i % 2, j % 2, k % 2};
        const int a = (i + odd[0]) * step[0] + (j + odd[1]) * step[1] + (k + odd[2]) * step[2];
        const auto along = [&](int axis) { return odd[axis] != 0 ? -step[axis] : step[axis]; };
        for (std::size_t way = 0; way < 6; ++way) {
          const int b = a + along(ways[way][0]);
          const int c = b + along(ways[way][1]);
          const int d = c + along(ways[way][2]);
          // An odd order of the axes turns the tetrahedron inside out, and so does each mirror.
          const bool turned = (way >= 3) != ((odd[0] + odd[1] + odd[2]) % 2 != 0);
          mesh.tetrahedra.push_back(turned ? Tetrahedron{a, c, b, d} : Tetrahedron{a, b, c, d});
        }
      }
    }
  }
  return mesh;
}

double solid_volume(const TetrahedralMesh& mesh) {
  double volume = 0.0;
  for (const Tetrahedron& t : mesh.tetrahedra) volume += tetrahedron_volume(mesh, t);
  return volume;
}

}  // namespace tissue_sim
