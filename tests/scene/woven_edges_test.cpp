// Where edges lie between the threads, and what woven meshes store when they are strained.
#include "server/scene/woven_edges.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/scene/constraint_builder.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kStretch_n_per_m = 2000, kShear_n_per_m = 40;
constexpr double kRounding = 1e-12;

// A triangle with an edge at this angle to the x axis within the plane of x and z, or of x and y.
double BiasAt(double angle, bool lies, const Vector3d& warp) {
  const Vector3d along = lies ? Vector3d(std::cos(angle), 0, std::sin(angle))
                              : Vector3d(std::cos(angle), std::sin(angle), 0);
  const Vector3d apex = lies ? Vector3d(0.3, 0, -2) : Vector3d(0.3, -2, 0);
  return BiasOf({.i = 0, .j = 1, .opposite_vertices = {2}}, {Vector3d::Zero(), along, apex}, warp);
}

TEST(WovenEdges, BiasIsThatOfTheAngle) {
  for (const double angle : {0.0, 0.2, std::numbers::pi / 4, 1.0, std::numbers::pi / 2, 2.5}) {
    const double expected = std::pow(std::sin(2 * angle), 2) / 4;
    EXPECT_NEAR(BiasAt(angle, true, Vector3d::UnitY()), expected, kRounding) << angle;
    EXPECT_NEAR(BiasAt(angle, false, Vector3d::UnitY()), expected, kRounding) << angle;
    EXPECT_NEAR(BiasAt(angle, true, Vector3d(0, 0, -3)), expected, kRounding) << angle;
    // Threads that are turned by 0.2.
    const Vector3d turned = 7 * Vector3d(std::cos(0.2), 0, std::sin(0.2));
    EXPECT_NEAR(BiasAt(angle, true, turned), std::pow(std::sin(2 * (angle - 0.2)), 2) / 4,
                kRounding)
        << angle;
  }
}

// Steeper than 45 degrees against the warp, the direction across it counts.
TEST(WovenEdges, ThreadsOfSteepCloth) {
  // A plane of the x axis that rises by `slope`, and an edge in it at 30 degrees to the x axis.
  const auto bias = [](double slope, const Vector3d& warp) {
    const Vector3d up(0, std::sin(slope), std::cos(slope));
    const Vector3d along = std::cos(std::numbers::pi / 6) * Vector3d::UnitX() +
                           std::sin(std::numbers::pi / 6) * up;
    return BiasOf({.i = 0, .j = 1, .opposite_vertices = {2}}, {Vector3d::Zero(), along, 2 * up},
                  warp);
  };
  const double expected = 3.0 / 16;
  for (const double slope : {0.0, 0.5, 1.2}) {
    EXPECT_NEAR(bias(slope, Vector3d::UnitY()), expected, kRounding) << slope;
  }
  // The warp lies along (1, 1, 0) / sqrt 2 where it is projected: half a right angle more.
  EXPECT_NEAR(bias(0, Vector3d(1, 1, 0)), expected, kRounding);
  EXPECT_NEAR(bias(std::numbers::pi / 2, Vector3d(1, 1, 0)),
              std::pow(std::sin(2 * (std::numbers::pi / 6 - std::numbers::pi / 4)), 2) / 4,
              kRounding);
}

TEST(WovenEdges, BiasIsTheMeanOfTheSheetsBeside) {
  // The edge runs along x; the second triangle stands on it, so that both have their threads along
  // x, or one of them along (0, 1, 1), where both see it across.
  const std::vector<Vector3d> positions = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 1}, {0.5, 1, 0}};
  EXPECT_NEAR(BiasOf({.i = 0, .j = 1, .opposite_vertices = {2, 3}}, positions, Vector3d::UnitY()),
              0, kRounding);
  const double lying = BiasOf({.i = 0, .j = 1, .opposite_vertices = {2}}, positions, {1, 2, 3});
  const double upright = BiasOf({.i = 0, .j = 1, .opposite_vertices = {3}}, positions, {1, 2, 3});
  EXPECT_GT(std::abs(lying - upright), 0.01);
  EXPECT_NEAR(BiasOf({.i = 0, .j = 1, .opposite_vertices = {2, 3}}, positions, {1, 2, 3}),
              (lying + upright) / 2, kRounding);
}

// Cells of a x b, cut crosswise or alike, the whole turned in space with its warp.
struct Sheet {
  TriangleMesh mesh;
  Vector3d warp, weft;
  double area_m2 = 0;
};

Sheet MakeSheet(double a, double b, bool is_cut_alike) {
  constexpr uint32_t kCells = 6;
  const Eigen::AngleAxisd turn(0.8, Vector3d(1, 2, -1).normalized());
  Sheet sheet{.mesh = {}, .warp = turn * Vector3d::UnitX(), .weft = turn * Vector3d::UnitZ()};
  for (uint32_t row = 0; row <= kCells; ++row) {
    for (uint32_t column = 0; column <= kCells; ++column) {
      sheet.mesh.positions_m.push_back(turn * Vector3d(a * column, 0, b * row) +
                                       Vector3d(5, -3, 2));
      if (row == kCells || column == kCells) continue;
      const uint32_t i = row * (kCells + 1) + column, j = i + 1, k = i + kCells + 1, l = k + 1;
      if (is_cut_alike || (row + column) % 2 == 0) {
        sheet.mesh.triangles.insert(sheet.mesh.triangles.end(), {{i, k, l}, {i, l, j}});
      } else {
        sheet.mesh.triangles.insert(sheet.mesh.triangles.end(), {{i, k, j}, {j, k, l}});
      }
    }
  }
  sheet.area_m2 = kCells * kCells * a * b;
  return sheet;
}

