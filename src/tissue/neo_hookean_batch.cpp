#include "tissue_sim/tissue/neo_hookean_batch.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "neo_hookean_lanes.h"
#include "tissue_sim/tissue/neo_hookean_corners.h"

namespace tissue_sim {
namespace {

constexpr std::size_t lanes = NeoHookeanBatch::lanes;
constexpr std::size_t block = 4;               // batches that are gathered, computed and scattered together
constexpr std::size_t stride = block * lanes;  // floats in a row of them

TISSUE_SIM_INLINE const float* at(const float* vectors, int vertex) {
  return vectors + 4 * static_cast<std::size_t>(vertex);
}
TISSUE_SIM_INLINE float* at(float* vectors, int vertex) {
  return vectors + 4 * static_cast<std::size_t>(vertex);
}

/// u1 - u0, u2 - u0, u3 - u0 of the tetrahedron in lane l.
TISSUE_SIM_INLINE void edges_of(const NeoHookeanBatch& batch, std::size_t l, const float* displacements, Quad& e1,
                                Quad& e2, Quad& e3) {
  const Quad origin = quad(at(displacements, batch.vertices[0][l]));
  e1 = quad(at(displacements, batch.vertices[1][l])) - origin;
  e2 = quad(at(displacements, batch.vertices[2][l])) - origin;
  e3 = quad(at(displacements, batch.vertices[3][l])) - origin;
}

/// Takes the pulls on corners 1 to 3, and what balances them at corner 0, from the forces of the tetrahedron in lane l.
TISSUE_SIM_INLINE void subtract(const NeoHookeanBatch& batch, std::size_t l, const Quad& p1, const Quad& p2,
                                const Quad& p3, float* forces) {
  quad(at(forces, batch.vertices[0][l])) += p1 + p2 + p3;
  quad(at(forces, batch.vertices[1][l])) -= p1;
  quad(at(forces, batch.vertices[2][l])) -= p2;
  quad(at(forces, batch.vertices[3][l])) -= p3;
}

TISSUE_SIM_INLINE void gather(const NeoHookeanBatch& batch, const float* displacements, float* rows) {
  for (std::size_t l = 0; l < lanes; l += 4) {
    Quad a1, a2, a3, b1, b2, b3, c1, c2, c3, d1, d2, d3;
    edges_of(batch, l, displacements, a1, a2, a3);
    edges_of(batch, l + 1, displacements, b1, b2, b3);
    edges_of(batch, l + 2, displacements, c1, c2, c3);
    edges_of(batch, l + 3, displacements, d1, d2, d3);
    to_rows<stride>(a1, b1, c1, d1, rows + l);
    to_rows<stride>(a2, b2, c2, d2, rows + l + 3 * stride);
    to_rows<stride>(a3, b3, c3, d3, rows + l + 6 * stride);
  }
}

TISSUE_SIM_INLINE void scatter(const NeoHookeanBatch& batch, std::size_t count, const float* rows, float* forces) {
  for (std::size_t l = 0; l < count; l += 4) {
    Quad a1, a2, a3, b1, b2, b3, c1, c2, c3, d1, d2, d3;
    from_rows<stride>(rows + l, a1, b1, c1, d1);
    from_rows<stride>(rows + l + 3 * stride, a2, b2, c2, d2);
    from_rows<stride>(rows + l + 6 * stride, a3, b3, c3, d3);
    subtract(batch, l, a1, a2, a3, forces);
    if (l + 1 < count) subtract(batch, l + 1, b1, b2, b3, forces);
    if (l + 2 < count) subtract(batch, l + 2, c1, c2, c3, forces);
    if (l + 3 < count) subtract(batch, l + 3, d1, d2, d3, forces);
  }
}

/// As above, with eight lanes: two tetrahedra in a register, l and l + 4.
TISSUE_SIM_INLINE void edges_of_two(const NeoHookeanBatch& batch, std::size_t l, const float* displacements, Eight& e1,
                                    Eight& e2, Eight& e3) {
  const auto corner_of_two = [&](std::size_t i, Eight & corner) __attribute__((always_inline)) {
    const auto& vertices = batch.vertices[i];
    join(quad(at(displacements, vertices[l])), quad(at(displacements, vertices[l + 4])), corner);
  };
  Eight origin;
  corner_of_two(0, origin);
  corner_of_two(1, e1);
  corner_of_two(2, e2);
  corner_of_two(3, e3);
  e1 -= origin;
  e2 -= origin;
  e3 -= origin;
}

TISSUE_SIM_INLINE void gather_eight(const NeoHookeanBatch& batch, const float* displacements, float* rows) {
  Eight a1, a2, a3, b1, b2, b3, c1, c2, c3, d1, d2, d3;
  edges_of_two(batch, 0, displacements, a1, a2, a3);
  edges_of_two(batch, 1, displacements, b1, b2, b3);
  edges_of_two(batch, 2, displacements, c1, c2, c3);
  edges_of_two(batch, 3, displacements, d1, d2, d3);
  to_rows<stride>(a1, b1, c1, d1, rows);
  to_rows<stride>(a2, b2, c2, d2, rows + 3 * stride);
  to_rows<stride>(a3, b3, c3, d3, rows + 6 * stride);
}

TISSUE_SIM_INLINE void scatter_eight(const NeoHookeanBatch& batch, std::size_t count, const float* rows,
                                     float* forces) {
  if (count < lanes) return scatter(batch, count, rows, forces);
  Eight p[3][4];
  for (std::size_t i = 0; i < 3; ++i) from_rows<stride>(rows + 3 * i * stride, p[i][0], p[i][1], p[i][2], p[i][3]);
  Quad low[3][4], high[3][4];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t l = 0; l < 4; ++l) part(p[i][l], low[i][l], high[i][l]);
  }
  for (std::size_t l = 0; l < 4; ++l) subtract(batch, l, low[0][l], low[1][l], low[2][l], forces);
  for (std::size_t l = 0; l < 4; ++l) subtract(batch, l + 4, high[0][l], high[1][l], high[2][l], forces);
}

