#include "server/api/state_encoding.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace drape::api {
namespace {

using Eigen::Vector3d;

constexpr size_t kRows = 1000;

// Positions within `size_m` of a place, in the precision T.
template <class T>
ScalarColumn RandomRows(uint32_t seed, double size_m, const Vector3d& place_m) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<T> values(3 * kRows);
  for (size_t k = 0; k < values.size(); ++k) {
    values[k] =
        static_cast<T>(place_m[static_cast<Eigen::Index>(k % 3)] + size_m * uniform(random));
  }
  return values;
}

template <class T>
std::vector<T> NumbersOf(const std::string& data) {
  std::vector<T> numbers(data.size() / sizeof(T));
  std::memcpy(numbers.data(), data.data(), data.size());
  return numbers;
}

// Rounding to 11 bits: half a unit in the last place, and one rounding to float before.
TEST(StateEncoding, Float16IsWithin2ToMinus11) {
  for (const double size_m : {1e-3, 0.4, 30.0, 4000.0}) {
    const ScalarColumn column = RandomRows<double>(7, size_m, Vector3d(size_m, 0, -size_m));
    const Vector3d shift(0.1 * size_m, 0, 3e-4 * size_m);
    std::string data;
    AppendFloat16(column, 0, kRows, shift, &data);
    const auto halves = NumbersOf<Eigen::half>(data);
    ASSERT_EQ(halves.size(), 3 * kRows);
    for (size_t k = 0; k < halves.size(); ++k) {
      const auto axis = static_cast<Eigen::Index>(k % 3);
      const double exact = VectorAt(column, k / 3)[axis] + shift[axis];
      const double allowed = std::max(std::abs(exact) * std::ldexp(1, -11), std::ldexp(1, -25));
      EXPECT_LE(std::abs(static_cast<double>(halves[k]) - exact), allowed) << size_m << " " << k;
    }
  }
}

TEST(StateEncoding, Float16GoesToInfinityBeyondItsRange) {
  std::string data;
  AppendFloat16(std::vector<float>{65504, 65519, -65520}, 0, 1, Vector3d::Zero(), &data);
  const auto halves = NumbersOf<Eigen::half>(data);
  EXPECT_EQ(static_cast<float>(halves[0]), 65504.f);
  EXPECT_EQ(static_cast<float>(halves[1]), 65504.f);
  EXPECT_EQ(static_cast<float>(halves[2]), -std::numeric_limits<float>::infinity());
}

template <class T>
void ExpectWithinHalfAStep(double size_m, const Vector3d& place_m) {
  const ScalarColumn column = RandomRows<T>(11, size_m, place_m);
  const FixedGrid grid = FixedGridOf(column, 100, kRows - 100);
  Eigen::AlignedBox3d box;
  for (size_t k = 100; k < kRows; ++k) box.extend(VectorAt(column, k));
  EXPECT_NEAR(grid.step_m, box.sizes().maxCoeff() / 65534, 1e-12 * size_m);
  std::string data;
  AppendFixed16(column, 100, kRows - 100, grid, &data);
  const auto numbers = NumbersOf<int16_t>(data);
  ASSERT_EQ(numbers.size(), 3 * (kRows - 100));
  double worst_m = 0;
  for (size_t k = 0; k < numbers.size(); ++k) {
    const auto axis = static_cast<Eigen::Index>(k % 3);
    const double decoded = grid.middle_m[axis] + grid.step_m * numbers[k];
    worst_m = std::max(worst_m, std::abs(decoded - VectorAt(column, 100 + k / 3)[axis]));
  }
  const double rounding_m = 1e-15 * (size_m + place_m.norm());
  EXPECT_LE(worst_m, grid.step_m / 2 + rounding_m) << size_m << " at " << place_m.transpose();
  EXPECT_GE(worst_m, 0.4 * grid.step_m) << "2700 random numbers";
}

TEST(StateEncoding, Fixed16IsWithinHalfAStep) {
  for (const double size_m : {1e-6, 0.3, 1.0, 5000.0}) {
    for (const Vector3d& place_m : {Vector3d(0, 0, 0), Vector3d(3, -2, 0.1), Vector3d(1e4, 0, 2)}) {
      ExpectWithinHalfAStep<double>(size_m, place_m);
      // Single precision has no random places within a micrometre of 10 km.
      if (size_m > 1e-5 * place_m.norm()) ExpectWithinHalfAStep<float>(size_m, place_m);
    }
  }
}

TEST(StateEncoding, OneFarPlaceIsExact) {
  const ScalarColumn column = std::vector<double>{1e5, -2, 7, 1e5, -2, 7};
  const FixedGrid grid = FixedGridOf(column, 0, 2);
  EXPECT_EQ(grid.step_m, 0);
  EXPECT_EQ(grid.middle_m, Vector3d(1e5, -2, 7));
  std::string data;
  AppendFixed16(column, 0, 2, grid, &data);
  EXPECT_EQ(NumbersOf<int16_t>(data), std::vector<int16_t>(6, 0));
}

}  // namespace
}  // namespace drape::api
