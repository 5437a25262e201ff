#pragma once

#include <cstddef>
#include <cstring>

#define TISSUE_SIM_INLINE __attribute__((always_inline)) inline

/// Tetrahedra side by side, for the sources that compute them so.
namespace tissue_sim {
namespace {

// Vector extensions of g++ and clang: arithmetic lane by lane, in whatever registers the function has that they are
// inlined into. They go by reference, since how wide ones are passed by value depends on the instruction set.
// One vertex, x y z 0. As a `using` clang would drop the alignment.
typedef float Quad __attribute__((vector_size(16), aligned(4), may_alias));  // NOLINT(modernize-use-using)
using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));
using Sixteen = float __attribute__((vector_size(64)));
static_assert(alignof(Quad) == alignof(float), "vectors are read from and written to plain arrays");

#if defined(__clang__)
#define TISSUE_SIM_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#define TISSUE_SIM_SHUFFLE_EIGHT(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
using QuadIndex = int __attribute__((vector_size(16)));
using EightIndex = int __attribute__((vector_size(32)));
#define TISSUE_SIM_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, QuadIndex{__VA_ARGS__})
#define TISSUE_SIM_SHUFFLE_EIGHT(a, b, ...) __builtin_shuffle(a, b, EightIndex{__VA_ARGS__})
#endif

