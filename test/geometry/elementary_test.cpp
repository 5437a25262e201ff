#include "tissue_sim/geometry/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "floating_point_traps.h"
#include "tissue_sim/geometry/pose.h"

namespace tissue_sim::elementary_test {
namespace {

constexpr long double pi = 3.14159265358979323846264338327950288L;

/// Of the last place of the nearest double.
double units_off(double value, long double exact) {
  const double nearest = std::abs(static_cast<double>(exact));
  const long double unit = std::nextafter(nearest, std::numeric_limits<double>::max()) - nearest;
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / unit);
}

class Elementary : public testing::Test {
 protected:
  double between(double low, double high) { return low + (high - low) * static_cast<double>(random_()) / 4294967295.0; }

 private:
  std::mt19937 random_{1};
};

// A long double has 11 digits more where it is one of its own; elsewhere there is nothing to compare with.
constexpr bool long_is_longer = std::numeric_limits<long double>::digits >= 64;

TEST_F(Elementary, AreTheNearestDoubles) {
  if (!long_is_longer) GTEST_SKIP() << "long double is double";
  const double half = 0.501;  // units; the long one has an error of its own
  for (int i = 0; i < 20000; ++i) {
    for (const double reach : {1e-6, 0.8, 10.0, 9e4}) {
      const double x = between(-reach, reach);
      EXPECT_LE(units_off(sine(x), std::sin(static_cast<long double>(x))), half) << x;
      EXPECT_LE(units_off(cosine(x), std::cos(static_cast<long double>(x))), half) << x;
      const double y = std::abs(between(-10.0, 10.0));
      EXPECT_LE(units_off(angle_of(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x))), half);
    }
    const double c = between(-1.0, 1.0);
    EXPECT_LE(units_off(arc_cosine(c), std::acos(static_cast<long double>(c))), half) << c;
    const double nearly_one = 1.0 - square(1e-3 * c);
    EXPECT_LE(units_off(arc_cosine(nearly_one), std::acos(static_cast<long double>(nearly_one))), half) << nearly_one;
    const double e = std::exp(between(-30.0, 30.0));
    EXPECT_LE(units_off(natural_logarithm(e), std::log(static_cast<long double>(e))), 4.0) << e;
    EXPECT_LE(units_off(cube(c), static_cast<long double>(c) * c * c), half) << c;
  }
}

TEST_F(Elementary, AtTheirLimits) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {infinity, -infinity, nan}) {
    const WithoutTraps off;  // numbers that are none
    EXPECT_TRUE(std::isnan(sine(bad)));
    EXPECT_TRUE(std::isnan(cosine(bad)));
    EXPECT_TRUE(std::isnan(arc_cosine(bad)));
    EXPECT_TRUE(std::isnan(angle_of(bad, 1.0)));
    EXPECT_TRUE(std::isnan(angle_of(1.0, bad)));
    EXPECT_TRUE(std::isnan(natural_logarithm(bad)));
  }
  EXPECT_TRUE(std::isnan(arc_cosine(1.0 + 1e-15)));
  EXPECT_TRUE(std::isnan(natural_logarithm(0.0)));
  EXPECT_EQ(sine(0.0), 0.0);
  EXPECT_EQ(cosine(0.0), 1.0);
  EXPECT_EQ(arc_cosine(1.0), 0.0);
  EXPECT_EQ(arc_cosine(-1.0), static_cast<double>(pi));
  EXPECT_EQ(angle_of(0.0, 0.0), 0.0);
  EXPECT_EQ(angle_of(0.0, 1.0), 0.0);
  EXPECT_EQ(angle_of(0.0, -1.0), static_cast<double>(pi));
  EXPECT_EQ(angle_of(1e300, 0.0), static_cast<double>(pi / 2));
  EXPECT_EQ(angle_of(5e-324, 5e-324), static_cast<double>(pi / 4));
  EXPECT_EQ(natural_logarithm(1.0), 0.0);
  EXPECT_LE(std::abs(sine(1e300)), 1.0);
}

/// The same on every processor, by every compiler, at every level. Arguments are sums and products, so they are too.
TEST_F(Elementary, HaveTheBitsTheyAlwaysHad) {
  std::uint64_t hash = 0;
  const auto add = [&hash](double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  };
  for (int i = -5000; i <= 5000; ++i) {
    const double x = i * 0.000199;
    for (const double value : {sine(7.0 * x), cosine(7.0 * x), arc_cosine(x), angle_of(0.3, x), cube(x)}) add(value);
    add(natural_logarithm(1.0 + square(x)));
    const Eigen::Quaterniond from(0.8, 0.6, 0.0, 0.0);
    const Eigen::Quaterniond to = turn(x, Eigen::Vector3d(0.36, 0.48, 0.8));
    const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    const Pose between = interpolate({origin, from}, {origin, to}, 0.3);
    for (Eigen::Index c = 0; c < 4; ++c) add(between.orientation.coeffs()[c]);
  }
  EXPECT_EQ(hash, 0x85a0e45ed5a828bfu);
}

TEST_F(Elementary, InterpolateIsAnEvenTurn) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
  for (const double angle : {1e-9, 1e-3, 1.0, 3.0}) {
    const Pose from = {Eigen::Vector3d::Zero(), turn(0.4, Eigen::Vector3d::UnitX())};
    Pose to = {Eigen::Vector3d::Ones(), from.orientation * turn(angle, axis)};
    EXPECT_NEAR(angle_between(from, to), angle, 1e-12);
    for (const double sign : {1.0, -1.0}) {  // the same orientation either way: the shorter arc
      to.orientation.coeffs() *= sign;
      for (const double part : {0.25, 0.5, 0.9}) {
        const Pose between = interpolate(from, to, part);
        EXPECT_NEAR(angle_between(from, between), part * angle, 1e-12);
        EXPECT_NEAR(between.orientation.norm(), 1.0, 1e-15);
        EXPECT_NEAR(angle_between(between, {Eigen::Vector3d::Zero(), from.orientation * turn(part * angle, axis)}), 0.0,
                    1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace tissue_sim::elementary_test
