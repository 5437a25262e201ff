#include "tissue_sim/tissue/level.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tissue_sim/geometry/lattice.h"
#include "tissue_sim/tissue/stability.h"

namespace tissue_sim {

namespace {

/// Of the organ's moduli: linear tetrahedra of a coarse lattice are too stiff by about this.
constexpr double coarse_modulus = 0.87;

/// Cells of the coarser level: a smaller region would be all band, and its error is not known.
constexpr double least_cells = 2.0;

/// A region that is more of the organ than this saves nothing.
constexpr double largest_part = 0.3;

/// One in so many tetrahedra, the smallest, is what the mesh of an organ is fine for.
constexpr std::size_t finest_part = 4;

/// What a tetrahedron of the lattice counts at least. With nothing in it the vertices on its far side would be free.
constexpr double least_fill = 0.02;

/// Edges of the lattice: places on a held surface are no farther apart.
constexpr double pin_spacing = 0.5;

double half_ball(double radius) {
  return 2.0 / 3.0 * 3.14159265358979 * radius * radius * radius;
}

double volume_of(const RestShape& shape) {
  double volume = 0.0;
  for (const NeoHookeanElement& element : shape.tetrahedra) volume += element.volume;
  return volume;
}

/// Where the organ is held: at its attached vertices, and all over the triangles between them. In an organ meshed more
/// coarsely there than the lattice, vertices alone would hold the lattice at a few points only.
struct HeldPlaces {
  std::vector<Vector3> places;
  std::vector<double> masses;  ///< kg, how much each counts among those in one tetrahedron
};

HeldPlaces held_places(const RestShape& organ, double spacing) {
  HeldPlaces held;
  for (std::size_t v = 0; v < organ.positions.size(); ++v) {
    if (!organ.attached[v]) continue;
    held.places.push_back(organ.positions[v]);
    held.masses.push_back(organ.mass[v]);
  }
  for (const auto& [a, b, c] : organ.triangles) {
    if (!organ.attached[a] || !organ.attached[b] || !organ.attached[c]) continue;
    const std::array<Vector3, 3> x = {organ.positions[a], organ.positions[b], organ.positions[c]};
    const double longest =
        std::sqrt(std::max({(x[1] - x[0]).squaredNorm(), (x[2] - x[1]).squaredNorm(), (x[0] - x[2]).squaredNorm()}));
    const int parts = static_cast<int>(std::ceil(longest / spacing));
    const double mass = (organ.mass[a] + organ.mass[b] + organ.mass[c]) / 3.0;
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j) {
        if (i == parts || j == parts || i + j == 0) continue;  // a corner
        held.places.push_back(x[0] + (i * (x[1] - x[0]) + j * (x[2] - x[0])) / parts);
        held.masses.push_back(mass);
      }
    }
  }
  return held;
}

/// What is held in one tetrahedron holds it at its middle. Its nodes may stand a good way off the tissue: held
/// themselves, they would make a thin organ thicker and far softer.
void add_pins(const HeldPlaces& at, const Lattice& lattice, Level& level) {
  const auto& [places, masses] = at;
  const Embedding embedding = embed(places, lattice);
  const std::vector<Tetrahedron>& corners = embedding.corners;
  std::vector<int> held(places.size());
  std::iota(held.begin(), held.end(), 0);
  std::sort(held.begin(), held.end(),
            [&](int a, int b) { return corners[a] < corners[b] || (corners[a] == corners[b] && a < b); });
  double mass = 0.0;
  for (std::size_t i = 0; i < held.size(); ++i) {
    const int v = held[i];
    if (i == 0 || corners[v] != level.pins.corners.back()) {
      level.pins.corners.push_back(corners[v]);
      level.pins.weights.push_back({});
      mass = 0.0;
    }
    const double before = mass / (mass + masses[v]);
    mass += masses[v];
    std::array<double, 4>& weights = level.pins.weights.back();
    for (std::size_t c = 0; c < 4; ++c) {
      weights[c] = before * weights[c] + (1.0 - before) * embedding.weights[v][c];
    }
  }
}

