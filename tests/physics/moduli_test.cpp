// Stretch stiffness and shear modulus: cloths of the same material at several resolutions against
// closed forms; and all moduli together.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "tests/physics/preset_test.h"

namespace drape::test {
namespace {

using Eigen::Vector3d;

constexpr double kDensity_kg_per_m2 = 0.2;
constexpr double kGravity_m_per_s2 = 9.81;

// Held by its first row or column.
Scene HeldSheet(uint32_t columns, uint32_t rows, double width_m, double height_m,
                const StructuralMaterial& material, bool is_held_by_row) {
  std::vector<uint32_t> pins;
  for (uint32_t k = 0; k < (is_held_by_row ? columns : rows); ++k) {
    pins.push_back(is_held_by_row ? k : k * columns);
  }
  Scene scene = Grid(columns, rows, width_m, height_m, pins, material);
  scene.parameters.gravity_m_per_s2 = {0, 0, kGravity_m_per_s2};
  return scene;
}

class Moduli : public PhysicsTest {
 protected:
  // Largest distance of a particle from its place in the scene, over `steps` steps.
  double LargestMotion(const Scene& scene, uint32_t steps) {
    const ClothHandle cloth = Make(scene);
    double largest = 0;
    for (uint32_t step = 0; step < steps; ++step) {
      StepAlone(backend(), cloth, scene);
      largest = std::max(
          largest,
          FindWorst(ReadState(backend(), cloth).positions_m, scene.state.positions_m).distance);
    }
    return largest;
  }

