#pragma once

#include <array>
#include <vector>

#include "tissue_sim/contact/penetration.h"

namespace tissue_sim {

/// A point of an organ's surface and the plane of the instrument that it must not be behind: direction . x >= target.
/// x is the weighted sum of up to three vertices: one for a colliding vertex, two for a point of an edge.
struct ContactPoint {
  int piece = 0;     ///< of the world's instrument pieces
  int triangle = 0;  ///< of the organ; the vertices are its corners in the order of the weights
  std::array<int, 3> vertices{};
  Vector3 weights = Vector3::UnitX();
  Vector3 direction = Vector3::UnitZ();           ///< scene frame, unit, out of the instrument
  double target = 0.0;                            ///< m
  Vector3 instrument_velocity = Vector3::Zero();  ///< m/s, of the instrument at the point
  double impulse = 0.0;                           ///< N s along direction, on the organ; set by the response
};

/// Position, velocity or any other vector at the point, from those of all vertices.
inline Vector3 at_point(const ContactPoint& point, const std::vector<Vector3>& of_vertices) {
  return point.weights[0] * of_vertices[point.vertices[0]] + point.weights[1] * of_vertices[point.vertices[1]] +
         point.weights[2] * of_vertices[point.vertices[2]];
}

/// m; what touches an instrument within this distance goes on touching, and points of triangles are kept this far out.
constexpr double contact_margin = 0.02e-3;

/// Colliding vertices, by the depths and directions of stages 2 and 3, then those of `touching` that are still within
/// the margin. Refills `touching` with all of them, ascending.
void add_vertex_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                         const Penetration& penetration, Detection& detection, std::vector<int>& touching,
                         std::vector<ContactPoint>& points);

/// Edges that go in and come out again between two vertices outside, at the middle of what is inside; and edges with
/// one end inside that still run through the instrument once that end is on its surface, as they do along a thin shaft.
void add_edge_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                       const Detection& detection, std::vector<ContactPoint>& points);

/// When to look at an instrument vertex again: a bound that motion uses up. Travel is a sum over all passes so far.
struct Clearance {
  double shift = 0.0;  ///< m, travel of the tip and of the organ's fastest vertex
  double turn = 0.0;   ///< rad
  std::vector<double>
      free_until;  ///< m, per instrument vertex: nothing to look at before shift + turn * |vertex| reaches it
  std::vector<double>
      first_touch;           ///< m, per instrument vertex: the travel at which it could first have reached the surface
  std::vector<int> nearest;  ///< per instrument vertex: the organ triangle found last, or -1

  explicit Clearance(std::size_t vertices = 0)
      : free_until(vertices, 0.0), first_touch(vertices, -1e300), nearest(vertices, -1) {}
};

/// Instrument vertices below the organ's surface or within the margin above it: what pokes into a triangle without any
/// organ vertex or edge being inside, as a tip thinner than a triangle does. With the two above that is every way two
/// surfaces can cross: where no organ edge crosses the instrument, what reaches below a flat triangle has its lowest
/// point at a vertex. Where the surface is folded into itself it has no inside, so what would push against the
/// instrument's own normal, or is deeper than it can have come since it was outside, is no poke.
///
/// Looks at `vertices` of the instrument only: where it is curved no more sharply than a few organ edges, colliding
/// vertices are dense enough, and what it reaches between them is a small part of an edge.
void add_poke_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                       const std::vector<int>& vertices, Clearance& clearance, std::vector<ContactPoint>& points);

}  // namespace tissue_sim
