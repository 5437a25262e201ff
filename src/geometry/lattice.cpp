#include "tissue_sim/geometry/lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace tissue_sim {

namespace {

/// Samples across the edge of a cube, at least: what a tetrahedron holds is counted by points of equal volume.
constexpr double samples_across = 4.0;

/// The samples of a full tetrahedron come to within a tenth of its volume.
constexpr double counted_full = 0.9;

/// Three coordinates of the unit cube in descending order, and which axes they belong to: that order is the path along
/// the cube's edges from its first corner to its last, and so its tetrahedron.
struct Path {
  std::array<int, 3> axes;
  std::array<double, 4> weights;  ///< of the four corners along the path

  explicit Path(const Vector3& inside) : axes(axes_along(number(inside))) {
    const double first = inside[axes[0]];
    const double second = inside[axes[1]];
    const double third = inside[axes[2]];
    weights = {1.0 - first, first - second, second - third, third};
  }

  /// 0 to 5, one an order of the axes: that of axes_along(). Equal coordinates stay in order.
  static int number(const Vector3& inside) {
    constexpr std::array<int, 8> by_comparisons = {0, 2, 1, -1, -1, 3, 4, 5};  // -1: contradict each other
    const int y_first = inside[1] > inside[0] ? 1 : 0;
    const int z_before_y = inside[2] > inside[1] ? 2 : 0;
    const int z_before_x = inside[2] > inside[0] ? 4 : 0;
    return by_comparisons[static_cast<std::size_t>(y_first + z_before_y + z_before_x)];
  }
};

struct Grid {
  Vector3 origin;
  double edge;
  std::array<int, 3> cells;

  int cube(const std::array<int, 3>& at) const { return at[0] + cells[0] * (at[1] + cells[1] * at[2]); }
  int corner(const std::array<int, 3>& at) const { return at[0] + (cells[0] + 1) * (at[1] + (cells[1] + 1) * at[2]); }
  std::size_t cubes() const {
    return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  }
  Vector3 place(const std::array<int, 3>& corner) const {
    return origin + edge * Vector3(corner[0], corner[1], corner[2]);
  }
};

/// Whether the corners along a path are left-handed, and the last two change places.
bool is_swapped(const std::array<int, 3>& cube, const std::array<int, 3>& axes) {
  const int mirrored = cube[0] + cube[1] + cube[2];
  const bool odd_path = axes[1] != (axes[0] + 1) % 3;
  return (mirrored % 2 != 0) != odd_path;
}

/// The bits of the three numbers in turns: cubes that follow each other by it lie close together.
std::uint64_t interleaved(const std::array<int, 3>& cube) {
  std::uint64_t bits = 0;
  for (unsigned bit = 0; bit < 21; ++bit) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      bits |= (static_cast<std::uint64_t>(cube[axis]) >> bit & 1U) << (3 * bit + axis);
    }
  }
  return bits;
}

/// Where in the grid a point is: its cube, and where in it.
struct Place {
  std::array<int, 3> cube;
  Vector3 inside;  ///< of the unit cube, mirrored as the cube is

  static Place of(const Vector3& p, const Grid& grid) {
    const Vector3 scaled = (p - grid.origin) / grid.edge;
    Place place;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      place.cube[a] = std::clamp(static_cast<int>(scaled[axis]), 0, grid.cells[a] - 1);
      const double along = scaled[axis] - place.cube[a];
      place.inside[axis] = place.cube[a] % 2 == 0 ? along : 1.0 - along;
    }
    return place;
  }

  std::size_t tetrahedron(const Grid& grid) const {
    return 6 * static_cast<std::size_t>(grid.cube(cube)) + static_cast<std::size_t>(Path::number(inside));
  }

  /// The grid points along the path.
  std::array<std::array<int, 3>, 4> corners(const Path& path) const {
    std::array<std::array<int, 3>, 4> along;
    std::array<int, 3> at = cube;
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += cube[axis] % 2;
    along[0] = at;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(path.axes[i]);
      at[axis] += cube[axis] % 2 == 0 ? 1 : -1;
      along[i + 1] = at;
    }
    return along;
  }
};

/// Points that share a tetrahedron's volume evenly, as weights of its corners: those of a cube, `across` each way,
/// folded into one of its six tetrahedra.
std::vector<std::array<double, 4>> sample_weights(int across) {
  std::vector<std::array<double, 4>> weights;
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      for (int k = 0; k < across; ++k) {
        const Path folded(Vector3(i + 1.0 / 6.0, j + 3.0 / 6.0, k + 5.0 / 6.0) / across);  // no ties
        weights.push_back(folded.weights);
      }
    }
  }
  return weights;
}

/// How many samples each way keep them no farther apart than `spacing`.
std::size_t samples_each_way(const TetrahedralMesh& solid, const Tetrahedron& t, double spacing) {
  const double longest = std::sqrt(
      squared_longest_edge(solid.vertices[t[0]], solid.vertices[t[1]], solid.vertices[t[2]], solid.vertices[t[3]]));
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(longest / spacing)));
}

Grid grid_around(const std::vector<Vector3>& vertices, const std::vector<Vector3>& points, double edge) {
  Vector3 lower = vertices.front();
  Vector3 upper = lower;
  for (const std::vector<Vector3>* list : {&vertices, &points}) {
    for (const Vector3& p : *list) {
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
  }
  Grid grid{lower, edge, {}};
  for (int axis = 0; axis < 3; ++axis) {
    const double size = upper[axis] - lower[axis];
    const int cells = std::max(1, static_cast<int>(std::ceil(size / edge - 1e-9)));
    grid.cells[static_cast<std::size_t>(axis)] = cells;
    grid.origin[axis] -= 0.5 * (cells * edge - size);
  }
  return grid;
}

}  // namespace

