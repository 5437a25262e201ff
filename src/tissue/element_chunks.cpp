#include "tissue_sim/tissue/element_chunks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

namespace {

constexpr int vertex_floats = 8;  // constraints say where a vertex's floats begin

std::array<IntLanes, 4>& vertices_of(PairBatch& batch) {
  return batch.flap.vertices;
}
template <class Batch>
auto& vertices_of(Batch& batch) {
  return batch.vertices;
}

template <class Batch, class Visit>
void visit_range(std::vector<Batch>& batches, const BatchRange& range, int floats, const Visit& visit) {
  for (std::size_t b = range.first; b < range.first + range.count; ++b) {
    for (auto& row : vertices_of(batches[b])) {
      for (int& at : row) at = floats * visit(at / floats);
    }
  }
}

/// Puts visit(vertex) in the place of every vertex of the chunk's elements.
template <class Visit>
void visit_vertices(const ElementChunk& chunk, NeoHookeanSolid& solid, ConstraintBatches& constraints,
                    const Visit& visit) {
  visit_range(solid.batches, chunk.tetrahedra, 1, visit);
  visit_range(constraints.pairs, chunk.constraints.pairs, vertex_floats, visit);
  visit_range(constraints.flaps, chunk.constraints.flaps, vertex_floats, visit);
  visit_range(constraints.triangles, chunk.constraints.triangles, vertex_floats, visit);
  visit_range(constraints.distances, chunk.constraints.distances, vertex_floats, visit);
}

/// How long an element takes with what shares its lane, as floating point operations.
constexpr double pair_weight = 527.0;
constexpr double flap_weight = 205.0;
constexpr double triangle_weight = 205.0;
constexpr double distance_weight = 48.0;
constexpr double tetrahedron_weight = 198.0;

/// An element, with what shares its lane.
struct Placed {
  int rank = 0;  ///< along the curve
  std::size_t batch = 0;
  std::size_t lane = 0;
};

/// Lanes without an element have all corners in one vertex.
template <class Rows>
bool is_empty(const Rows& rows, std::size_t l) {
  return rows[0][l] == rows[1][l];
}

/// Where a kind's elements are, those without one left out.
template <class Batch>
void place(std::vector<Batch>& batches, int floats, std::size_t most, const std::vector<Vector3>& rest,
           std::vector<Placed>& placed, std::vector<Vector3>& middles) {
  for (std::size_t b = 0; b < batches.size(); ++b) {
    const auto& rows = vertices_of(batches[b]);
    for (std::size_t l = 0; l < constraint_lanes && b * constraint_lanes + l < most; ++l) {
      if (is_empty(rows, l)) continue;
      Vector3 sum = Vector3::Zero();
      for (const auto& row : rows) sum += rest[row[l] / floats];
      placed.push_back({static_cast<int>(middles.size()), b, l});
      middles.push_back(sum / static_cast<double>(rows.size()));
    }
  }
}

/// Puts a kind's elements in the order of their ranks. What had none stays at the end.
template <class Batch>
void sort_lanes(std::vector<Batch>& batches, std::vector<Placed>& placed) {
  static_assert(std::is_trivially_copyable<Batch>::value && sizeof(Batch) % (4 * constraint_lanes) == 0,
                "a batch is rows of lanes of four bytes");
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) { return a.rank < b.rank; });
  const std::vector<Batch> before = batches;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const char* from = reinterpret_cast<const char*>(&before[placed[i].batch]) + 4 * placed[i].lane;
    char* to = reinterpret_cast<char*>(&batches[i / constraint_lanes]) + 4 * (i % constraint_lanes);
    for (std::size_t row = 0; row < sizeof(Batch); row += 4 * constraint_lanes) std::memcpy(to + row, from + row, 4);
  }
}

/// The batches of sorted elements between two ranks, by their first ones.
BatchRange between(const std::vector<Placed>& placed, int from, int to) {
  const auto batch_of = [&](int rank) {
    const auto at = std::lower_bound(placed.begin(), placed.end(), rank,
                                     [](const Placed& element, int r) { return element.rank < r; });
    return (static_cast<std::size_t>(at - placed.begin()) + constraint_lanes - 1) / constraint_lanes;
  };
  const std::size_t first = batch_of(from);
  return {first, batch_of(to) - first};
}

constexpr std::size_t kinds = 5;

