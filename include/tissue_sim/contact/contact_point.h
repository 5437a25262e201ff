#pragma once

#include <array>
#include <vector>

#include "tissue_sim/contact/penetration.h"
#include "tissue_sim/geometry/embedding.h"

namespace tissue_sim {

/// The simulated vertices that a place of the surface moves with, and how much with each: x = sum w_i x_i. The corners
/// of its triangle, or, where the surface is embedded, those of the tetrahedra or coarse triangles of its corners.
struct Bearers {
  static constexpr int most = 12;
  int count = 0;
  std::array<int, most> vertices{};
  std::array<double, most> weights{};

  /// A vertex that bears already bears more.
  void add(int vertex, double weight);
};

/// 1/kg, how easily a place moves. Beside attached vertices bounded from below, so that no vertex goes more than twice
/// as far as the place is asked to: one free corner with a small weight would be thrown. Where all are free there is
/// nothing to bound, and twelve that share a place would be held back.
struct Mobility {
  double unbounded = 0.0;  ///< sum w_i^2 / m_i
  double ease = 0.0;       ///< 0 where all vertices are attached
};
Mobility mobility(const Bearers& bearers, const std::vector<double>& inverse_mass);

/// A point of an organ's surface and the plane of the instrument that it must not be behind: direction . x >= target.
struct ContactPoint {
  int piece = 0;                       ///< of the world's instrument pieces
  int triangle = 0;                    ///< of the organ
  Vector3 weights = Vector3::UnitX();  ///< of the triangle's corners: one is 1 for a colliding vertex
  Bearers bearers;
  int poking = -1;                                ///< the instrument's vertex, where one pokes into the triangle
  Vector3 direction = Vector3::UnitZ();           ///< scene frame, unit, out of the instrument
  double target = 0.0;                            ///< m, for the bearers: it shall get `lift` farther itself
  double lift = 0.0;                              ///< m, along direction, from where the bearers put it to where it is
  Vector3 carried = Vector3::Zero();              ///< m, where its bearers would be had they gone with the instrument
  Vector3 instrument_velocity = Vector3::Zero();  ///< m/s, of the instrument at the point
  double impulse = 0.0;                           ///< N s along direction, on the organ; set by the response
  double force = 0.0;                             ///< N along direction, on the organ; see bear_forces
  double stiffness = 0.0;                         ///< N/m, of the implicit integrator; see descend
};

/// Position, velocity or any other vector at the point, from those of all vertices.
inline Vector3 at_point(const ContactPoint& point, const std::vector<Vector3>& of_vertices) {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < point.bearers.count; ++i)
    sum += point.bearers.weights[i] * of_vertices[point.bearers.vertices[i]];
  return sum;
}

/// Of points that were found on an embedded surface: lets the vertices of the solid or shell bear them. That a shell's
/// triangles turn with what lies above them is left out: it changes a point's way by the square of theirs, and the next
/// pass finds what is left. `positions` are those of the surface and of its bearers.
void bear_by(const Embedding& embedding, const std::vector<Triangle>& triangles, const std::vector<Vector3>& positions,
             std::vector<ContactPoint>& points);

/// m; what touches an instrument within this distance goes on touching, and points of triangles are kept this far out.
constexpr double contact_margin = 0.02e-3;

/// m; instrument vertices this far above the surface are looked at. Twice what they are kept at: what rests on the
/// instrument would else be let go in every other pass and fall back, with half the force.
constexpr double poke_reach = 2.0 * contact_margin;

/// Colliding vertices, by the depths and directions of stages 2 and 3, then those of `touching` that are still within
/// the margin. Refills `touching` with all of them, ascending.
void add_vertex_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                         const Penetration& penetration, Detection& detection, std::vector<int>& touching,
                         std::vector<ContactPoint>& points);

/// Edges that go in and come out again between two vertices outside, at the middle of what is inside; and edges with
/// one end inside that still run through the instrument once that end is on its surface, as they do along a thin shaft.
/// They are left half a margin inside, so that the next pass finds them there.
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
  std::vector<char>
      pokes;  ///< per instrument vertex: 1 if it made a contact point in the last pass, 2 if not the first

  explicit Clearance(std::size_t vertices = 0)
      : free_until(vertices, 0.0), first_touch(vertices, -1e300), nearest(vertices, -1), pokes(vertices, 0) {}
};

/// Instrument vertices below the organ's surface or within their reach above it: what pokes into a triangle without any
/// organ vertex or edge being inside, as a tip thinner than a triangle does. With the two above that is every way two
/// surfaces can cross: where no organ edge crosses the instrument, what reaches below a flat triangle has its lowest
/// point at a vertex. Where the surface is folded into itself it has no inside, so what would push against the
/// instrument's own normal, or is deeper than it can have come since it was outside, is no poke.
///
/// A flat triangle is kept out by few of them: for each of its corners the three deepest of those that are nearest to
/// it.
///
/// Looks at `vertices` of the instrument only: where it is curved no more sharply than a few organ edges, colliding
/// vertices are dense enough, and what it reaches between them is a small part of an edge.
void add_poke_contacts(const OrganSurface& organ, const InstrumentSurface& instrument, int piece, const Pose& pose,
                       const std::vector<int>& vertices, Clearance& clearance, std::vector<ContactPoint>& points);

}  // namespace tissue_sim
