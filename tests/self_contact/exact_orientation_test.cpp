#include "server/solver/self_contact/exact_orientation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace drape::test {
namespace {

using self_contact::Crosses;
using self_contact::Orientation;
using Point = Eigen::Vector3d;

// Exact by integers: coordinates are multiples of `unit` and fit into 40 bits.
int ByIntegers(const std::array<Point, 4>& p, double unit) {
  __extension__ using Wide = __int128;
  std::array<std::array<Wide, 3>, 3> d;
  for (int k = 0; k < 3; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      d[k][axis] =
          Wide(std::llround(p[k + 1][axis] / unit)) - Wide(std::llround(p[0][axis] / unit));
    }
  }
  const Wide determinant = (d[0][1] * d[1][2] - d[0][2] * d[1][1]) * d[2][0] +
                           (d[0][2] * d[1][0] - d[0][0] * d[1][2]) * d[2][1] +
                           (d[0][0] * d[1][1] - d[0][1] * d[1][0]) * d[2][2];
  return determinant > 0 ? 1 : determinant < 0 ? -1 : 0;
}

TEST(ExactOrientation, IsThatOfIntegers) {
  std::mt19937_64 random(2);
  // In a plane up to a few units of the last place: the sign is lost in rounding.
  constexpr double kUnit = 0x1p-34;
  std::uniform_int_distribution<int64_t> coordinate(-(int64_t{1} << 34), int64_t{1} << 34);
  std::uniform_int_distribution<int> nudge(-1, 1);
  int zeros = 0, others = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::array<Point, 4> p;
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        p[k][axis] = std::ldexp(double(coordinate(random) / 4), -34);
      }
    }
    // p3 = p0 + (p1 - p0) + (p2 - p0), nudged.
    p[3] = p[1] + (p[2] - p[0]);
    for (int axis = 0; axis < 3; ++axis) p[3][axis] += nudge(random) * kUnit;
    const int expected = ByIntegers(p, kUnit);
    EXPECT_EQ(Orientation(p[0], p[1], p[2], p[3]), expected);
    EXPECT_EQ(Orientation(p[1], p[0], p[2], p[3]), -expected);
    (expected == 0 ? zeros : others) += 1;
  }
  EXPECT_GT(zeros, 10);
  EXPECT_GT(others, 1000);
}

TEST(ExactOrientation, AnEdgeCrossesATriangleOrItsBorderButNotBeside) {
  const Point a(0, 0, 0), b(1, 0, 0), c(0, 1, 0);
  const auto crosses = [&](double x, double y) {
    return Crosses(Point(x, y, -1), Point(x, y, 2), a, b, c);
  };
  EXPECT_TRUE(crosses(0.25, 0.25));
  EXPECT_TRUE(crosses(0.5, 0));
  EXPECT_TRUE(crosses(0.5, 0.5));
  EXPECT_FALSE(crosses(0.5, std::nextafter(0.5, 1)));
  EXPECT_FALSE(crosses(-1e-300, 0.5));
  // It only touches, or lies in the plane.
  EXPECT_FALSE(Crosses(Point(0.2, 0.2, 0), Point(0.2, 0.2, 1), a, b, c));
  EXPECT_FALSE(Crosses(Point(-1, 0.2, 0), Point(1, 0.2, 0), a, b, c));
}

// Few small numbers, shifted and shrunk so that rounding matters: most points lie in planes and on
// lines of others.
TEST(ExactOrientation, CrossingIsThatOfIntegers) {
  std::mt19937 random(4);
  std::uniform_int_distribution<int> coordinate(0, 4);
  constexpr double kUnit = 0x1p-40;
  int crossing = 0, in_planes = 0;
  for (int trial = 0; trial < 40000; ++trial) {
    std::array<Point, 5> p;
    const bool is_flat = trial % 2 == 0;
    for (Point& point : p) {
      const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
      point = Point(1 + kUnit * x, kUnit * y, kUnit * (is_flat ? x + y : z));
    }
    const auto [start, end, a, b, c] = p;
    const auto side = [&](const Point& i, const Point& j, const Point& k, const Point& l) {
      return ByIntegers({i, j, k, l}, kUnit);
    };
    const int sides[] = {side(start, end, a, b), side(start, end, b, c), side(start, end, c, a)};
    const bool expected = side(a, b, c, start) * side(a, b, c, end) < 0 &&
                          (std::ranges::min(sides) >= 0 || std::ranges::max(sides) <= 0);
    EXPECT_EQ(Crosses(start, end, a, b, c), expected);
    crossing += expected;
    in_planes += side(a, b, c, start) == 0 && side(a, b, c, end) == 0;
  }
  EXPECT_GT(crossing, 1000);
  EXPECT_GT(in_planes, 20000);
}

TEST(ExactOrientation, CountsTheSignsThatRoundingHides) {
  const auto exact = [](const Point& p, const Point& q, const Point& a, const Point& b,
                        const Point& c, bool crosses) {
    uint32_t count = 0;
    EXPECT_EQ(Crosses(p, q, a, b, c, count), crosses);
    return count;
  };
  const Point a(0, 0, 0), b(1, 0, 1), c(0, 1, 1);
  EXPECT_EQ(exact(Point(0.25, 0.25, 0), Point(0.25, 0.25, 2), a, b, c, true), 0u);
  EXPECT_EQ(exact(Point(0.25, 0.25, 0), Point(0.5, 0.25, 0.5), a, b, c, false), 0u);
  // In the plane z = x + y, beside the triangle and in it, then in one across an axis, which needs
  // no exact sign.
  EXPECT_EQ(exact(Point(0.75, 0.5, 1.25), Point(1, 0.25, 1.25), a, b, c, false), 0u);
  EXPECT_EQ(exact(Point(0.25, 0.25, 0.5), Point(0.5, 0.25, 0.75), a, b, c, false), 1u);
  EXPECT_EQ(exact(Point(0.25, 3, 0.5), Point(0.5, 3, 0.75), Point(0, 3, 0), Point(1, 3, 0),
                  Point(0, 3, 1), false),
            0u);
  // From one side to the other, through a border.
  EXPECT_EQ(exact(Point(0.5, 0, -1), Point(0.5, 0, 2), a, b, c, true), 0u);
  EXPECT_EQ(exact(Point(0.25, 0, 0.75), Point(0.75, 0, 0.25), a, b, c, true), 0u);
}

}  // namespace
}  // namespace drape::test