/// a p + b q + c r, left to right.
template <class Lane>
TISSUE_SIM_INLINE void combine(const Lane& a, const Three<Lane>& p, const Lane& b, const Three<Lane>& q, const Lane& c,
                               const Three<Lane>& r, Three<Lane>& sum) {
  sum.x = a * p.x + b * q.x + c * r.x;
  sum.y = a * p.y + b * q.y + c * r.y;
  sum.z = a * p.z + b * q.z + c * r.z;
}

template <class Lane>
TISSUE_SIM_INLINE void store(const Three<Lane>& v, float* row) {
  *reinterpret_cast<Lane*>(row) = v.x;
  *reinterpret_cast<Lane*>(row + stride) = v.y;
  *reinterpret_cast<Lane*>(row + 2 * stride) = v.z;
}

/// What never changes of tetrahedra, one a lane.
template <class Lane>
struct Constants {
  Lane inverse_rest[9];
  Lane volume_mu;
  Lane volume_stiff;
};

/// Of a batch's lanes from l on.
template <class Lane>
TISSUE_SIM_INLINE void load(const NeoHookeanBatch& batch, std::size_t l, Constants<Lane>& constants) {
  for (std::size_t i = 0; i < 9; ++i) constants.inverse_rest[i] = lane<Lane>(&batch.inverse_rest[i][l]);
  constants.volume_mu = lane<Lane>(&batch.volume_mu[l]);
  constants.volume_stiff = lane<Lane>(&batch.volume_stiff[l]);
}

/// Of all lanes of two batches.
TISSUE_SIM_INLINE void load_two(const NeoHookeanBatch& low, const NeoHookeanBatch& high,
                                Constants<Sixteen>& constants) {
  for (std::size_t i = 0; i < 9; ++i) {
    join(lane<Eight>(low.inverse_rest[i].data()), lane<Eight>(high.inverse_rest[i].data()), constants.inverse_rest[i]);
  }
  join(lane<Eight>(low.volume_mu.data()), lane<Eight>(high.volume_mu.data()), constants.volume_mu);
  join(lane<Eight>(low.volume_stiff.data()), lane<Eight>(high.volume_stiff.data()), constants.volume_stiff);
}

