#include "tissue_sim/geometry/elementary.h"

#include <cmath>
#include <limits>

namespace tissue_sim {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The sum of two doubles of which the second is what the first has no digits for (Dekker 1971).
struct Twice {
  double high = 0.0;
  double low = 0.0;
};

/// |a| >= |b| or a = 0.
constexpr Twice ordered_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

constexpr Twice sum(double a, double b) {
  const double sum = a + b;
  const double of_b = sum - a;
  return {sum, (a - (sum - of_b)) + (b - of_b)};
}

/// Halves of 26 digits, whose products are exact.
constexpr Twice halves(double a) {
  const double shifted = 134217729.0 * a;  // 2^27 + 1
  const double high = shifted - (shifted - a);
  return {high, a - high};
}

constexpr Twice product(double a, double b) {
  const double rounded = a * b;
  const Twice x = halves(a);
  const Twice y = halves(b);
  return {rounded, ((x.high * y.high - rounded) + x.high * y.low + x.low * y.high) + x.low * y.low};
}

constexpr Twice operator+(const Twice& a, const Twice& b) {
  const Twice high = sum(a.high, b.high);
  const Twice low = sum(a.low, b.low);
  const Twice both = ordered_sum(high.high, high.low + low.high);
  return ordered_sum(both.high, both.low + low.low);
}

constexpr Twice operator-(const Twice& a) {
  return {-a.high, -a.low};
}

constexpr Twice operator*(const Twice& a, const Twice& b) {
  const Twice high = product(a.high, b.high);
  return ordered_sum(high.high, high.low + (a.high * b.low + a.low * b.high));
}

constexpr Twice operator/(const Twice& a, double b) {
  const double rounded = a.high / b;
  const Twice back = product(rounded, b);
  return ordered_sum(rounded, ((a.high - back.high) - back.low + a.low) / b);
}

/// (-1)^k / (2 k + of)!, the k-th number of a series over r^2: of the cosine for of = 0, of the sine over r for of = 1.
template <int of>
constexpr Twice coefficient(int k) {
  Twice inverse = {k % 2 == 0 ? 1.0 : -1.0, 0.0};
  for (int i = 2; i <= 2 * k + of; ++i) inverse = inverse / static_cast<double>(i);
  return inverse;
}

/// For |r| <= pi / 4, x = r^2. The later terms need no more digits than a double has.
template <int of>
Twice series_over(const Twice& x) {
  constexpr Twice full[] = {coefficient<of>(0), coefficient<of>(1), coefficient<of>(2), coefficient<of>(3)};
  constexpr double later[] = {coefficient<of>(4).high, coefficient<of>(5).high, coefficient<of>(6).high,
                              coefficient<of>(7).high, coefficient<of>(8).high, coefficient<of>(9).high,
                              coefficient<of>(10).high};
  double rest = later[6];
  for (int k = 5; k >= 0; --k) rest = later[k] + x.high * rest;
  Twice series = full[3] + product(x.high, rest);
  for (int k = 2; k >= 0; --k) series = full[k] + x * series;
  return series;
}

/// pi / 2 = the sum of the three.
constexpr double half_pi[] = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -0x1.f1976b7ed8fbcp-110};

constexpr double farthest_angle = 1e5;  ///< rad

/// An angle less whole quarters of a turn.
struct Reduced {
  Twice angle;
  int quarters = 0;
};

Reduced reduce(double angle) {
  if (!(std::abs(angle) <= farthest_angle)) angle = std::remainder(angle, 4.0 * half_pi[0]);
  const double quarters = std::nearbyint(angle / half_pi[0]);
  Twice rest = Twice{angle, 0.0} + -product(quarters, half_pi[0]);
  rest = rest + -product(quarters, half_pi[1]) + Twice{-quarters * half_pi[2], 0.0};
  return {rest, static_cast<int>(quarters)};
}

Twice sine_of(const Reduced& reduced, int more_quarters = 0) {
  const int quarters = (reduced.quarters + more_quarters) & 3;
  const Twice squared = reduced.angle * reduced.angle;
  const Twice of_first = quarters % 2 == 1 ? series_over<0>(squared) : reduced.angle * series_over<1>(squared);
  return quarters < 2 ? of_first : -of_first;
}

Twice cosine_of(const Reduced& reduced) {
  return sine_of(reduced, 1);
}

/// Of 0 <= t <= 1, to a few units in the last place.
double rough_arc_tangent(double t) {
  // Twice the arc tangent of tan(a / 2), and once more: then the series is short.
  for (int i = 0; i < 2; ++i) t /= 1.0 + std::sqrt(1.0 + t * t);
  double series = 0.0;
  for (int k = 12; k >= 0; --k) series = 1.0 / (2 * k + 1) - t * t * series;
  return 4.0 * t * series;
}

double rough_angle_of(double y, double x) {
  const double along = std::abs(x);
  const double angle = y <= along ? rough_arc_tangent(y / along) : half_pi[0] - rough_arc_tangent(along / y);
  return x < 0.0 ? 2.0 * half_pi[0] - angle : angle;
}

}  // namespace

double sine(double angle) {
  return std::isfinite(angle) ? sine_of(reduce(angle)).high : nan;
}

double cosine(double angle) {
  return std::isfinite(angle) ? cosine_of(reduce(angle)).high : nan;
}

double arc_cosine(double cosine) {
  if (!(cosine >= -1.0 && cosine <= 1.0)) return nan;
  if (cosine == 1.0) return 0.0;
  const double sine = std::sqrt((1.0 - cosine) * (1.0 + cosine));
  const double rough = rough_angle_of(sine, cosine);
  if (!(sine > 0.0)) return rough;  // pi
  return rough + (cosine_of(reduce(rough)) + Twice{-cosine, 0.0}).high / sine;
}

double angle_of(double y, double x) {
  if (!std::isfinite(x) || !(y >= 0.0 && std::isfinite(y))) return nan;
  if (x == 0.0 && y == 0.0) return 0.0;
  // Neither overflows, and neither loses digits, when the larger one is about 1. A power of two changes no digit.
  int exponent = 0;
  std::frexp(std::fmax(std::abs(x), y), &exponent);
  const double across = std::ldexp(y, -exponent);
  const double along = std::ldexp(x, -exponent);
  const double rough = rough_angle_of(across, along);
  const Reduced reduced = reduce(rough);
  const Twice off = Twice{across, 0.0} * cosine_of(reduced) + -(Twice{along, 0.0} * sine_of(reduced));
  return rough + off.high / std::sqrt(along * along + across * across);
}

double natural_logarithm(double x) {
  if (!(x > 0.0 && std::isfinite(x))) return nan;
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < 0.70710678118654752) {
    mantissa *= 2.0;
    --exponent;
  }
  // ln m = 2 artanh((m - 1) / (m + 1))
  const double z = (mantissa - 1.0) / (mantissa + 1.0);
  double series = 0.0;
  for (int k = 12; k >= 0; --k) series = 1.0 / (2 * k + 1) + z * z * series;
  return exponent * 0.69314718055994531 + 2.0 * z * series;
}

double cube(double x) {
  const Twice squared = product(x, x);
  const Twice cubed = product(squared.high, x);
  return cubed.high + (cubed.low + squared.low * x);
}

}  // namespace tissue_sim
