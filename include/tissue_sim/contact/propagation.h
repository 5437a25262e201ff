#pragma once

#include "tissue_sim/contact/penetration.h"

namespace tissue_sim {

/// Stage 3, Eq. 4-6: depth and direction of the inner colliding vertices, layer by layer inward from the border. A
/// vertex p takes from its neighbours p_j of earlier layers: depth = sum m_j ((p_j - p) . r_j + d_j) / sum m_j with m_j
/// = 1 / |p_j - p|^2, direction = sum m_j r_j, unit. Colliding vertices that no layer reaches take the closest feature.
///
/// Layers keep the mean depth error at 10 mm at 10 % of the depth; summing every pair makes it 23 %.
void propagate(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& detection,
               Penetration& penetration);

}  // namespace tissue_sim
