#include "tissue_sim/tissue/neo_hookean_corners.h"

#include <stdexcept>
#include <string>

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include "lanes.h"

namespace tissue_sim {
namespace {

constexpr std::size_t lanes = CornerBatch::lanes;

/// What a vertex sees, one value a lane: its gradient and the upper half of its block.
template <class Lane>
struct Sums {
  Three<Lane> gradient{};
  Lane xx{}, xy{}, xz{}, yy{}, yz{}, zz{};
};

template <class Lane>
TISSUE_SIM_INLINE void subtract(const Three<Lane>& a, const Three<Lane>& b, Three<Lane>& difference) {
  difference.x = a.x - b.x;
  difference.y = a.y - b.y;
  difference.z = a.z - b.z;
}

template <class Lane>
TISSUE_SIM_INLINE void load(const CornerBatch& batch, std::size_t l, std::size_t other, Three<Lane>& gradient) {
  gradient.x = lane<Lane>(&batch.gradients[3 * other][l]);
  gradient.y = lane<Lane>(&batch.gradients[3 * other + 1][l]);
  gradient.z = lane<Lane>(&batch.gradients[3 * other + 2][l]);
}

/// A row of H, the gradient of the displacements: one component of the edges against the shape gradients.
template <class Lane>
TISSUE_SIM_INLINE void combine(const Lane& e1, const Three<Lane>& g1, const Lane& e2, const Three<Lane>& g2,
                               const Lane& e3, const Three<Lane>& g3, Three<Lane>& row) {
  row.x = e1 * g1.x + e2 * g2.x + e3 * g3.x;
  row.y = e1 * g1.y + e2 * g2.y + e3 * g3.y;
  row.z = e1 * g1.z + e2 * g2.z + e3 * g3.z;
}

/// Adds what our corner sees of the tetrahedra from lane l on, given u_i - u of the others. With H = F - 1, K its
/// cofactors, C = 1 + tr H - H^T + K those of F and our own shape gradient g,
///   J - 1 = tr H + tr K + det H,  V P g = V (mu H g + t (K g - H^T g) + (s + t tr H) g),
/// where s = L (J - 1) and t = s - mu: nothing of size one is subtracted, see neo_hookean_batch.cpp. The shape
/// gradients sum to zero, so with D the determinant of the others' and w = (e2 - e1) x (e3 - e1), K g = -D w and det H
/// = D e1 . w: K itself is not needed.
template <class Lane>
TISSUE_SIM_INLINE void add(const CornerBatch& batch, std::size_t l, const Three<Lane>& e1, const Three<Lane>& e2,
                           const Three<Lane>& e3, Sums<Lane>& sums) {
  Three<Lane> g1, g2, g3;
  load(batch, l, 0, g1);
  load(batch, l, 1, g2);
  load(batch, l, 2, g3);
  Three<Lane> hx, hy, hz;  // rows of H
  combine(e1.x, g1, e2.x, g2, e3.x, g3, hx);
  combine(e1.y, g1, e2.y, g2, e3.y, g3, hy);
  combine(e1.z, g1, e2.z, g2, e3.z, g3, hz);
  const Three<Lane> minus_g{g1.x + g2.x + g3.x, g1.y + g2.y + g3.y, g1.z + g2.z + g3.z};
  Three<Lane> d2, d3, w;
  subtract(e2, e1, d2);
  subtract(e3, e1, d3);
  cross(d2, d3, w);
  const Lane& det = lane<Lane>(&batch.determinant[l]);
  const Lane& mu = lane<Lane>(&batch.volume_mu[l]);
  const Lane& stiff = lane<Lane>(&batch.volume_stiff[l]);
  const Lane trace = hx.x + hy.y + hz.z;
  const Lane minors = (hx.x * hy.y - hx.y * hy.x) + (hx.x * hz.z - hx.z * hz.x) + (hy.y * hz.z - hy.z * hz.y);
  const Lane stretch = trace + minors + det * (e1.x * w.x + e1.y * w.y + e1.z * w.z);
  const Lane s = stiff * stretch;
  const Lane t = s - mu;
  const Lane diagonal = s + t * trace;
  const Three<Lane> h_g{hx.x * minus_g.x + hx.y * minus_g.y + hx.z * minus_g.z,  // -H g
                        hy.x * minus_g.x + hy.y * minus_g.y + hy.z * minus_g.z,
                        hz.x * minus_g.x + hz.y * minus_g.y + hz.z * minus_g.z};
  const Three<Lane> q{(hx.x * minus_g.x + hy.x * minus_g.y + hz.x * minus_g.z) - det * w.x,  // K g - H^T g
                      (hx.y * minus_g.x + hy.y * minus_g.y + hz.y * minus_g.z) - det * w.y,
                      (hx.z * minus_g.x + hy.z * minus_g.y + hz.z * minus_g.z) - det * w.z};
  sums.gradient.x += t * q.x - mu * h_g.x - diagonal * minus_g.x;
  sums.gradient.y += t * q.y - mu * h_g.y - diagonal * minus_g.y;
  sums.gradient.z += t * q.z - mu * h_g.z - diagonal * minus_g.z;
  const Lane grown = trace + 1.0F;
  const Three<Lane> c{q.x - grown * minus_g.x, q.y - grown * minus_g.y, q.z - grown * minus_g.z};  // C g
  const Three<Lane> stiff_c{stiff * c.x, stiff * c.y, stiff * c.z};
  sums.xx += stiff_c.x * c.x;
  sums.xy += stiff_c.x * c.y;
  sums.xz += stiff_c.x * c.z;
  sums.yy += stiff_c.y * c.y;
  sums.yz += stiff_c.y * c.z;
  sums.zz += stiff_c.z * c.z;
}

/// Four values of four lanes each, the lanes added: (0 + 2) + (1 + 3).
TISSUE_SIM_INLINE void add_lanes(const Four& a, const Four& b, const Four& c, const Four& d, Four& sums) {
  const Four ab = TISSUE_SIM_SHUFFLE(a, b, 0, 4, 1, 5) + TISSUE_SIM_SHUFFLE(a, b, 2, 6, 3, 7);  // a02 b02 a13 b13
  const Four cd = TISSUE_SIM_SHUFFLE(c, d, 0, 4, 1, 5) + TISSUE_SIM_SHUFFLE(c, d, 2, 6, 3, 7);
  sums = TISSUE_SIM_SHUFFLE(ab, cd, 0, 1, 4, 5) + TISSUE_SIM_SHUFFLE(ab, cd, 2, 3, 6, 7);
}

TISSUE_SIM_INLINE void finish(const Sums<Four>& sums, double diagonal, LocalStiffness& local) {
  Four a, b, c;
  add_lanes(sums.gradient.x, sums.gradient.y, sums.gradient.z, sums.xx, a);
  add_lanes(sums.xy, sums.xz, sums.yy, sums.yz, b);
  add_lanes(sums.zz, sums.zz, sums.zz, sums.zz, c);
  local.gradient << static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2]);
  const auto xx = static_cast<double>(a[3]);
  const auto xy = static_cast<double>(b[0]);
  const auto xz = static_cast<double>(b[1]);
  const auto yy = static_cast<double>(b[2]);
  const auto yz = static_cast<double>(b[3]);
  const auto zz = static_cast<double>(c[0]);
  local.block << diagonal + xx, xy, xz, xy, diagonal + yy, yz, xz, yz, diagonal + zz;
}