/// Replaces the edges by the pull of the tissue on corners 1 to 3: the gradient of the energy there.
template <class Lane>
TISSUE_SIM_INLINE void pull(const Constants<Lane>& constants, float* edges) {
  const Lane* d = constants.inverse_rest;
  const Three<Lane> e1{lane<Lane>(edges), lane<Lane>(edges + stride), lane<Lane>(edges + 2 * stride)};
  const Three<Lane> e2{lane<Lane>(edges + 3 * stride), lane<Lane>(edges + 4 * stride), lane<Lane>(edges + 5 * stride)};
  const Three<Lane> e3{lane<Lane>(edges + 6 * stride), lane<Lane>(edges + 7 * stride), lane<Lane>(edges + 8 * stride)};
  Three<Lane> h0, h1, h2;  // columns of H
  combine(d[0], e1, d[3], e2, d[6], e3, h0);
  combine(d[1], e1, d[4], e2, d[7], e3, h1);
  combine(d[2], e1, d[5], e2, d[8], e3, h2);
  Three<Lane> p0, p1, p2;
  stress(h0, h1, h2, constants.volume_mu, constants.volume_stiff, p0, p1, p2);
  Three<Lane> f;
  combine(d[0], p0, d[1], p1, d[2], p2, f);
  store(f, edges);
  combine(d[3], p0, d[4], p1, d[5], p2, f);
  store(f, edges + 3 * stride);
  combine(d[6], p0, d[7], p1, d[8], p2, f);
  store(f, edges + 6 * stride);
}

/// The same for a batch, a register's worth of lanes at a time.
template <class Lane>
TISSUE_SIM_INLINE void pull_in_parts(const NeoHookeanBatch& batch, float* edges) {
  for (std::size_t l = 0; l < lanes; l += sizeof(Lane) / sizeof(float)) {
    Constants<Lane> constants;
    load(batch, l, constants);
    pull(constants, edges + l);
  }
}

/// Which batches: some that follow each other, or those of a list.
struct BatchesInARow {
  std::size_t first;
  std::size_t count;
  std::size_t operator[](std::size_t i) const { return first + i; }
};
struct ListedBatches {
  const int* list;
  std::size_t count;
  std::size_t operator[](std::size_t i) const { return static_cast<std::size_t>(list[i]); }
};

/// How a few batches, side by side in rows of edges, are computed: each by itself, or two in one register.
template <class Lane>
struct OneByOne {
  static constexpr bool eight = sizeof(Lane) >= sizeof(Eight);  ///< lanes are gathered and scattered at once
  TISSUE_SIM_INLINE static void pull_all(const NeoHookeanBatch* const* batches, std::size_t count, float* rows) {
    for (std::size_t b = 0; b < count; ++b) pull_in_parts<Lane>(*batches[b], rows + lanes * b);
  }
};
struct TwoByTwo {
  static constexpr bool eight = true;
  TISSUE_SIM_INLINE static void pull_all(const NeoHookeanBatch* const* batches, std::size_t count, float* rows) {
    std::size_t b = 0;
    for (; b + 1 < count; b += 2) {
      Constants<Sixteen> constants;
      load_two(*batches[b], *batches[b + 1], constants);
      pull(constants, rows + lanes * b);
    }
    if (b < count) pull_in_parts<Eight>(*batches[b], rows + lanes * b);
  }
};

/// Gathers a few batches, computes them, scatters them. Rows that were written in halves a moment ago cannot be read
/// whole without a stall: batch by batch it took 7.6 ns a tetrahedron and not 6.5 (20,000 of them, AVX2, one core of an
/// AMD EPYC, Zen 4). Corner forces kept for a second pass, a sum for each vertex, took 7.7; tetrahedra in random order
/// take 6.9.
template <class Few, class Chosen>
TISSUE_SIM_INLINE void add_forces(const NeoHookeanSolid& solid, const Chosen& chosen, const float* displacements,
                                  float* forces) {
  alignas(64) float rows[9 * stride];
  const NeoHookeanBatch* batches[block];
  for (std::size_t first = 0; first < chosen.count; first += block) {
    const std::size_t count = std::min(block, chosen.count - first);
    for (std::size_t b = 0; b < count; ++b) batches[b] = &solid.batches[chosen[first + b]];
    for (std::size_t b = 0; b < count; ++b) {
      Few::eight ? gather_eight(*batches[b], displacements, rows + lanes * b)
                 : gather(*batches[b], displacements, rows + lanes * b);
    }
    Few::pull_all(batches, count, rows);
    for (std::size_t b = 0; b < count; ++b) {
      const std::size_t tetrahedra = std::min(lanes, solid.tetrahedra - lanes * chosen[first + b]);
      Few::eight ? scatter_eight(*batches[b], tetrahedra, rows + lanes * b, forces)
                 : scatter(*batches[b], tetrahedra, rows + lanes * b, forces);
    }
  }
}

