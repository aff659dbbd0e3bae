#include "server/api/state_reductions.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

namespace drape::api {
namespace {

using Eigen::Vector3d;

constexpr int kSide = 41;
constexpr double kSize_m = 0.8;
constexpr double kRadius_m = kSize_m / (kSide - 1) / 2;

ScalarColumn ColumnOf(const std::vector<Vector3d>& rows) {
  std::vector<double> values;
  for (const Vector3d& row : rows) values.insert(values.end(), row.begin(), row.end());
  return values;
}

// A square sheet of kSide x kSide particles, turned about y.
std::vector<Vector3d> Sheet(double yaw_rad, const Vector3d& middle_m) {
  const Eigen::AngleAxisd turn(yaw_rad, Vector3d::UnitY());
  std::vector<Vector3d> rows;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vector3d at(k % kSide, 0, static_cast<double>(k / kSide));
    rows.push_back(middle_m + turn * (at * (2 * kRadius_m) - Vector3d(0.5, 0, 0.5) * kSize_m));
  }
  return rows;
}

double CoverageOf(const std::vector<Vector3d>& rows, double radius_m) {
  const ReductionSpec spec{.coverage = true, .coverage_radius_m = radius_m};
  return Reduce(spec, ColumnOf(rows), 0, rows.size(), {}).coverage_m2;
}

// A flat sheet covers its own area. The grid cuts the squares off at the box of the particles, and
// its cells are kSize_m / 100 wide or up to sqrt(2) wider when the sheet is turned.
TEST(StateReductions, AFlatSheetCoversItsArea) {
  EXPECT_NEAR(CoverageOf(Sheet(0, {3, 1, -40}), kRadius_m), kSize_m * kSize_m, 1e-9);
  for (const double yaw_rad : {0.1, 0.5, 0.7}) {
    const double cell_m = kSize_m * (std::cos(yaw_rad) + std::sin(yaw_rad)) / 100;
    EXPECT_NEAR(CoverageOf(Sheet(yaw_rad, {3, 1, -40}), kRadius_m * (1 + std::sin(yaw_rad))),
                kSize_m * kSize_m, 4 * kSize_m * (cell_m + 2 * kRadius_m))
        << yaw_rad;
  }
}

TEST(StateReductions, AFoldedSheetCoversHalf) {
  std::vector<Vector3d> rows = Sheet(0, {0, 0, 0});
  for (Vector3d& row : rows) row.x() = std::abs(row.x());
  EXPECT_NEAR(CoverageOf(rows, kRadius_m), kSize_m * kSize_m / 2, kSize_m * kRadius_m);
}

// The same rule, square by square and cell by cell.
TEST(StateReductions, CoverageIsTheUnionOfSquares) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 0.3);
  for (const double radius_m : {1e-4, 0.02, 0.3, 100.0}) {
    std::vector<Vector3d> rows(60);
    for (Vector3d& row : rows) row = {normal(random), normal(random), 2 * normal(random)};
    Eigen::AlignedBox3d box;
    for (const Vector3d& row : rows) box.extend(row);
    const Vector3d cell_m = box.sizes() / 100;
    const auto covers = [&](const Vector3d& row, int axis, int cell) {
      const double middle = row[axis] - box.min()[axis];
      return cell >= std::nearbyint((middle - radius_m) / cell_m[axis]) &&
             cell < std::nearbyint((middle + radius_m) / cell_m[axis]);
    };
    int covered = 0;
    for (int cell = 0; cell < 100 * 100; ++cell) {
      covered += std::any_of(rows.begin(), rows.end(), [&](const Vector3d& row) {
        return covers(row, 0, cell / 100) && covers(row, 2, cell % 100);
      });
    }
    EXPECT_DOUBLE_EQ(CoverageOf(rows, radius_m), covered * cell_m.x() * cell_m.z()) << radius_m;
  }
}

TEST(StateReductions, OneLineCoversNothing) {
  EXPECT_EQ(CoverageOf({{1, 2, 3}, {1, 0, 3}}, 0.1), 0);
}

TEST(StateReductions, CentroidBoxAndDistanceAreInTheirFrames) {
  const ScalarColumn column = ColumnOf({{9, 9, 9}, {0, 0, 0}, {1, 2, 3}, {2, 1, 0}, {8, 8, 8}});
  const Placement placement{.environment_origin_m = {100, 0, 0},
                            .origin_in_environment_m = {0, 10, 0}};
  auto target = std::make_shared<Eigen::Matrix3Xd>(3, 3);
  *target << 0, 1, 2,  //
      10, 12, 11,      //
      0, 3, 6;         // the first two are there, the last is 6 m away
  const ReductionSpec spec{
      .centroid = true, .box = true, .target_distance = true, .target_m = target};
  const Reductions found = Reduce(spec, column, 1, 3, placement);
  EXPECT_TRUE(found.centroid_m.isApprox(Vector3d(101, 11, 1)));
  EXPECT_TRUE(found.box_m.min().isApprox(Vector3d(100, 10, 0)));
  EXPECT_TRUE(found.box_m.max().isApprox(Vector3d(102, 12, 3)));
  EXPECT_DOUBLE_EQ(found.target_distance_m, 2);
}

}  // namespace
}  // namespace drape::api