std::vector<ElementChunk> sort_into_chunks(int chunks, const std::vector<Vector3>& rest, NeoHookeanSolid& solid,
                                           ConstraintBatches& constraints) {
  static_assert(NeoHookeanBatch::lanes == constraint_lanes, "one way to sort them all");
  constexpr std::array<double, kinds> weights = {tetrahedron_weight, pair_weight, flap_weight, triangle_weight,
                                                 distance_weight};
  constexpr std::size_t all = std::numeric_limits<std::size_t>::max();
  std::array<std::vector<Placed>, kinds> placed;
  std::vector<Vector3> middles;
  place(solid.batches, 1, solid.tetrahedra, rest, placed[0], middles);
  place(constraints.pairs, vertex_floats, all, rest, placed[1], middles);
  place(constraints.flaps, vertex_floats, all, rest, placed[2], middles);
  place(constraints.triangles, vertex_floats, all, rest, placed[3], middles);
  place(constraints.distances, vertex_floats, all, rest, placed[4], middles);

  const std::vector<int> curve = along_curve(middles);
  std::vector<int> rank_of(curve.size());
  for (std::size_t i = 0; i < curve.size(); ++i) rank_of[static_cast<std::size_t>(curve[i])] = static_cast<int>(i);
  std::vector<double> weight_at(curve.size());
  double total = 0.0;
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    for (Placed& element : placed[kind]) {
      element.rank = rank_of[static_cast<std::size_t>(element.rank)];
      weight_at[static_cast<std::size_t>(element.rank)] = weights[kind];
      total += weights[kind];
    }
  }
  sort_lanes(solid.batches, placed[0]);
  sort_lanes(constraints.pairs, placed[1]);
  sort_lanes(constraints.flaps, placed[2]);
  sort_lanes(constraints.triangles, placed[3]);
  sort_lanes(constraints.distances, placed[4]);

  std::vector<ElementChunk> sorted;
  int from = 0;
  double before = 0.0;
  for (int c = 1; c <= chunks; ++c) {
    int to = from;
    for (; to < static_cast<int>(curve.size()) && (c == chunks || before < total * c / chunks); ++to) {
      before += weight_at[static_cast<std::size_t>(to)];
    }
    sorted.push_back({between(placed[0], from, to),
                      {between(placed[1], from, to), between(placed[2], from, to), between(placed[3], from, to),
                       between(placed[4], from, to)}});
    from = to;
  }
  return sorted;
}

}  // namespace

ElementChunks cut_into_chunks(int chunks, const std::vector<Vector3>& rest, NeoHookeanSolid& solid,
                              ConstraintBatches& constraints) {
  const int vertices = static_cast<int>(rest.size());
  const auto count = static_cast<std::size_t>(chunks);
  ElementChunks cut;
  cut.chunks = sort_into_chunks(chunks, rest, solid, constraints);

  // Whose vertex it is, the first chunk's that has it, and which others have it too.
  std::vector<int> owner(static_cast<std::size_t>(vertices), -1);
  std::vector<int> last(static_cast<std::size_t>(vertices), -1);
  std::vector<std::pair<int, int>> shared;  // vertex, chunk
  for (int c = 0; c < chunks; ++c) {
    visit_vertices(cut.chunks[static_cast<std::size_t>(c)], solid, constraints, [&](int v) {
      if (owner[v] < 0) owner[v] = c;
      if (owner[v] != c && last[v] != c) shared.push_back({v, c});
      last[v] = c;
      return v;
    });
  }
  std::sort(shared.begin(), shared.end());
  cut.stand_ins = static_cast<int>(shared.size());
  std::vector<std::vector<std::pair<int, int>>> of_chunk(count);  // vertex, stand-in
  for (int i = 0; i < cut.stand_ins; ++i) {
    const auto [vertex, chunk] = shared[static_cast<std::size_t>(i)];
    if (cut.seams.empty() || cut.seams.back().vertex != vertex) cut.seams.push_back({vertex, vertices + i, 0});
    ++cut.seams.back().stand_ins;
    of_chunk[static_cast<std::size_t>(chunk)].push_back({vertex, vertices + i});
  }

  std::vector<int> stand_in_of(static_cast<std::size_t>(vertices));
  for (std::size_t c = 0; c < count; ++c) {
    for (const auto& [vertex, stand_in] : of_chunk[c]) stand_in_of[vertex] = stand_in;
    visit_vertices(cut.chunks[c], solid, constraints,
                   [&](int v) { return owner[v] == static_cast<int>(c) ? v : stand_in_of[v]; });
  }
  return cut;
}

}  // namespace tissue_sim