Level build_level(const Organ& organ, const RestShape& finest, const RestShape& finer, double edge) {
  const HeldPlaces held = held_places(finest, pin_spacing * edge);
  std::vector<Vector3> covered = finer.positions;
  covered.insert(covered.end(), held.places.begin(), held.places.end());
  const Lattice lattice = cover(organ.solid, covered, edge);
  Level level;
  level.edge = edge;
  level.finer = embed(finer.positions, lattice);
  level.bearing = level.finer;
  RestShape& shape = level.shape;
  shape.positions = lattice.mesh.vertices;
  shape.mass.assign(shape.positions.size(), 0.0);
  shape.mean_edge = edge;
  shape.size = finer.size;
  LameModuli moduli = lame_moduli(organ.material.young, organ.material.poisson);
  moduli.mu *= coarse_modulus;
  moduli.lambda *= coarse_modulus;
  for (std::size_t t = 0; t < lattice.mesh.tetrahedra.size(); ++t) {
    const Tetrahedron& corners = lattice.mesh.tetrahedra[t];
    const double fill = std::max(lattice.fill[t], least_fill);
    std::array<Vector3, 4> x;
    for (std::size_t i = 0; i < 4; ++i) x[i] = shape.positions[corners[i]];
    const double mass = organ.material.density * fill * tetrahedron_volume(x[0], x[1], x[2], x[3]);
    for (const int corner : corners) shape.mass[corner] += 0.25 * mass;
    shape.tetrahedra.push_back(NeoHookeanElement::at_rest(corners, x, {fill * moduli.mu, fill * moduli.lambda}));
  }
  shape.attached.assign(shape.positions.size(), 0);  // pins hold it
  add_pins(held, lattice, level);
  for (std::size_t v = 0; v < level.bearing.weights.size(); ++v) {
    std::array<double, 4>& weights = level.bearing.weights[v];
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) sum += weights[i] *= shape.mass[level.bearing.corners[v][i]];
    for (double& weight : weights) weight /= sum;
  }
  for (std::size_t v = 0; v < shape.mass.size(); ++v) {
    shape.inverse_mass.push_back(1.0 / shape.mass[v]);
    shape.total_mass += shape.mass[v];
  }
  shape.fastest_frequency = fastest_frequency(shape);
  shape.damping_time = 2.0 * organ.material.damping / shape.fastest_frequency;
  shape.stable_substep = stable_substep(shape, solid_safety);
  shape.stiffest_element = stiffest_element(shape, shape.positions);
  shape.cubes = pack(lattice, shape.tetrahedra);
  return level;
}

}  // namespace

RegionSize region_size(double tolerance) {
  // A radius of 3 cells of the coarser level, each twice the edge of the finer, made errors of 1 to 3 % in the force, 3
  // to 4 % near the contact and 10 to 12 % over a whole block bonded to the ground; 4 cells a third of that.
  const double cells = std::max(least_cells, 2.5 + (0.05 - tolerance) / 0.03);
  return {2.0 * cells, cells};
}

double fine_edge(const RestShape& shape) {
  struct Sized {
    double volume;
    const NeoHookeanElement* element;
  };
  std::vector<Sized> finest;
  for (const NeoHookeanElement& element : shape.tetrahedra) finest.push_back({element.volume, &element});
  // Stable, so that a tie leaves the same ones on every machine.
  std::stable_sort(finest.begin(), finest.end(), [](const Sized& a, const Sized& b) { return a.volume < b.volume; });
  finest.resize((finest.size() + finest_part - 1) / finest_part);
  std::vector<double> edges;
  for (const Sized& sized : finest) {
    const auto& corners = sized.element->vertices;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i + 1; j < 4; ++j) {
        edges.push_back((shape.positions[corners[j]] - shape.positions[corners[i]]).norm());
      }
    }
  }
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

std::vector<Level> build_levels(const Organ& organ, const RestShape& finest) {
  std::vector<Level> levels;
  const RegionSize size = region_size(*organ.levels_tolerance);
  const double volume = volume_of(finest);
  double edge = fine_edge(finest);
  while (half_ball(size.edges * edge) < largest_part * volume) {
    edge *= size.edges / size.cells;
    levels.push_back(build_level(organ, finest, levels.empty() ? finest : levels.back().shape, edge));
  }
  return levels;
}

}  // namespace tissue_sim
