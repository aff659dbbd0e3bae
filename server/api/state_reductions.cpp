#include "server/api/state_reductions.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace drape::api {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// Cells a side of the grid on which covered area is counted, as in SoftGym.
constexpr int kCells = 100;
// Of a box without width, so that a square still has cells.
constexpr double kMinCell_m = 1e-9;

// The cells [first, last) of one axis that a square covers.
struct CellRange {
  int first, last;
};

CellRange CellsUnder(double middle_m, double radius_m, double cell_m) {
  const auto cell = [&](double place_m) {
    return static_cast<int>(std::clamp(std::nearbyint(place_m / cell_m), 0.0, double{kCells}));
  };
  return {cell(middle_m - radius_m), cell(middle_m + radius_m)};
}

// Covered area by SoftGym's rule (Lin et al. 2020, _get_current_covered_area). Each square adds to
// the four corners of its cells; sums along both axes then count the squares over each cell, so
// that a square costs the same however large it is.
class CoveredCells {
 public:
  CoveredCells(const AlignedBox3d& box, double radius_m)
      : low_(box.min()), radius_m_(radius_m), sides_m_(box.sizes()), corners_(kSide * kSide) {}

  void Add(const Vector3d& position) {
    const Vector3d at = position - low_;
    const CellRange x = CellsUnder(at.x(), radius_m_, std::max(sides_m_.x() / kCells, kMinCell_m));
    const CellRange z = CellsUnder(at.z(), radius_m_, std::max(sides_m_.z() / kCells, kMinCell_m));
    Corner(x.first, z.first) += 1;
    Corner(x.first, z.last) -= 1;
    Corner(x.last, z.first) -= 1;
    Corner(x.last, z.last) += 1;
  }

  double Area_m2() {
    int covered = 0;
    std::vector<int64_t> above(kSide);  // squares over each cell of the row
    for (int x = 0; x < kCells; ++x) {
      int64_t along = 0;
      for (int z = 0; z < kCells; ++z) {
        along += Corner(x, z);
        above[z] += along;
        covered += above[z] > 0;
      }
    }
    return covered * (sides_m_.x() / kCells) * (sides_m_.z() / kCells);
  }

 private:
  static constexpr int kSide = kCells + 1;
  int64_t& Corner(int x, int z) { return corners_[x * kSide + z]; }

  Vector3d low_;
  double radius_m_;
  Vector3d sides_m_;
  std::vector<int64_t> corners_;
};

}  // namespace

Reductions Reduce(const ReductionSpec& spec, const ScalarColumn& positions_m, size_t first_row,
                  size_t row_count, const Placement& placement) {
  Vector3d sum = Vector3d::Zero();
  AlignedBox3d box;
  double distance_m = 0;
  for (size_t k = 0; k < row_count; ++k) {
    const Vector3d position = VectorAt(positions_m, first_row + k);
    sum += position;
    box.extend(position);
    if (spec.target_distance) {
      distance_m += (placement.EnvironmentFromCloth(position) - spec.target_m->col(k)).norm();
    }
  }
  Reductions found;
  const double count = static_cast<double>(row_count);
  found.centroid_m = placement.WorldFromCloth(sum / count);
  found.box_m = {placement.WorldFromCloth(box.min()), placement.WorldFromCloth(box.max())};
  found.target_distance_m = distance_m / count;
  if (spec.coverage) {
    CoveredCells cells(box, spec.coverage_radius_m);
    for (size_t k = 0; k < row_count; ++k) cells.Add(VectorAt(positions_m, first_row + k));
    found.coverage_m2 = cells.Area_m2();
  }
  return found;
}

}  // namespace drape::api
