#pragma once

#include <cstddef>

#include "constraint_lanes.h"

/// Distance, area and volume elements side by side, written once for all registers. A source that includes this has
/// defined before, in this namespace: TISSUE_SIM_TARGET, what to compile for; `Lane`, as many floats as go side by
/// side; `gather()`, `to_quads()`, `root()` and `any_above()` for them.
namespace tissue_sim {
namespace {

#define TISSUE_SIM_KERNEL TISSUE_SIM_TARGET TISSUE_SIM_INLINE

using Vectors = Three<Lane>;
constexpr std::size_t width = sizeof(Lane) / sizeof(float);

TISSUE_SIM_KERNEL void subtract(const Vectors& a, const Vectors& b, Vectors& difference) {
  difference.x = a.x - b.x;
  difference.y = a.y - b.y;
  difference.z = a.z - b.z;
}

TISSUE_SIM_KERNEL void add(const Vectors& a, const Vectors& b, Vectors& sum) {
  sum.x = a.x + b.x;
  sum.y = a.y + b.y;
  sum.z = a.z + b.z;
}

TISSUE_SIM_KERNEL void scale(const Lane& factor, const Vectors& a, Vectors& scaled) {
  scaled.x = factor * a.x;
  scaled.y = factor * a.y;
  scaled.z = factor * a.z;
}

TISSUE_SIM_KERNEL Lane dot(const Vectors& a, const Vectors& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

TISSUE_SIM_KERNEL void read(const FloatLanes* rows, std::size_t l, Vectors& vectors) {
  vectors.x = lane<Lane>(&rows[0][l]);
  vectors.y = lane<Lane>(&rows[1][l]);
  vectors.z = lane<Lane>(&rows[2][l]);
}

/// 1/p and 1/q with one division; 0 where their product is not above zero, as in lanes without an element. Those divide
/// by one: by zero it is a floating-point exception even where nobody takes what comes out.
TISSUE_SIM_KERNEL void invert(const Lane& p, const Lane& q, Lane& of_p, Lane& of_q) {
  const Lane none{};
  const Lane one = none + 1.0F;
  const Lane product = p * q;
  const Lane both = product > none ? 1.0F / (product > none ? product : one) : none;
  of_p = both * q;
  of_q = both * p;
}

/// What remains of an element's pull where it has become too stiff, see StiffnessLimit: 1 for most.
TISSUE_SIM_KERNEL Lane softened(const Lane& squared_frequency, const Lane& stiffest) {
  if (!any_above(squared_frequency, stiffest)) return Lane{} + 1.0F;  // what the division would give
  return stiffest / (squared_frequency > stiffest ? squared_frequency : stiffest);
}

/// What an organ's elements read and write of the vertices.
struct VertexFloats {
  const float* motions;
  float* pulls;

  const float* displacements() const { return motions; }
  const float* velocities() const { return motions + 4; }
  TISSUE_SIM_INLINE Quad& force(int place) const { return *reinterpret_cast<Quad*>(pulls + place); }
  TISSUE_SIM_INLINE Quad& normal(int place) const { return *reinterpret_cast<Quad*>(pulls + place + 4); }
};

/// An edge of elements: as it was at rest, how it changed, as it is.
struct EdgeLanes {
  Vectors rest, change, now;
};

TISSUE_SIM_KERNEL void edge_between(const Vectors& from, const Vectors& to, const FloatLanes* rest, std::size_t l,
                                    EdgeLanes& edge) {
  read(rest, l, edge.rest);
  subtract(to, from, edge.change);
  add(edge.rest, edge.change, edge.now);
}

/// a x b less the same at rest, without a difference of products that hardly differ: da x b + a0 x db.
TISSUE_SIM_KERNEL void cross_change(const EdgeLanes& a, const EdgeLanes& b, Vectors& change) {
  Vectors first, second;
  cross(a.change, b.now, first);
  cross(a.rest, b.change, second);
  add(first, second, change);
}

/// A measure and its square root's inverse, for lengths and areas: |e| - |e0| = de . (e + e0) / (|e| + |e0|), and again
/// nothing that hardly differs is subtracted.
struct Measured {
  Lane change;   ///< |e| - |e0|
  Lane inverse;  ///< 1 / |e|
};

TISSUE_SIM_KERNEL void measure(const Vectors& now, const Vectors& change, const Vectors& sum, const Lane& rest,
                               Measured& measured) {
  Lane size, of_sum;
  root(dot(now, now), size);
  invert(size + rest, size, of_sum, measured.inverse);
  measured.change = dot(change, sum) * of_sum;
}

TISSUE_SIM_KERNEL void measure(const EdgeLanes& edge, const Lane& rest, Measured& measured) {
  Vectors sum;
  add(edge.now, edge.rest, sum);
  measure(edge.now, edge.change, sum, rest, measured);
}

/// The pull on a distance's second end is this times its edge. What softens it is in its stiffness: it never changes.
TISSUE_SIM_KERNEL Lane distance_pull(const Measured& measured, const EdgeLanes& edge, const Vectors& rate,
                                     const Lane& stiffness, const Lane& damping) {
  const Lane speed = dot(edge.now, rate) * measured.inverse;
  return (stiffness * measured.change + damping * speed) * measured.inverse;
}

/// A triangle with the edges a and b: its normal n = a x b, and that of rest.
struct TriangleLanes {
  Vectors normal, change, sum;  ///< n, n - n0, n + n0
};

TISSUE_SIM_KERNEL void triangle_of(const EdgeLanes& a, const EdgeLanes& b, TriangleLanes& triangle) {
  Vectors rest;
  cross_change(a, b, triangle.change);
  cross(a.rest, b.rest, rest);
  add(rest, triangle.change, triangle.normal);
  add(rest, triangle.normal, triangle.sum);
}

/// Pulls on the ends of a and b. Twice the area is |n|; its gradients are b x n/|n| and n/|n| x a, as long as b and a;
/// that of the first corner is as long as the third side.
TISSUE_SIM_KERNEL void area_pulls(const AreaLanes& area, std::size_t l, const Lane& stiffest,
                                  const TriangleLanes& triangle, const EdgeLanes& a, const EdgeLanes& b,
                                  const Vectors& a_rate, const Vectors& b_rate, const Lane* inverse_masses,
                                  Vectors& of_a, Vectors& of_b) {
  Measured measured;
  measure(triangle.normal, triangle.change, triangle.sum, lane<Lane>(&area.twice_area[l]), measured);
  const Lane& stiffness = lane<Lane>(&area.stiffness[l]);
  Vectors side, n;
  subtract(b.now, a.now, side);
  const Lane slope = dot(side, side) * inverse_masses[0] + dot(b.now, b.now) * inverse_masses[1] +
                     dot(a.now, a.now) * inverse_masses[2];
  const Lane soft = softened(stiffness * slope, stiffest);
  scale(measured.inverse, triangle.normal, n);
  cross(b.now, n, of_a);
  cross(n, a.now, of_b);
  const Lane rate = dot(a_rate, of_a) + dot(b_rate, of_b);
  const Lane pull = soft * (stiffness * measured.change + lane<Lane>(&area.damping[l]) * rate);
  scale(pull, of_a, of_a);
  scale(pull, of_b, of_b);
}

/// On the way from rest, x0 + s u, six times the enclosed volume changes by (u0 + u1 + u2) . n(s) ds, and n is
/// quadratic in s: by (u0 + u1 + u2) . (n0 + dn/2 - da x db / 6) in all.
TISSUE_SIM_KERNEL Lane swept(const TriangleLanes& triangle, const EdgeLanes& a, const EdgeLanes& b,
                             const Vectors& origin) {
  Vectors curl, middle, way;
  cross(a.change, b.change, curl);
  middle.x = 0.5F * triangle.sum.x - (1.0F / 6.0F) * curl.x;
  middle.y = 0.5F * triangle.sum.y - (1.0F / 6.0F) * curl.y;
  middle.z = 0.5F * triangle.sum.z - (1.0F / 6.0F) * curl.z;
  way.x = 3.0F * origin.x + a.change.x + b.change.x;
  way.y = 3.0F * origin.y + a.change.y + b.change.y;
  way.z = 3.0F * origin.z + a.change.z + b.change.z;
  return dot(way, middle);
}

TISSUE_SIM_KERNEL Lane swept_rate(const TriangleLanes& triangle, const Vectors& a_rate, const Vectors& b_rate,
                                  const Vectors& origin) {
  Vectors speed;
  speed.x = 3.0F * origin.x + a_rate.x + b_rate.x;
  speed.y = 3.0F * origin.y + a_rate.y + b_rate.y;
  speed.z = 3.0F * origin.z + a_rate.z + b_rate.z;
  return dot(speed, triangle.normal);
}

/// Six times the volume is a . (b x c); its gradient at the corners 1 to 3 b x c, c x a and a x b. The last two are the
/// normals of the flap's triangles.
template <bool with_triangles>
TISSUE_SIM_KERNEL void add_flaps(const FlapBatch& batch, const AreaLanes* areas, std::size_t l, const Lane& stiffest,
                                 const VertexFloats& at, EnclosedShare* share) {
  Gathered<Lane> corner[4];
  for (std::size_t i = 0; i < 4; ++i) gather(at.displacements(), &batch.vertices[i][l], corner[i]);
  EdgeLanes a, b, c;
  edge_between(corner[0].vectors, corner[1].vectors, &batch.edges[0], l, a);
  edge_between(corner[0].vectors, corner[2].vectors, &batch.edges[3], l, b);
  edge_between(corner[0].vectors, corner[3].vectors, &batch.edges[6], l, c);
  Measured length;
  measure(a, lane<Lane>(&batch.length[l]), length);

  TriangleLanes first, second;
  Vectors g0, g1, g2, g3;
  cross(b.now, c.now, g1);
  Lane change;
  if (with_triangles) {
    triangle_of(a, b, first);
    triangle_of(c, a, second);
    g2 = second.normal;
    g3 = first.normal;
    change = dot(c.change, g3) + dot(c.rest, first.change);
  } else {
    cross(c.now, a.now, g2);
    cross(a.now, b.now, g3);
    Vectors g1_change;
    cross_change(b, c, g1_change);
    change = dot(a.change, g1) + dot(a.rest, g1_change);
  }
  add(g1, g2, g0);
  add(g0, g3, g0);
  const Lane slope = dot(g0, g0) * corner[0].fourth + dot(g1, g1) * corner[1].fourth + dot(g2, g2) * corner[2].fourth +
                     dot(g3, g3) * corner[3].fourth;
  const Lane& stiffness = lane<Lane>(&batch.volume_stiffness[l]);
  const Lane soft = softened(stiffness * slope, stiffest);

  Gathered<Lane> speed[4];
  for (std::size_t i = 0; i < 4; ++i) gather(at.velocities(), &batch.vertices[i][l], speed[i]);
  Vectors a_rate, b_rate, c_rate;
  subtract(speed[1].vectors, speed[0].vectors, a_rate);
  subtract(speed[2].vectors, speed[0].vectors, b_rate);
  subtract(speed[3].vectors, speed[0].vectors, c_rate);
  const Lane along = distance_pull(length, a, a_rate, lane<Lane>(&batch.distance_stiffness[l]),
                                   lane<Lane>(&batch.distance_damping[l]));
  const Lane rate = dot(a_rate, g1) + dot(b_rate, g2) + dot(c_rate, g3);
  const Lane pull = soft * (stiffness * change + lane<Lane>(&batch.volume_damping[l]) * rate);
  Vectors p1{along * a.now.x + pull * g1.x, along * a.now.y + pull * g1.y, along * a.now.z + pull * g1.z};
  Vectors p2, p3;
  scale(pull, g2, p2);
  scale(pull, g3, p3);
  Quad q1[width], q2[width], q3[width];
  if (with_triangles) {
    lane<Lane>(&share->change[l]) = swept(first, a, b, corner[0].vectors) + swept(second, c, a, corner[0].vectors);
    lane<Lane>(&share->rate[l]) =
        swept_rate(first, a_rate, b_rate, speed[0].vectors) + swept_rate(second, c_rate, a_rate, speed[0].vectors);
    Vectors of_a, of_b, of_c;
    const Lane masses_1[3] = {corner[0].fourth, corner[1].fourth, corner[2].fourth};
    area_pulls(areas[0], l, stiffest, first, a, b, a_rate, b_rate, masses_1, of_a, of_b);
    add(p1, of_a, p1);
    add(p2, of_b, p2);
    const Lane masses_2[3] = {corner[0].fourth, corner[3].fourth, corner[1].fourth};
    area_pulls(areas[1], l, stiffest, second, c, a, c_rate, a_rate, masses_2, of_c, of_a);
    add(p1, of_a, p1);
    add(p3, of_c, p3);
    Quad n1[width], n2[width];
    to_quads(first.normal, n1);
    to_quads(second.normal, n2);
    for (std::size_t i = 0; i < width; ++i) {
      const Quad both = n1[i] + n2[i];
      at.normal(batch.vertices[0][l + i]) += both;
      at.normal(batch.vertices[1][l + i]) += both;
      at.normal(batch.vertices[2][l + i]) += n1[i];
      at.normal(batch.vertices[3][l + i]) += n2[i];
    }
  }
  to_quads(p1, q1);
  to_quads(p2, q2);
  to_quads(p3, q3);
  for (std::size_t i = 0; i < width; ++i) {
    at.force(batch.vertices[0][l + i]) += q1[i] + q2[i] + q3[i];
    at.force(batch.vertices[1][l + i]) -= q1[i];
    at.force(batch.vertices[2][l + i]) -= q2[i];
    at.force(batch.vertices[3][l + i]) -= q3[i];
  }
}

TISSUE_SIM_KERNEL void add_triangles(const TriangleBatch& batch, std::size_t l, const Lane& stiffest,
                                     const VertexFloats& at, EnclosedShare& share) {
  Gathered<Lane> corner[3], speed[3];
  for (std::size_t i = 0; i < 3; ++i) gather(at.displacements(), &batch.vertices[i][l], corner[i]);
  for (std::size_t i = 0; i < 3; ++i) gather(at.velocities(), &batch.vertices[i][l], speed[i]);
  EdgeLanes a, b;
  edge_between(corner[0].vectors, corner[1].vectors, &batch.edges[0], l, a);
  edge_between(corner[0].vectors, corner[2].vectors, &batch.edges[3], l, b);
  Vectors a_rate, b_rate, p1, p2;
  subtract(speed[1].vectors, speed[0].vectors, a_rate);
  subtract(speed[2].vectors, speed[0].vectors, b_rate);
  TriangleLanes triangle;
  triangle_of(a, b, triangle);
  const Lane masses[3] = {corner[0].fourth, corner[1].fourth, corner[2].fourth};
  area_pulls(batch.area, l, stiffest, triangle, a, b, a_rate, b_rate, masses, p1, p2);
  lane<Lane>(&share.change[l]) = swept(triangle, a, b, corner[0].vectors);
  lane<Lane>(&share.rate[l]) = swept_rate(triangle, a_rate, b_rate, speed[0].vectors);

  Quad q1[width], q2[width], normals[width];
  to_quads(p1, q1);
  to_quads(p2, q2);
  to_quads(triangle.normal, normals);
  for (std::size_t i = 0; i < width; ++i) {
    at.force(batch.vertices[0][l + i]) += q1[i] + q2[i];
    at.force(batch.vertices[1][l + i]) -= q1[i];
    at.force(batch.vertices[2][l + i]) -= q2[i];
    for (const auto& vertices : batch.vertices) at.normal(vertices[l + i]) += normals[i];
  }
}

TISSUE_SIM_KERNEL void add_distances(const DistanceBatch& batch, std::size_t l, const VertexFloats& at) {
  Gathered<Lane> corner[2], speed[2];
  for (std::size_t i = 0; i < 2; ++i) gather(at.displacements(), &batch.vertices[i][l], corner[i]);
  for (std::size_t i = 0; i < 2; ++i) gather(at.velocities(), &batch.vertices[i][l], speed[i]);
  EdgeLanes a;
  edge_between(corner[0].vectors, corner[1].vectors, &batch.edge[0], l, a);
  Measured length;
  measure(a, lane<Lane>(&batch.length[l]), length);
  Vectors rate, p1;
  subtract(speed[1].vectors, speed[0].vectors, rate);
  scale(distance_pull(length, a, rate, lane<Lane>(&batch.stiffness[l]), lane<Lane>(&batch.damping[l])), a.now, p1);
  Quad q1[width];
  to_quads(p1, q1);
  for (std::size_t i = 0; i < width; ++i) {
    at.force(batch.vertices[0][l + i]) += q1[i];
    at.force(batch.vertices[1][l + i]) -= q1[i];
  }
}

TISSUE_SIM_KERNEL void add_chosen(const ConstraintBatches& batches, const ChosenConstraints& chosen,
                                  const VertexMotion* motions, VertexPull* pulls, EnclosedShare* shares) {
  const Lane stiffest = Lane{} + batches.stiffest;
  const VertexFloats at = {reinterpret_cast<const float*>(motions), reinterpret_cast<float*>(pulls)};
  for (std::size_t i = 0; i < chosen.pairs.count; ++i) {
    const std::size_t p = chosen.pairs[i];
    const PairBatch& batch = batches.pairs[p];
    for (std::size_t l = 0; l < constraint_lanes; l += width) {
      add_flaps<true>(batch.flap, batch.areas.data(), l, stiffest, at, &shares[p]);
    }
  }
  for (std::size_t i = 0; i < chosen.flaps.count; ++i) {
    const FlapBatch& batch = batches.flaps[chosen.flaps[i]];
    for (std::size_t l = 0; l < constraint_lanes; l += width) {
      add_flaps<false>(batch, nullptr, l, stiffest, at, nullptr);
    }
  }
  for (std::size_t i = 0; i < chosen.triangles.count; ++i) {
    const std::size_t t = chosen.triangles[i];
    for (std::size_t l = 0; l < constraint_lanes; l += width) {
      add_triangles(batches.triangles[t], l, stiffest, at, shares[batches.pairs.size() + t]);
    }
  }
  for (std::size_t i = 0; i < chosen.distances.count; ++i) {
    const DistanceBatch& batch = batches.distances[chosen.distances[i]];
    for (std::size_t l = 0; l < constraint_lanes; l += width) add_distances(batch, l, at);
  }
}

}  // namespace
}  // namespace tissue_sim