/// Four vectors into a row each of their x, y and z, less `origin`.
TISSUE_SIM_INLINE void edges_to(const std::array<int, lanes>& others, std::size_t l, const float* displacements,
                                const Three<Four>& origin, Three<Four>& edges) {
  const Four a = *reinterpret_cast<const Quad*>(displacements + others[l]);
  const Four b = *reinterpret_cast<const Quad*>(displacements + others[l + 1]);
  const Four c = *reinterpret_cast<const Quad*>(displacements + others[l + 2]);
  const Four d = *reinterpret_cast<const Quad*>(displacements + others[l + 3]);
  const Four ab = TISSUE_SIM_SHUFFLE(a, b, 0, 4, 1, 5);  // ax bx ay by
  const Four cd = TISSUE_SIM_SHUFFLE(c, d, 0, 4, 1, 5);
  const Four abz = TISSUE_SIM_SHUFFLE(a, b, 2, 6, 3, 7);
  const Four cdz = TISSUE_SIM_SHUFFLE(c, d, 2, 6, 3, 7);
  edges.x = TISSUE_SIM_SHUFFLE(ab, cd, 0, 1, 4, 5) - origin.x;
  edges.y = TISSUE_SIM_SHUFFLE(ab, cd, 2, 3, 6, 7) - origin.y;
  edges.z = TISSUE_SIM_SHUFFLE(abz, cdz, 0, 1, 4, 5) - origin.z;
}