Lattice cover(const TetrahedralMesh& solid, const std::vector<Vector3>& points, double edge) {
  const Grid grid = grid_around(solid.vertices, points, edge);
  Lattice lattice;
  lattice.origin = grid.origin;
  lattice.edge = edge;
  lattice.cells = grid.cells;
  lattice.tetrahedra.assign(6 * grid.cubes(), -1);
  std::vector<int> node_of;
  node_of.assign(static_cast<std::size_t>(grid.corner({grid.cells[0], grid.cells[1], grid.cells[2]})) + 1, -1);

  const auto tetrahedron_at = [&](const Vector3& p) {
    const Place place = Place::of(p, grid);
    int& number = lattice.tetrahedra[place.tetrahedron(grid)];
    if (number >= 0) return number;
    number = static_cast<int>(lattice.mesh.tetrahedra.size());
    Tetrahedron corners{};
    const Path path(place.inside);
    const auto along = place.corners(path);
    for (std::size_t i = 0; i < 4; ++i) {
      int& node = node_of[static_cast<std::size_t>(grid.corner(along[i]))];
      if (node < 0) {
        node = static_cast<int>(lattice.mesh.vertices.size());
        lattice.mesh.vertices.push_back(grid.place(along[i]));
      }
      corners[i] = node;
    }
    if (is_swapped(place.cube, path.axes)) std::swap(corners[2], corners[3]);
    lattice.mesh.tetrahedra.push_back(corners);
    lattice.fill.push_back(0.0);
    return number;
  };
  const double whole = edge * edge * edge / 6.0;
  std::vector<int> held;
  std::vector<std::vector<std::array<double, 4>>> samples;  // by how many each way
  for (const Tetrahedron& t : solid.tetrahedra) {
    const std::size_t across = samples_each_way(solid, t, edge / samples_across);
    if (samples.size() <= across) samples.resize(across + 1);
    if (samples[across].empty()) samples[across] = sample_weights(static_cast<int>(across));
    held.clear();
    for (const std::array<double, 4>& weights : samples[across]) {
      Vector3 point = Vector3::Zero();
      for (std::size_t corner = 0; corner < 4; ++corner) point += weights[corner] * solid.vertices[t[corner]];
      held.push_back(tetrahedron_at(point));
    }
    const double share = tetrahedron_volume(solid, t) / (whole * static_cast<double>(held.size()));
    for (const int number : held) lattice.fill[number] += share;
  }
  for (double& fill : lattice.fill) fill = fill > counted_full ? 1.0 : fill;
  for (const Vector3& p : solid.vertices) tetrahedron_at(p);
  for (const Vector3& p : points) tetrahedron_at(p);
  return lattice;
}

std::vector<LatticeCube> cubes_of(const Lattice& lattice) {
  struct Numbered {
    std::uint64_t key;
    LatticeCube cube;
  };
  std::vector<Numbered> found;
  const Grid grid{lattice.origin, lattice.edge, lattice.cells};
  std::array<int, 3> at{};
  for (at[2] = 0; at[2] < lattice.cells[2]; ++at[2]) {
    for (at[1] = 0; at[1] < lattice.cells[1]; ++at[1]) {
      for (at[0] = 0; at[0] < lattice.cells[0]; ++at[0]) {
        LatticeCube cube;
        bool any = false;
        for (int n = 0; n < 6; ++n) {
          const int t = lattice.tetrahedra[6 * static_cast<std::size_t>(grid.cube(at)) + static_cast<std::size_t>(n)];
          if (t < 0) continue;
          any = true;
          cube.tetrahedra[n] = t;
          Tetrahedron along = lattice.mesh.tetrahedra[t];
          if (is_swapped(at, axes_along(n))) std::swap(along[2], along[3]);
          const std::array<int, 4> corners = corners_along(n);
          for (std::size_t i = 0; i < 4; ++i) cube.corners[corners[i]] = along[i];
        }
        for (std::size_t axis = 0; axis < 3; ++axis) cube.mirrored[axis] = at[axis] % 2 != 0;
        if (any) found.push_back({interleaved(at), cube});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const Numbered& a, const Numbered& b) { return a.key < b.key; });
  std::vector<LatticeCube> cubes;
  cubes.reserve(found.size());
  for (const Numbered& numbered : found) cubes.push_back(numbered.cube);
  return cubes;
}

Embedding embed(const std::vector<Vector3>& points, const Lattice& lattice) {
  const Grid grid{lattice.origin, lattice.edge, lattice.cells};
  Embedding embedding;
  embedding.corners.reserve(points.size());
  embedding.weights.reserve(points.size());
  for (const Vector3& p : points) {
    const Place place = Place::of(p, grid);
    const int number = lattice.tetrahedra[place.tetrahedron(grid)];
    if (number < 0) throw std::invalid_argument("embed: a point lies in no tetrahedron of the lattice");
    embedding.corners.push_back(lattice.mesh.tetrahedra[number]);
    const Path path(place.inside);
    embedding.weights.push_back(path.weights);
    if (is_swapped(place.cube, path.axes)) std::swap(embedding.weights.back()[2], embedding.weights.back()[3]);
  }
  return embedding;
}

}  // namespace tissue_sim
