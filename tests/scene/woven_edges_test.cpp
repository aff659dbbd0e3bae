// Where edges lie between the threads, and what woven meshes store when they are strained.
#include "server/scene/woven_edges.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/scene/constraint_builder.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kStretch_n_per_m = 2000, kShear_n_per_m = 40;
constexpr double kWeaveRounding = 1e-12;

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
    EXPECT_NEAR(BiasAt(angle, true, Vector3d::UnitY()), expected, kWeaveRounding) << angle;
    EXPECT_NEAR(BiasAt(angle, false, Vector3d::UnitY()), expected, kWeaveRounding) << angle;
    EXPECT_NEAR(BiasAt(angle, true, Vector3d(0, 0, -3)), expected, kWeaveRounding) << angle;
    // Threads that are turned by 0.2.
    const Vector3d turned = 7 * Vector3d(std::cos(0.2), 0, std::sin(0.2));
    EXPECT_NEAR(BiasAt(angle, true, turned), std::pow(std::sin(2 * (angle - 0.2)), 2) / 4,
                kWeaveRounding)
        << angle;
  }
}

// Steeper than 45 degrees against the warp, the direction across it counts.
TEST(WovenEdges, ThreadsOfSteepCloth) {
  // A plane of the x axis that rises by `slope`, and an edge in it at 30 degrees to the x axis.
  const auto bias = [](double slope, const Vector3d& warp) {
    const Vector3d up(0, std::sin(slope), std::cos(slope));
    const Vector3d along =
        std::cos(std::numbers::pi / 6) * Vector3d::UnitX() + std::sin(std::numbers::pi / 6) * up;
    return BiasOf({.i = 0, .j = 1, .opposite_vertices = {2}}, {Vector3d::Zero(), along, 2 * up},
                  warp);
  };
  const double expected = 3.0 / 16;
  for (const double slope : {0.0, 0.5, 1.2}) {
    EXPECT_NEAR(bias(slope, Vector3d::UnitY()), expected, kWeaveRounding) << slope;
  }
  // The warp lies along (1, 1, 0) / sqrt 2 where it is projected: half a right angle more.
  EXPECT_NEAR(bias(0, Vector3d(1, 1, 0)), expected, kWeaveRounding);
  EXPECT_NEAR(bias(std::numbers::pi / 2, Vector3d(1, 1, 0)),
              std::pow(std::sin(2 * (std::numbers::pi / 6 - std::numbers::pi / 4)), 2) / 4,
              kWeaveRounding);
}