template <class Chosen>
__attribute__((noinline)) void add_forces_baseline(const NeoHookeanSolid& solid, const Chosen& chosen,
                                                   const float* displacements, float* forces) {
  add_forces<OneByOne<Four>>(solid, chosen, displacements, forces);
}
#ifdef __x86_64__
template <class Chosen>
__attribute__((target("avx2"))) void add_forces_avx2(const NeoHookeanSolid& solid, const Chosen& chosen,
                                                     const float* displacements, float* forces) {
  add_forces<OneByOne<Eight>>(solid, chosen, displacements, forces);
}
template <class Chosen>
__attribute__((target("avx512f,avx512dq,avx512vl"))) void add_forces_avx512(const NeoHookeanSolid& solid,
                                                                            const Chosen& chosen,
                                                                            const float* displacements, float* forces) {
  add_forces<TwoByTwo>(solid, chosen, displacements, forces);
}
#endif

template <class Chosen>
void add_chosen(const NeoHookeanSolid& solid, const Chosen& chosen, const float* displacements, float* forces,
                InstructionSet set) {
  if (!available(set)) {
    throw std::invalid_argument(std::string("add_neo_hookean_forces: this processor has no ") + name(set));
  }
#ifdef __x86_64__
  const TinyIsZero tiny_is_zero;
  if (set == InstructionSet::avx512) return add_forces_avx512(solid, chosen, displacements, forces);
  if (set == InstructionSet::avx2) return add_forces_avx2(solid, chosen, displacements, forces);
#endif
  add_forces_baseline(solid, chosen, displacements, forces);
}

}  // namespace

NeoHookeanSolid pack(const std::vector<NeoHookeanElement>& elements) {
  NeoHookeanSolid solid;
  solid.tetrahedra = elements.size();
  solid.batches.resize((elements.size() + lanes - 1) / lanes);
  for (std::size_t t = 0; t < lanes * solid.batches.size(); ++t) {
    const NeoHookeanElement& element = elements[std::min(t, elements.size() - 1)];
    NeoHookeanBatch& batch = solid.batches[t / lanes];
    const std::size_t l = t % lanes;
    for (std::size_t corner = 0; corner < 4; ++corner) batch.vertices[corner][l] = element.vertices[corner];
    for (std::size_t i = 0; i < 9; ++i) {
      const auto row = static_cast<Eigen::Index>(i / 3);
      const auto column = static_cast<Eigen::Index>(i % 3);
      batch.inverse_rest[i][l] = static_cast<float>(element.inverse_rest(row, column));
    }
    batch.volume_mu[l] = static_cast<float>(element.volume * element.moduli.mu);
    batch.volume_stiff[l] = static_cast<float>(element.volume * (element.moduli.lambda + element.moduli.mu));
  }
  return solid;
}

void add_neo_hookean_forces(const NeoHookeanSolid& solid, const float* displacements, float* forces,
                            InstructionSet set) {
  add_chosen(solid, BatchesInARow{0, solid.batches.size()}, displacements, forces, set);
}

void add_neo_hookean_forces(const NeoHookeanSolid& solid, BatchRange batches, const float* displacements, float* forces,
                            InstructionSet set) {
  add_chosen(solid, BatchesInARow{batches.first, batches.count}, displacements, forces, set);
}

void add_neo_hookean_forces(const NeoHookeanSolid& solid, const std::vector<int>& batches, const float* displacements,
                            float* forces, InstructionSet set) {
  add_chosen(solid, ListedBatches{batches.data(), batches.size()}, displacements, forces, set);
}

}  // namespace tissue_sim