LocalStiffness corner_sum_baseline(const CornerBatches& corners, int vertex, const Eigen::Vector4f* displacements) {
  const float* u = displacements->data();
  const auto v = static_cast<std::size_t>(vertex);
  const float* own = u + 4 * v;
  const Three<Four> origin{Four{} + own[0], Four{} + own[1], Four{} + own[2]};
  Sums<Four> halves[2];
  for (std::size_t half = 0; half < 2; ++half) {
    for (int b = corners.first[v]; b < corners.first[v + 1]; ++b) {
      const CornerBatch& batch = corners.batches[static_cast<std::size_t>(b)];
      Three<Four> e1, e2, e3;
      edges_to(batch.others[0], 4 * half, u, origin, e1);
      edges_to(batch.others[1], 4 * half, u, origin, e2);
      edges_to(batch.others[2], 4 * half, u, origin, e3);
      add(batch, 4 * half, e1, e2, e3, halves[half]);
    }
  }
  const Sums<Four>& p = halves[0];
  const Sums<Four>& q = halves[1];
  const Sums<Four> sums{{p.gradient.x + q.gradient.x, p.gradient.y + q.gradient.y, p.gradient.z + q.gradient.z},
                        p.xx + q.xx,
                        p.xy + q.xy,
                        p.xz + q.xz,
                        p.yy + q.yy,
                        p.yz + q.yz,
                        p.zz + q.zz};
  LocalStiffness local;
  finish(sums, corners.diagonal[v], local);
  return local;
}

#ifdef __x86_64__
#define TISSUE_SIM_AVX2 __attribute__((target("avx2")))

TISSUE_SIM_AVX2 TISSUE_SIM_INLINE void load_two(const float* low, const float* high, __m256& both) {
  both = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high), 1);
}

/// As above, for all eight lanes: four and four.
TISSUE_SIM_AVX2 TISSUE_SIM_INLINE void edges_to(const std::array<int, lanes>& others, const float* displacements,
                                                const Three<Eight>& origin, Three<Eight>& edges) {
  __m256 a, b, c, d;
  load_two(displacements + others[0], displacements + others[4], a);
  load_two(displacements + others[1], displacements + others[5], b);
  load_two(displacements + others[2], displacements + others[6], c);
  load_two(displacements + others[3], displacements + others[7], d);
  const __m256 ab = _mm256_unpacklo_ps(a, b);
  const __m256 cd = _mm256_unpacklo_ps(c, d);
  const __m256 abz = _mm256_unpackhi_ps(a, b);
  const __m256 cdz = _mm256_unpackhi_ps(c, d);
  edges.x = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(1, 0, 1, 0)) - origin.x;
  edges.y = _mm256_shuffle_ps(ab, cd, _MM_SHUFFLE(3, 2, 3, 2)) - origin.y;
  edges.z = _mm256_shuffle_ps(abz, cdz, _MM_SHUFFLE(1, 0, 1, 0)) - origin.z;
}

TISSUE_SIM_AVX2 TISSUE_SIM_INLINE void add_halves(const Eight& sum, Four& half) {
  half = _mm_add_ps(_mm256_castps256_ps128(sum), _mm256_extractf128_ps(sum, 1));
}