TEST(WovenEdges, BiasIsTheMeanOfTheSheetsBeside) {
  // The edge runs along x; the second triangle stands on it, so that both have their threads along
  // x, or one of them along (0, 1, 1), where both see it across.
  const std::vector<Vector3d> positions = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 1}, {0.5, 1, 0}};
  EXPECT_NEAR(BiasOf({.i = 0, .j = 1, .opposite_vertices = {2, 3}}, positions, Vector3d::UnitY()),
              0, kWeaveRounding);
  const double lying = BiasOf({.i = 0, .j = 1, .opposite_vertices = {2}}, positions, {1, 2, 3});
  const double upright = BiasOf({.i = 0, .j = 1, .opposite_vertices = {3}}, positions, {1, 2, 3});
  EXPECT_GT(std::abs(lying - upright), 0.01);
  EXPECT_NEAR(BiasOf({.i = 0, .j = 1, .opposite_vertices = {2, 3}}, positions, {1, 2, 3}),
              (lying + upright) / 2, kWeaveRounding);
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
// modulus to 1/(1 + (1 - 4 q) G/(q E)), q the bias of the diagonal: exactly for squares. Pulled
// along its threads, the sheet has their stiffness, and at most that of the diagonals more.
TEST(WovenEdges, MeshesOfSquaresHaveTheModuli) {
  for (const auto& [a, b] : {std::pair{0.03, 0.03}, std::pair{0.03, 0.02}, std::pair{0.5, 1.0}}) {
    for (const bool is_cut_alike : {false, true}) {
      SCOPED_TRACE(std::to_string(a) + " x " + std::to_string(b));
      const Sheet sheet = MakeSheet(a, b, is_cut_alike);
      const ParticleSystem system = BuildMesh(
          sheet.mesh,
          {.stretch_stiffness_n_per_m = kStretch_n_per_m, .shear_modulus_n_per_m = kShear_n_per_m},
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

enum class Triangles { kCrossed, kRandom, kEquilateral };

// A flat square of about 24 x 24 cells, vertices within it off their places by up to `shake`.
ParticleSystem IrregularPatch(Triangles triangles, double shake) {
  constexpr uint32_t kSide = 25;
  std::mt19937 engine(7);
  const auto off = [&] { return shake * (static_cast<double>(engine()) / 0x1p31 - 1); };
  TriangleMesh mesh;
  for (uint32_t row = 0; row < kSide; ++row) {
    for (uint32_t column = 0; column < kSide; ++column) {
      const bool is_rim = row % (kSide - 1) == 0 || column % (kSide - 1) == 0;
      const bool is_equilateral = triangles == Triangles::kEquilateral;
      const double x = column + (is_equilateral && row % 2 == 1 ? 0.5 : 0);
      const double z = row * (is_equilateral ? std::sqrt(0.75) : 1);
      mesh.positions_m.emplace_back(x + (is_rim ? 0 : off()), 0, z + (is_rim ? 0 : off()));
      if (row + 1 == kSide || column + 1 == kSide) continue;
      const uint32_t a = row * kSide + column, b = a + 1, c = a + kSide, d = c + 1;
      bool falls = (row + column) % 2 == 0;
      if (triangles == Triangles::kRandom) falls = engine() >> 31 != 0;
      if (is_equilateral) falls = row % 2 == 1;
      if (falls) {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, d}, {a, d, b}});
      } else {
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
      }
    }
  }
  return BuildMesh(mesh, {.stretch_stiffness_n_per_m = kStretch_n_per_m,
                          .shear_modulus_n_per_m = kShear_n_per_m});
}

// What the patch resists in its plane, with its rim held where the strain says and all others where
// they rest: the stiffness of the warp, that of the weft and the modulus of shear [N/m].
struct Resistance {
  double warp, weft, shear;
};

Resistance ResistanceOf(const ParticleSystem& system) {
  const auto& p = system.rest_positions_m;
  std::vector<bool> is_rim(p.size(), false);
  double area_m2 = 0;
  for (const auto& [i, j, k] : system.triangles) area_m2 += TriangleArea(p[i], p[j], p[k]);
  for (const MeshEdge& edge : UniqueEdges(system.triangles)) {
    if (edge.opposite_vertices.size() == 1) is_rim[edge.i] = is_rim[edge.j] = true;
  }
  const auto count = static_cast<Eigen::Index>(2 * p.size());
  std::vector<Eigen::Triplet<double>> entries, inner;
  for (const DistanceConstraint& edge : system.distance_constraints) {
    const Vector3d d = (p[edge.j] - p[edge.i]).normalized();
    const Eigen::Vector2d n(d.x(), d.z());
    for (const auto& [a, b, sign] :
         {std::tuple{edge.i, edge.i, 1.0}, std::tuple{edge.j, edge.j, 1.0},
          std::tuple{edge.i, edge.j, -1.0}, std::tuple{edge.j, edge.i, -1.0}}) {
      for (int row = 0; row < 2; ++row) {
        for (int column = 0; column < 2; ++column) {
          const double k = sign * n[row] * n[column] / edge.compliance_m_per_n;
          entries.emplace_back(2 * static_cast<int>(a) + row, 2 * static_cast<int>(b) + column, k);
          if (is_rim[a] || is_rim[b]) continue;
          inner.push_back(entries.back());
        }
      }
    }
  }
  for (size_t i = 0; i < p.size(); ++i) {
    for (int row = 0; is_rim[i] && row < 2; ++row) {
      inner.emplace_back(2 * static_cast<int>(i) + row, 2 * static_cast<int>(i) + row, 1.0);
    }
  }
  Eigen::SparseMatrix<double> all(count, count), free(count, count);
  all.setFromTriplets(entries.begin(), entries.end());
  free.setFromTriplets(inner.begin(), inner.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(free);
  Eigen::MatrixXd moves(count, 3);
  for (size_t i = 0; i < p.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(2 * i);
    moves.block<2, 3>(row, 0) << p[i].x(), 0, p[i].z() / 2, 0, p[i].z(), p[i].x() / 2;
  }
  Eigen::MatrixXd forces = all * moves;
  for (size_t i = 0; i < p.size(); ++i) {
    if (is_rim[i]) forces.middleRows(static_cast<Eigen::Index>(2 * i), 2).setZero();
  }
  moves -= solver.solve(forces);
  const Eigen::Matrix3d stiffness = moves.transpose() * (all * moves) / area_m2;
  const Eigen::Matrix3d softness = stiffness.inverse();
  return {1 / softness(0, 0), 1 / softness(1, 1), 1 / softness(2, 2)};
}

// No choice of stiffnesses gives irregular triangles both moduli: an edge that is off a thread by
// the angle a resists shear by a^2 of its stiffness. What is asked for here is that the shear,
// which decides how cloth falls, is kept; threads are softer.
TEST(WovenEdges, IrregularMeshesKeepTheShear) {
  struct Case {
    Triangles triangles;
    double shake, least_thread, most_shear;  // shares of what the material says
  };
  for (const auto& [triangles, shake, least_thread, most_shear] :
       {Case{Triangles::kCrossed, 0, 1, 1.001}, Case{Triangles::kRandom, 0, 1, 1.001},
        Case{Triangles::kCrossed, 0.1, 0.7, 1.1}, Case{Triangles::kRandom, 0.1, 0.7, 1.1},
        Case{Triangles::kCrossed, 0.3, 0.25, 1.3}, Case{Triangles::kRandom, 0.3, 0.25, 1.3},
        Case{Triangles::kEquilateral, 0, 0.1, 2}, Case{Triangles::kEquilateral, 0.2, 0.1, 2}}) {
    const Resistance found = ResistanceOf(IrregularPatch(triangles, shake));
    std::printf("MEASURED %d, off by %.1f: warp %.3f, weft %.3f, shear %.3f\n",
                static_cast<int>(triangles), shake, found.warp / kStretch_n_per_m,
                found.weft / kStretch_n_per_m, found.shear / kShear_n_per_m);
    EXPECT_GE(std::min(found.warp, found.weft), least_thread * kStretch_n_per_m);
    EXPECT_LE(found.shear, most_shear * kShear_n_per_m);
    EXPECT_GE(found.shear, 0.9 * kShear_n_per_m);
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
