#pragma once

#include "lanes.h"

namespace tissue_sim {
namespace {

/// Columns of the first Piola-Kirchhoff stress P of stable neo-Hookean tissue, times the rest volume (J), from those of
/// H = F - 1, the gradient of the displacements. With K the cofactors of H and C = 1 + tr H - H^T + K those of F,
///   J - 1 = tr H + tr K + det H,  P = mu (F - C) + L (J - 1) C = mu H + t (K - H^T) + (s + t tr H) 1,
/// where s = L (J - 1) and t = s - mu. No numbers of size one are subtracted, so a strain of 1e-6 keeps its digits.
/// `mu` and `stiff` are the rest volume times mu and times L = lambda + mu.
template <class Lane>
TISSUE_SIM_INLINE void stress(const Three<Lane>& h0, const Three<Lane>& h1, const Three<Lane>& h2, const Lane& mu,
                              const Lane& stiff, Three<Lane>& p0, Three<Lane>& p1, Three<Lane>& p2) {
  Three<Lane> k0, k1, k2;
  cross(h1, h2, k0);
  cross(h2, h0, k1);
  cross(h0, h1, k2);
  const Lane trace = h0.x + h1.y + h2.z;
  const Lane stretch = trace + (k0.x + k1.y + k2.z) + (h0.x * k0.x + h0.y * k0.y + h0.z * k0.z);
  const Lane s = stiff * stretch;
  const Lane t = s - mu;
  const Lane diagonal = s + t * trace;
  p0.x = mu * h0.x + t * (k0.x - h0.x) + diagonal;
  p0.y = mu * h0.y + t * (k0.y - h1.x);
  p0.z = mu * h0.z + t * (k0.z - h2.x);
  p1.x = mu * h1.x + t * (k1.x - h0.y);
  p1.y = mu * h1.y + t * (k1.y - h1.y) + diagonal;
  p1.z = mu * h1.z + t * (k1.z - h2.y);
  p2.x = mu * h2.x + t * (k2.x - h0.z);
  p2.y = mu * h2.y + t * (k2.y - h1.z);
  p2.z = mu * h2.z + t * (k2.z - h2.z) + diagonal;
}

}  // namespace
}  // namespace tissue_sim
