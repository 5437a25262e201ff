#include "tissue_sim/tissue/solid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tissue_sim/tissue/patch_test.h"

namespace tissue_sim {

namespace {

/// Smallest height over longest edge below which a tetrahedron is a sliver; 0.82 is regular, 0.41 a cut cube's.
constexpr double sliver_height = 0.1;

constexpr std::array<std::array<int, 2>, 6> corner_pairs = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

using Corners = std::array<Vector3, 4>;

double smallest_height(const Corners& x, double volume) {
  const double twice_largest_face =
      std::max({area_normal(x[0], x[1], x[2]).norm(), area_normal(x[0], x[1], x[3]).norm(),
                area_normal(x[0], x[2], x[3]).norm(), area_normal(x[1], x[2], x[3]).norm()});
  return 6.0 * volume / twice_largest_face;
}

/// 1, or less for a sliver.
double softened(const Corners& x, double volume) {
  const double longest = std::sqrt(squared_longest_edge(x[0], x[1], x[2], x[3]));
  const double ratio = smallest_height(x, volume) / (sliver_height * longest);
  return std::min(1.0, ratio * ratio);
}

struct SolidEdge {
  Edge vertices{};
  double weight = 0.0;  ///< m^3, a sixth of the tetrahedra at the edge, slivers as far as they count
};

/// Every edge once, ascending.
std::vector<SolidEdge> merge(std::vector<SolidEdge> edges) {
  std::stable_sort(edges.begin(), edges.end(),
                   [](const SolidEdge& a, const SolidEdge& b) { return a.vertices < b.vertices; });
  std::vector<SolidEdge> merged;
  for (const SolidEdge& edge : edges) {
    if (merged.empty() || merged.back().vertices != edge.vertices) merged.push_back({edge.vertices, 0.0});
    merged.back().weight += edge.weight;
  }
  return merged;
}

/// Distance and volume elements on cut cubes or on a mesher's tetrahedra come out up to a seventh too soft or too
/// stiff, since their stiffness is right only in the mean over all directions. The organ is stretched and sheared
/// between its ends along each axis, and the mean of its energy over that of neo-Hookean tetrahedra on the same mesh
/// corrects it.
void correct_stiffness(const Organ& organ, RestShape& shape) {
  RestShape exact;
  exact.positions = shape.positions;
  exact.first_simulated = shape.first_simulated;
  exact.mass.assign(shape.positions.size(), 0.0);
  Organ reference = organ;
  reference.model = Model::fem;
  add_solid(reference, exact);

  double sum = 0.0;
  int tests = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int along : {axis, (axis + 1) % 3}) {
      const PatchTest test = pull_ends(shape, axis, along);
      sum += patch_energy(shape, test) / patch_energy(exact, test);
      ++tests;
    }
  }
  shape.stiffness_correction = tests / sum;
  for (DistanceElement& element : shape.distances) element.stiffness *= shape.stiffness_correction;
  for (VolumeElement& element : shape.volumes) element.stiffness *= shape.stiffness_correction;
}

}  // namespace

void add_solid(const Organ& organ, RestShape& shape) {
  const LameModuli moduli = lame_moduli(organ.material.young, organ.material.poisson);
  std::vector<SolidEdge> edges;
  for (const Tetrahedron& tetrahedron : organ.solid.tetrahedra) {
    Tetrahedron corners = tetrahedron;
    Corners x;
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] += shape.first_simulated;
      x[i] = shape.positions[corners[i]];
    }
    const double volume = tetrahedron_volume(x[0], x[1], x[2], x[3]);
    const double share = softened(x, volume);
    for (const int corner : corners) shape.mass[corner] += 0.25 * organ.material.density * volume;
    if (organ.model == Model::fem) {
      shape.tetrahedra.push_back(NeoHookeanElement::at_rest(corners, x, {share * moduli.mu, share * moduli.lambda}));
      continue;
    }
    VolumeElement element;
    element.vertices = corners;
    element.rest = volume;
    element.scale = volume;
    element.stiffness = share * (moduli.lambda - moduli.mu) * volume;
    shape.volumes.push_back(element);
    for (const auto& [i, j] : corner_pairs) {
      const Edge edge = {std::min(corners[i], corners[j]), std::max(corners[i], corners[j])};
      edges.push_back({edge, share * volume / 6.0});
    }
  }
  for (const SolidEdge& edge : merge(std::move(edges))) {
    DistanceElement element;
    element.vertices = edge.vertices;
    element.rest = (shape.positions[edge.vertices[1]] - shape.positions[edge.vertices[0]]).norm();
    element.scale = element.rest;
    element.stiffness = 15.0 * moduli.mu * edge.weight;
    shape.distances.push_back(element);
  }
  if (organ.model == Model::volume) correct_stiffness(organ, shape);
}

}  // namespace tissue_sim
