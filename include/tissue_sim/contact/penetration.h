#pragma once

#include "tissue_sim/contact/detection.h"

namespace tissue_sim {

/// Depth (m, never negative) and direction (unit, out of the instrument, tip frame) of the colliding vertices. One
/// entry a vertex of the organ; the entries of vertices that do not collide mean nothing.
struct Penetration {
  std::vector<double> depth;
  std::vector<Vector3> direction;
  std::vector<int> layer_of;  ///< per vertex, working list of propagate(); -1 between calls
  std::vector<int> layer;     ///< working lists of propagate()
  std::vector<int> next_layer;
};

void prepare(Penetration& penetration, const OrganSurface& organ);

/// Eq. 1 and 4: 1 / |a - b|^2. Two points closer than 1 nm weigh as if 1 nm apart: a crossing at the vertex itself then
/// outweighs every other by far, as it should, and stays finite.
double inverse_square_weight(const Vector3& a, const Vector3& b);

/// Stage 2, Eq. 1-3: each colliding border vertex p from the crossings x_i on the edges that leave it, nearest one an
/// edge, and the normals n_i of the triangles crossed there: depth = sum w_i (x_i - p) . n_i / sum w_i, direction = sum
/// w_i n_i, unit. Where the normals cancel (a thin instrument) or none is left, the closest feature gives the
/// direction, or both.
void penetrate_border(const OrganSurface& organ, const InstrumentSurface& instrument, Detection& detection,
                      Penetration& penetration);

/// Depth and direction of one vertex from the closest feature of the instrument; no depth where the vertex is outside.
void take_closest_feature(const InstrumentSurface& instrument, Detection& detection, int vertex,
                          Penetration& penetration);

/// The exact way in place of stages 2 and 3: the closest point of the instrument for every colliding vertex.
void penetrate_exactly(const InstrumentSurface& instrument, Detection& detection, Penetration& penetration);

}  // namespace tissue_sim