  void ExpectSinkingByShear(const std::vector<std::pair<uint32_t, uint32_t>>& sizes);
};
class ModuliLong : public Moduli {};

// In the plane of the sheet, along its columns. The link above a row carries this row and those
// below, each 1 / rows of the weight: together the sheet is longer by w L^2 / 2E at any resolution.
// It starts there and stays, up to the second order in the step (the compliance is linear; kicks
// and columns that are not solved to the end are not) and the rounding of each link, added up.
TEST_P(Moduli, AHungSheetIsLongerByItsWeight) {
  constexpr double kLength_m = 0.8, kStiffness = 40;
  for (const auto& [columns, rows] : {std::pair{3u, 4u}, std::pair{5u, 17u}, std::pair{45u, 27u}}) {
    SCOPED_TRACE(rows);
    Scene scene =
        HeldSheet(columns, rows, 0.3, kLength_m, {.stretch_stiffness_n_per_m = kStiffness}, true);
    const double link_m = kLength_m / (rows - 1);
    double z = 0;
    for (uint32_t row = 0; row < rows; ++row) {
      // A row is 1 / rows of the weight.
      if (row > 0) {
        const double weight_n_per_m =
            kDensity_kg_per_m2 * kGravity_m_per_s2 * kLength_m * (rows - row) / rows;
        z += link_m * (1 + weight_n_per_m / kStiffness);
      }
      for (uint32_t column = 0; column < columns; ++column) {
        scene.state.positions_m[row * columns + column].z() = z;
      }
    }
    const double elongation_m =
        kDensity_kg_per_m2 * kGravity_m_per_s2 * kLength_m * kLength_m / (2 * kStiffness);
    EXPECT_NEAR(z - kLength_m, elongation_m, 1e-12);
    std::array<double, 3> motions;
    for (size_t k = 0; k < 3; ++k) {
      scene.parameters.settings.substeps = 20u << k;
      motions[k] = LargestMotion(scene, 3);
    }
    const double rounding = 8 * round_off() * kLength_m * rows;
    ExpectOrder(motions, 2, rounding);
    ExpectLimit(motions, 2, 0, rounding, "motion");
  }
}

// The angle in equilibrium of a column of cells that carries `load_n` across: all cells of the
// column, of spacings a and b, have the same shear, and their energy is that of their diagonals,
// sqrt(d^2 + 2 a b sin t) - d longer where they fall, sqrt(d^2 - 2 a b sin t) - d where they rise.
// Bisection of dU/dt = load a cos t.
double ShearAngle(double load_n, double a, double b, uint32_t falling, uint32_t rising,
                  double modulus) {
  const double d = std::hypot(a, b);
  const double k = modulus * d * d / (a * b);
  const auto moment = [&](double t) {
    double sum = 0;
    for (const auto& [cells, sign] : {std::pair{falling, 1.0}, std::pair{rising, -1.0}}) {
      const double length = std::sqrt(d * d + sign * 2 * a * b * std::sin(t));
      sum += cells * k * (length - d) * sign * a * b * std::cos(t) / length;
    }
    return sum - load_n * a * std::cos(t);
  };
  double low = 0, high = 1;
  for (int bisection = 0; bisection < 100; ++bisection) {
    const double middle = (low + high) / 2;
    (moment(middle) < 0 ? low : high) = middle;
  }
  return (low + high) / 2;
}

// Held by a column, weight along the columns: a beam that yields to shear alone. Its end sinks by
// w L^2 / 2G at any resolution, less a relative a^2 at most for angles up to a = w L / G. It starts
// in equilibrium and stays, to second order in the step and the rounding of each cell, added up.
void Moduli::ExpectSinkingByShear(const std::vector<std::pair<uint32_t, uint32_t>>& sizes) {
  constexpr double kLength_m = 0.5, kHeight_m = 0.4, kModulus = 12;
  for (const auto& [columns, rows] : sizes) {
    SCOPED_TRACE(columns);
    Scene scene =
        HeldSheet(columns, rows, kLength_m, kHeight_m, {.shear_modulus_n_per_m = kModulus}, false);
    scene.parameters.settings.max_iterations = 100;
    const double dx = kLength_m / (columns - 1), dz = kHeight_m / (rows - 1);
    double x = 0, z = 0;
    for (uint32_t column = 0; column < columns; ++column) {
      if (column > 0) {
        const double load_n = kDensity_kg_per_m2 * kGravity_m_per_s2 * kLength_m * kHeight_m *
                              (columns - column) / columns;
        // Of the cells before it, in turn; the first of the first column falls.
        const uint32_t falling = (rows - 1 + column % 2) / 2;
        const double angle = ShearAngle(load_n, dx, dz, falling, rows - 1 - falling, kModulus);
        x += dx * std::cos(angle);
        z += dx * std::sin(angle);
      }
      for (uint32_t row = 0; row < rows; ++row) {
        scene.state.positions_m[row * columns + column] = {x, 0, row * dz + z};
      }
    }
    const double sinking_m =
        kDensity_kg_per_m2 * kGravity_m_per_s2 * kLength_m * kLength_m / (2 * kModulus);
    EXPECT_NEAR(z, sinking_m, sinking_m * std::pow(2 * sinking_m / kLength_m, 2));
    scene.parameters.settings.use_tethers = false;  // they have no slack along a taut row
    std::array<double, 3> motions;
    for (size_t k = 0; k < 3; ++k) {
      scene.parameters.settings.substeps = 30u << k;
      motions[k] = LargestMotion(scene, 3);
    }
    const double rounding = 8 * round_off() * kLength_m * columns * columns;
    ExpectOrder(motions, 2, rounding);
    ExpectLimit(motions, 2, 0, rounding, "motion");
  }
}

TEST_P(Moduli, ASheetHeldByItsSideSinksByShear) {
  ExpectSinkingByShear({{4, 3}, {11, 6}});
}

TEST_P(ModuliLong, ASheetHeldByItsSideSinksByShear) {
  ExpectSinkingByShear({{21, 33}});
}

// A woven mesh that is held like that, cut crosswise. It sinks by shear as the grid does, and as a
// beam of its threads by 3 w L^4 / 2 E H^2: together w L^2 (1/2G + 3 L^2 / 2 E H^2). Bounds: (2
// a)^2 relative for angles up to a = w L / G, 2 G / E since diagonals resist stretch, too, and
// 1/n^2 of the beam, n rows of threads.
TEST_P(Moduli, AWovenMeshSinksByShear) {
  constexpr double kLength_m = 0.5, kHeight_m = 0.4, kModulus = 20;
  constexpr double kStretch = 2e5;  // so stiff that its sections cannot warp
  for (const auto& [columns, rows] : {std::pair{11u, 9u}, std::pair{18u, 11u}}) {
    SCOPED_TRACE(columns);
    std::vector<uint32_t> pins;
    for (uint32_t row = 0; row < rows; ++row) pins.push_back(row * columns);
    Scene scene =
        MeshedGrid(columns, rows, kLength_m, kHeight_m, pins,
                   {.stretch_stiffness_n_per_m = kStretch, .shear_modulus_n_per_m = kModulus});
    scene.parameters.gravity_m_per_s2 = {0, 0, kGravity_m_per_s2};
    scene.parameters.damping_per_s = 8;
    const std::vector<Vector3d> ends_m = StateAfter(scene, 90).positions_m;
    double sinking_m = 0;
    for (uint32_t row = 0; row < rows; ++row) {
      const uint32_t end = (row + 1) * columns - 1;
      sinking_m += (ends_m[end].z() - scene.state.positions_m[end].z()) / rows;
    }
    const double weight_n_per_m2 = kDensity_kg_per_m2 * kGravity_m_per_s2;
    const double by_shear_m = weight_n_per_m2 * kLength_m * kLength_m / (2 * kModulus);
    const double by_bending_m =
        3 * weight_n_per_m2 * std::pow(kLength_m, 4) / (2 * kStretch * kHeight_m * kHeight_m);
    const double angle = weight_n_per_m2 * kLength_m / kModulus;
    EXPECT_NEAR(sinking_m, by_shear_m + by_bending_m,
                by_shear_m * (4 * angle * angle + 2 * kModulus / kStretch) +
                    by_bending_m / ((rows - 1) * (rows - 1)));
  }
}

// A sheet of all moduli, let go from the horizontal with its first row held: the middle of its
// lower edge is at the same place at any resolution, to first order in the spacing (the particles
// of the rim weigh as much as the others).
TEST_P(Moduli, FinerGridsOfOneClothSwingAlike) {
  std::vector<Vector3d> ends_m;
  for (const uint32_t side : {9u, 17u, 33u}) {
    Scene scene = HeldSheet(side, side, 0.5, 0.5,
                            {.stretch_stiffness_n_per_m = 60,
                             .bending_rigidity_n_m = 2e-4,
                             .shear_modulus_n_per_m = 10},
                            true);
    scene.parameters.gravity_m_per_s2 = {0, -kGravity_m_per_s2, 0};
    ends_m.push_back(StateAfter(scene, 12).positions_m[side * (side - 1) + side / 2]);
  }
  EXPECT_LE((ends_m[2] - ends_m[1]).norm(), (ends_m[1] - ends_m[0]).norm() / std::exp2(0.8));
}

}  // namespace

DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(Moduli);
DRAPE_PHYSICS_TEST_ON_EVERY_BACKEND(ModuliLong);

}  // namespace drape::test