// Halves put together, and taken apart. g++ before 12 has no word for it but memory.
#if defined(__clang__) || __GNUC__ >= 12
TISSUE_SIM_INLINE void join(const Quad& low, const Quad& high, Eight& both) {
  both = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
TISSUE_SIM_INLINE void join(const Eight& low, const Eight& high, Sixteen& both) {
  both = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}
TISSUE_SIM_INLINE void part(const Eight& both, Quad& low, Quad& high) {
  low = __builtin_shufflevector(both, both, 0, 1, 2, 3);
  high = __builtin_shufflevector(both, both, 4, 5, 6, 7);
}
#else
template <class Half, class Whole>
TISSUE_SIM_INLINE void join(const Half& low, const Half& high, Whole& both) {
  std::memcpy(&both, &low, sizeof(low));
  std::memcpy(reinterpret_cast<char*>(&both) + sizeof(low), &high, sizeof(high));
}
TISSUE_SIM_INLINE void part(const Eight& both, Quad& low, Quad& high) {
  std::memcpy(&low, &both, sizeof(low));
  std::memcpy(&high, reinterpret_cast<const char*>(&both) + sizeof(low), sizeof(high));
}
#endif

template <class Lane>
struct Three {
  Lane x, y, z;
};

template <class Lane>
TISSUE_SIM_INLINE const Lane& lane(const float* p) {
  return *reinterpret_cast<const Lane*>(p);
}

template <class Lane>
TISSUE_SIM_INLINE Lane& lane(float* p) {
  return *reinterpret_cast<Lane*>(p);
}

TISSUE_SIM_INLINE const Quad& quad(const float* p) {
  return *reinterpret_cast<const Quad*>(p);
}
TISSUE_SIM_INLINE Quad& quad(float* p) {
  return *reinterpret_cast<Quad*>(p);
}

/// Four vectors into a row each of their x, y and z.
template <std::size_t stride>
TISSUE_SIM_INLINE void to_rows(const Quad& a, const Quad& b, const Quad& c, const Quad& d, float* rows) {
  const Quad ab = TISSUE_SIM_SHUFFLE(a, b, 0, 4, 1, 5);  // ax bx ay by
  const Quad cd = TISSUE_SIM_SHUFFLE(c, d, 0, 4, 1, 5);
  quad(rows) = TISSUE_SIM_SHUFFLE(ab, cd, 0, 1, 4, 5);
  quad(rows + stride) = TISSUE_SIM_SHUFFLE(ab, cd, 2, 3, 6, 7);
  const Quad abz = TISSUE_SIM_SHUFFLE(a, b, 2, 6, 3, 7);
  const Quad cdz = TISSUE_SIM_SHUFFLE(c, d, 2, 6, 3, 7);
  quad(rows + 2 * stride) = TISSUE_SIM_SHUFFLE(abz, cdz, 0, 1, 4, 5);
}

/// The way back; the fourth component is zero.
template <std::size_t stride>
TISSUE_SIM_INLINE void from_rows(const float* rows, Quad& a, Quad& b, Quad& c, Quad& d) {
  const Quad x = quad(rows);
  const Quad y = quad(rows + stride);
  const Quad z = quad(rows + 2 * stride);
  const Quad zero{};
  const Quad xy = TISSUE_SIM_SHUFFLE(x, y, 0, 4, 1, 5);  // ax ay bx by
  const Quad zw = TISSUE_SIM_SHUFFLE(z, zero, 0, 4, 1, 5);
  a = TISSUE_SIM_SHUFFLE(xy, zw, 0, 1, 4, 5);
  b = TISSUE_SIM_SHUFFLE(xy, zw, 2, 3, 6, 7);
  const Quad xy2 = TISSUE_SIM_SHUFFLE(x, y, 2, 6, 3, 7);
  const Quad zw2 = TISSUE_SIM_SHUFFLE(z, zero, 2, 6, 3, 7);
  c = TISSUE_SIM_SHUFFLE(xy2, zw2, 0, 1, 4, 5);
  d = TISSUE_SIM_SHUFFLE(xy2, zw2, 2, 3, 6, 7);
}

/// The same of eight vectors: a and the fifth in one register, b and the sixth, c and the seventh, d and the eighth.
template <std::size_t stride>
TISSUE_SIM_INLINE void to_rows(const Eight& a, const Eight& b, const Eight& c, const Eight& d, float* rows) {
  const Eight ab = TISSUE_SIM_SHUFFLE_EIGHT(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight cd = TISSUE_SIM_SHUFFLE_EIGHT(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  lane<Eight>(rows) = TISSUE_SIM_SHUFFLE_EIGHT(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13);
  lane<Eight>(rows + stride) = TISSUE_SIM_SHUFFLE_EIGHT(ab, cd, 2, 3, 10, 11, 6, 7, 14, 15);
  const Eight abz = TISSUE_SIM_SHUFFLE_EIGHT(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight cdz = TISSUE_SIM_SHUFFLE_EIGHT(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  lane<Eight>(rows + 2 * stride) = TISSUE_SIM_SHUFFLE_EIGHT(abz, cdz, 0, 1, 8, 9, 4, 5, 12, 13);
}

template <std::size_t stride>
TISSUE_SIM_INLINE void from_rows(const float* rows, Eight& a, Eight& b, Eight& c, Eight& d) {
  const Eight& x = lane<Eight>(rows);
  const Eight& y = lane<Eight>(rows + stride);
  const Eight& z = lane<Eight>(rows + 2 * stride);
  const Eight zero{};
  const Eight xy = TISSUE_SIM_SHUFFLE_EIGHT(x, y, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight zw = TISSUE_SIM_SHUFFLE_EIGHT(z, zero, 0, 8, 1, 9, 4, 12, 5, 13);
  a = TISSUE_SIM_SHUFFLE_EIGHT(xy, zw, 0, 1, 8, 9, 4, 5, 12, 13);
  b = TISSUE_SIM_SHUFFLE_EIGHT(xy, zw, 2, 3, 10, 11, 6, 7, 14, 15);
  const Eight xy2 = TISSUE_SIM_SHUFFLE_EIGHT(x, y, 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight zw2 = TISSUE_SIM_SHUFFLE_EIGHT(z, zero, 2, 10, 3, 11, 6, 14, 7, 15);
  c = TISSUE_SIM_SHUFFLE_EIGHT(xy2, zw2, 0, 1, 8, 9, 4, 5, 12, 13);
  d = TISSUE_SIM_SHUFFLE_EIGHT(xy2, zw2, 2, 3, 10, 11, 6, 7, 14, 15);
}

template <class Lane>
TISSUE_SIM_INLINE void add(const Three<Lane>& more, Three<Lane>& sum) {
  sum.x += more.x;
  sum.y += more.y;
  sum.z += more.z;
}

template <class Lane>
TISSUE_SIM_INLINE void subtract(const Three<Lane>& less, Three<Lane>& rest) {
  rest.x -= less.x;
  rest.y -= less.y;
  rest.z -= less.z;
}

template <class Lane>
TISSUE_SIM_INLINE void cross(const Three<Lane>& a, const Three<Lane>& b, Three<Lane>& product) {
  product.x = a.y * b.z - a.z * b.y;
  product.y = a.z * b.x - a.x * b.z;
  product.z = a.x * b.y - a.y * b.x;
}

}  // namespace
}  // namespace tissue_sim
