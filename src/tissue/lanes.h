#pragma once

#include <cstddef>

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
static_assert(alignof(Quad) == alignof(float), "vectors are read from and written to plain arrays");

#if defined(__clang__)
#define TISSUE_SIM_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
using QuadIndex = int __attribute__((vector_size(16)));
#define TISSUE_SIM_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, QuadIndex{__VA_ARGS__})
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
TISSUE_SIM_INLINE void cross(const Three<Lane>& a, const Three<Lane>& b, Three<Lane>& product) {
  product.x = a.y * b.z - a.z * b.y;
  product.y = a.z * b.x - a.x * b.z;
  product.z = a.x * b.y - a.y * b.x;
}

}  // namespace
}  // namespace tissue_sim