// Of all edges per area, by second differences of the energy: 2 U / (strain^2 area) [N/m] where the
// sheet is strained by `strain` times (x of the warp, of the weft).
double Stiffness(const Sheet& sheet, const ParticleSystem& system, const Eigen::Matrix2d& strain) {
  double energy = 0;
  for (const DistanceConstraint& edge : system.distance_constraints) {
    const Vector3d d = system.rest_positions_m[edge.j] - system.rest_positions_m[edge.i];
    const Eigen::Vector2d within(d.dot(sheet.warp), d.dot(sheet.weft));
    const double elongation_m = within.dot(strain * within) / d.norm();  // to first order
    energy += elongation_m * elongation_m / (2 * edge.compliance_m_per_n);
  }
  return 2 * energy / sheet.area_m2;
}

// Sheared by an angle, edges along threads keep their lengths, and what the diagonals store is the
// modulus to 1/(1 + (1 - 4 q) G/(q E)), q the bias of the diagonal: exactly for squares. Pulled along
// its threads, the sheet has their stiffness, and at most that of the diagonals more.
TEST(WovenEdges, MeshesOfSquaresHaveTheModuli) {
  for (const auto& [a, b] : {std::pair{0.03, 0.03}, std::pair{0.03, 0.02}, std::pair{0.5, 1.0}}) {
    for (const bool is_cut_alike : {false, true}) {
      SCOPED_TRACE(std::to_string(a) + " x " + std::to_string(b));
      const Sheet sheet = MakeSheet(a, b, is_cut_alike);
      const ParticleSystem system =
          BuildMesh(sheet.mesh,
                    {.stretch_stiffness_n_per_m = kStretch_n_per_m,
                     .shear_modulus_n_per_m = kShear_n_per_m},
                    {.warp_direction = sheet.warp});
      const double q = std::pow(a * b / (a * a + b * b), 2);
      const double shear =
          kShear_n_per_m / (1 + (1 - 4 * q) * kShear_n_per_m / (q * kStretch_n_per_m));
      const Eigen::Matrix2d sheared = (Eigen::Matrix2d() << 0, 0.5, 0.5, 0).finished();
      EXPECT_NEAR(Stiffness(sheet, system, sheared), shear, 1e-9 * shear);
      const double cosine = a / std::hypot(a, b), sine = b / std::hypot(a, b);
      for (const bool is_warp : {true, false}) {
        const Eigen::Matrix2d pulled =
            (Eigen::Matrix2d() << (is_warp ? 1 : 0), 0, 0, (is_warp ? 0 : 1)).finished();
        const double of_diagonals = shear * std::pow(is_warp ? cosine / sine : sine / cosine, 2);
        EXPECT_NEAR(Stiffness(sheet, system, pulled), kStretch_n_per_m + of_diagonals,
                    1e-9 * kStretch_n_per_m);
      }
    }
  }
}

// A mesh without a modulus of shear is what it was, wherever the warp points.
TEST(WovenEdges, NothingIsWovenWithoutAModulus) {
  const Sheet sheet = MakeSheet(0.03, 0.02, false);
  const StructuralMaterial material{.stretch_stiffness_n_per_m = kStretch_n_per_m};
  const ParticleSystem plain = BuildMesh(sheet.mesh, material, {});
  const ParticleSystem turned = BuildMesh(sheet.mesh, material, {.warp_direction = {1, 1, 1}});
  ASSERT_EQ(plain.distance_constraints.size(), turned.distance_constraints.size());
  for (size_t k = 0; k < plain.distance_constraints.size(); ++k) {
    EXPECT_EQ(plain.distance_constraints[k].compliance_m_per_n,
              turned.distance_constraints[k].compliance_m_per_n);
  }
}

// Inextensible threads: edges along them keep their lengths, the others resist shear.
TEST(WovenEdges, ThreadsMayBeInextensible) {
  const Sheet sheet = MakeSheet(0.03, 0.03, false);
  const ParticleSystem system = BuildMesh(sheet.mesh, {.shear_modulus_n_per_m = kShear_n_per_m},
                                          {.warp_direction = sheet.warp});
  for (const DistanceConstraint& edge : system.distance_constraints) {
    const Vector3d d = system.rest_positions_m[edge.j] - system.rest_positions_m[edge.i];
    const bool is_diagonal =
        std::min(std::abs(d.dot(sheet.warp)), std::abs(d.dot(sheet.weft))) > 0.01;
    // Halfway between the threads it stands for a strip of L/2, and 4 G.
    EXPECT_NEAR(edge.compliance_m_per_n, is_diagonal ? 1 / (2 * kShear_n_per_m) : 0, 1e-12);
  }
}

}  // namespace
}  // namespace drape