TISSUE_SIM_AVX2 LocalStiffness corner_sum_avx2(const CornerBatches& corners, int vertex,
                                               const Eigen::Vector4f* displacements) {
  const float* u = displacements->data();
  const auto v = static_cast<std::size_t>(vertex);
  const float* own = u + 4 * v;
  const Three<Eight> origin{_mm256_set1_ps(own[0]), _mm256_set1_ps(own[1]), _mm256_set1_ps(own[2])};
  Sums<Eight> sums;
  for (int b = corners.first[v]; b < corners.first[v + 1]; ++b) {
    const CornerBatch& batch = corners.batches[static_cast<std::size_t>(b)];
    Three<Eight> e1, e2, e3;
    edges_to(batch.others[0], u, origin, e1);
    edges_to(batch.others[1], u, origin, e2);
    edges_to(batch.others[2], u, origin, e3);
    add(batch, 0, e1, e2, e3, sums);
  }
  Sums<Four> halved;
  add_halves(sums.gradient.x, halved.gradient.x);
  add_halves(sums.gradient.y, halved.gradient.y);
  add_halves(sums.gradient.z, halved.gradient.z);
  add_halves(sums.xx, halved.xx);
  add_halves(sums.xy, halved.xy);
  add_halves(sums.xz, halved.xz);
  add_halves(sums.yy, halved.yy);
  add_halves(sums.yz, halved.yz);
  add_halves(sums.zz, halved.zz);
  LocalStiffness local;
  finish(halved, corners.diagonal[v], local);
  return local;
}
#endif

void put(const NeoHookeanElement& element, std::size_t corner, CornerBatch& batch, std::size_t l) {
  Matrix3 gradients;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t other = (corner + 1 + i) % 4;
    gradients.row(static_cast<Eigen::Index>(i)) = element.shape_gradient(other).transpose();
    batch.others[i][l] = 4 * element.vertices[other];
    for (std::size_t a = 0; a < 3; ++a) {
      batch.gradients[3 * i + a][l] =
          static_cast<float>(gradients(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(a)));
    }
  }
  batch.determinant[l] = static_cast<float>(gradients.determinant());
  batch.volume_mu[l] = static_cast<float>(element.volume * element.moduli.mu);
  batch.volume_stiff[l] = static_cast<float>(element.volume * (element.moduli.lambda + element.moduli.mu));
}

}  // namespace

CornerBatches pack_corners(const std::vector<NeoHookeanElement>& elements, std::size_t vertices) {
  std::vector<std::size_t> count(vertices, 0);
  for (const NeoHookeanElement& element : elements) {
    for (const int v : element.vertices) ++count[static_cast<std::size_t>(v)];
  }
  CornerBatches corners;
  corners.first.assign(1, 0);
  for (std::size_t v = 0; v < vertices; ++v) {
    corners.first.push_back(corners.first.back() + static_cast<int>((count[v] + lanes - 1) / lanes));
    CornerBatch empty{};
    for (auto& others : empty.others) others.fill(4 * static_cast<int>(v));
    corners.batches.resize(static_cast<std::size_t>(corners.first.back()), empty);
  }
  corners.diagonal.assign(vertices, 0.0);
  count.assign(vertices, 0);
  for (const NeoHookeanElement& element : elements) {
    for (std::size_t corner = 0; corner < 4; ++corner) {
      const auto v = static_cast<std::size_t>(element.vertices[corner]);
      const std::size_t place = count[v]++;
      put(element, corner, corners.batches[static_cast<std::size_t>(corners.first[v]) + place / lanes], place % lanes);
      corners.diagonal[v] += element.volume * element.moduli.mu * element.shape_gradient(corner).squaredNorm();
    }
  }
  return corners;
}

CornerSum corner_sum(InstructionSet set) {
  if (!available(set)) {
    throw std::invalid_argument(std::string("corner_sum: this processor has no ") + name(set));
  }
#ifdef __x86_64__
  if (set != InstructionSet::baseline) return corner_sum_avx2;
#endif
  return corner_sum_baseline;
}

#ifdef __x86_64__
TinyIsZero::TinyIsZero() : before_(_mm_getcsr()) {
  _mm_setcsr(before_ | 0x8040U);
}  // results and operands
TinyIsZero::~TinyIsZero() {
  _mm_setcsr(before_);
}
#else
TinyIsZero::TinyIsZero() = default;
TinyIsZero::~TinyIsZero() = default;
#endif

}  // namespace tissue_sim
