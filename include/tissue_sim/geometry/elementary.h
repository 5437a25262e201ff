#pragma once

namespace tissue_sim {

/// Functions of doubles made of sums, products, quotients and roots alone, which IEEE 754 rounds in one way only. Those
/// of the C library give other last bits from one version to the next, and on one machine: glibc computes sine, arc
/// cosine and others with fused multiply-adds where the processor has them, and std::pow(x, 2) is a product at -O2 and
/// a call at -O0. What a step reads comes from these instead. They are computed with twice the digits of a double and
/// rounded once, so they are the nearest double but in one of some 4,000 cases. NaN where an argument is NaN or
/// infinite.

/// Of an angle in rad. Beyond 1e5 rad the angle is first reduced by the double nearest to 2 pi.
double sine(double angle);
double cosine(double angle);

/// rad, 0 to pi; NaN outside -1 to 1.
double arc_cosine(double cosine);

/// rad, 0 to pi: between the x axis and the way to (x, y), y >= 0; 0 for no way at all.
double angle_of(double y, double x);

/// Of x > 0; to within a few units in the last place.
double natural_logarithm(double x);

inline double square(double x) {
  return x * x;
}

/// Of |x| < 1e100, rounded once.
double cube(double x);

}  // namespace tissue_sim
