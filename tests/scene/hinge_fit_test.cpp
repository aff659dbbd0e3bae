#include "server/scene/hinge_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace drape {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPlate_n_m = 7e-5;

enum class Diagonals { kAlike, kCrossed, kRandom };

// A flat square of vertices in cells of 1 m, those within it off their places by up to `shake`.
struct Patch {
  std::string name;
  std::vector<Vector2d> places_m;
  std::vector<std::array<uint32_t, 3>> triangles;
};

Patch SquarePatch(uint32_t side, Diagonals diagonals, double shake, bool is_equilateral = false) {
  std::mt19937 engine(7);
  const auto off = [&] { return shake * (static_cast<double>(engine()) / 0x1p31 - 1); };
  Patch patch;
  patch.name = is_equilateral ? "equilateral" : "squares";
  patch.name += " " + std::to_string(static_cast<int>(diagonals)) + " " + std::to_string(shake);
  for (uint32_t row = 0; row < side; ++row) {
    for (uint32_t column = 0; column < side; ++column) {
      const bool is_rim = row % (side - 1) == 0 || column % (side - 1) == 0;
      const double x = column + (is_equilateral && row % 2 == 1 ? 0.5 : 0);
      const double y = row * (is_equilateral ? std::sqrt(0.75) : 1);
      patch.places_m.emplace_back(x + (is_rim ? 0 : off()), y + (is_rim ? 0 : off()));
      if (row + 1 == side || column + 1 == side) continue;
      const uint32_t a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      bool is_falling = diagonals == Diagonals::kCrossed && (row + column) % 2 == 0;
      if (diagonals == Diagonals::kRandom) is_falling = engine() >> 31 != 0;
      if (is_equilateral) is_falling = row % 2 == 1;
      if (is_falling) {
        patch.triangles.insert(patch.triangles.end(), {{a, c, d}, {a, d, b}});
      } else {
        patch.triangles.insert(patch.triangles.end(), {{a, c, b}, {b, c, d}});
      }
    }
  }
  return patch;
}

// Hinges of the patch after a turn, a move and a change of its size.
struct Mesh {
  std::vector<Vector3d> positions_m;
  std::vector<ElasticElement> hinges;
};

Mesh MeshOf(const Patch& patch, double angle, double cell_m, double rigidity_n_m = kPlate_n_m) {
  Mesh mesh;
  const Eigen::AngleAxisd turn(angle, Vector3d(1, 2, -1).normalized());
  for (const Vector2d& p : patch.places_m) {
    mesh.positions_m.push_back(turn * (cell_m * Vector3d(p.x(), 0, p.y())) + Vector3d(3, 1, 2));
  }
  for (const MeshEdge& edge : UniqueEdges(patch.triangles)) {
    for (const auto& [k, l] : SheetsAcross(edge, mesh.positions_m)) {
      mesh.hinges.push_back(Hinge({edge.i, edge.j, k, l}, mesh.positions_m, rigidity_n_m));
    }
  }
  return mesh;
}

// How stiff the patch is against a curve, over the plate, for eight directions: its outer lines are
// bent as the curve, and all others give way until they rest.
class Stiffness {
 public:
  Stiffness(const Patch& patch, std::span<const ElasticElement> hinges, double cell_m)
      : patch_(patch), hinges_(hinges), cell_m_(cell_m) {
    const size_t count = patch.places_m.size();
    const Vector2d low(4.5, 4.5 * (patch.places_m.back().y() + 1) / std::sqrt(count));
    const Vector2d high = patch.places_m.back() - low;
    for (const Vector2d& p : patch.places_m) {
      const bool is_free = (p - low).minCoeff() > 0 && (high - p).minCoeff() > 0;
      free_.push_back(is_free ? free_count_++ : -1);
    }
  }

  std::vector<double> Ratios() const {
    const auto count = static_cast<Eigen::Index>(patch_.places_m.size());
    std::vector<Eigen::Triplet<double>> all, of_free;
    for (const ElasticElement& hinge : hinges_) {
      for (size_t a = 0; a < 4; ++a) {
        for (size_t b = 0; b < 4; ++b) {
          const uint32_t i = hinge.particles[a], j = hinge.particles[b];
          const double entry = hinge.stiffness_n_per_m * hinge.weights[a] * hinge.weights[b];
          all.emplace_back(i, j, entry);
          if (free_[i] >= 0 && free_[j] >= 0) of_free.emplace_back(free_[i], free_[j], entry);
        }
      }
    }
    Eigen::SparseMatrix<double> matrix(count, count), inner(free_count_, free_count_);
    matrix.setFromTriplets(all.begin(), all.end());
    inner.setFromTriplets(of_free.begin(), of_free.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(inner);
    std::vector<double> ratios;
    for (int k = 0; k < 8; ++k) {
      const double angle = k * std::numbers::pi / 8;
      const Vector2d direction(std::cos(angle), std::sin(angle));
      Eigen::VectorXd bent(count);
      for (Eigen::Index i = 0; i < count; ++i) {
        bent[i] = std::pow(cell_m_ * direction.dot(patch_.places_m[i]), 2) / 2;  // curvature 1/m
      }
      const Eigen::VectorXd forces = matrix * bent;
      Eigen::VectorXd pull(free_count_);
      for (Eigen::Index i = 0; i < count; ++i) {
        if (free_[i] >= 0) pull[free_[i]] = -forces[i];
      }
      const Eigen::VectorXd way = solver.solve(pull);
      for (Eigen::Index i = 0; i < count; ++i) {
        if (free_[i] >= 0) bent[i] += way[free_[i]];
      }
      ratios.push_back(Ratio(bent));
    }
    return ratios;
  }

 private:
  // Half of a hinge belongs to each end of its edge, as does a third of a triangle to each corner.
  double Ratio(const Eigen::VectorXd& bent) const {
    double energy_j = 0, area_m2 = 0;
    for (const ElasticElement& hinge : hinges_) {
      double bend = 0;
      for (size_t a = 0; a < 4; ++a) bend += hinge.weights[a] * bent[hinge.particles[a]];
      for (size_t end = 0; end < 2; ++end) {
        if (free_[hinge.particles[end]] < 0) continue;
        energy_j += hinge.stiffness_n_per_m * bend * bend / 4;
      }
    }
    for (const auto& corners : patch_.triangles) {
      const Vector2d ab = patch_.places_m[corners[1]] - patch_.places_m[corners[0]];
      const Vector2d ac = patch_.places_m[corners[2]] - patch_.places_m[corners[0]];
      const double triangle_m2 =
          cell_m_ * cell_m_ * std::abs(ab.x() * ac.y() - ab.y() * ac.x()) / 2;
      for (const uint32_t corner : corners) area_m2 += free_[corner] >= 0 ? triangle_m2 / 3 : 0;
    }
    return energy_j / (kPlate_n_m / 2 * area_m2);
  }

  const Patch& patch_;
  std::span<const ElasticElement> hinges_;
  const double cell_m_;
  std::vector<int> free_;
  int free_count_ = 0;
};

std::pair<double, double> Range(const Patch& patch, const Mesh& mesh, double cell_m) {
  const std::vector<double> ratios = Stiffness(patch, mesh.hinges, cell_m).Ratios();
  const auto [least, largest] = std::ranges::minmax_element(ratios);
  return {*least, *largest};
}

// Before the fit the stiffest direction has 1.35 to 1.9. Hinges have three numbers for the five of
// a quartic form, so a tenth of the pattern is left.
TEST(HingeFitTest, PatchesBendAsThePlateInEveryDirection) {
  for (const uint32_t side : {31u, 45u}) {
    for (const double shake : {0.0, 0.15, 0.3}) {
      for (const Diagonals diagonals : {Diagonals::kCrossed, Diagonals::kRandom}) {
        for (const double angle : {0.0, 1.1, 2.5}) {
          const Patch patch = SquarePatch(side, diagonals, shake);
          Mesh mesh = MeshOf(patch, angle, 0.01);
          EXPECT_GE(Range(patch, mesh, 0.01).second, 1.3);
          FitHingesToPlate(mesh.positions_m, kPlate_n_m, mesh.hinges);
          const auto [least, largest] = Range(patch, mesh, 0.01);
          EXPECT_GE(least, 0.9) << patch.name << ", " << side << ", " << angle;
          EXPECT_LE(largest, 1.1) << patch.name << ", " << side << ", " << angle;
        }
      }
    }
  }
}

// No stiffness of hinges makes them a plate: those along the axes feel the twist, too.
TEST(HingeFitTest, SquaresCutAlikeStayExactAlongTheirEdges) {
  const Patch patch = SquarePatch(31, Diagonals::kAlike, 0);
  Mesh mesh = MeshOf(patch, 1.1, 0.01);
  FitHingesToPlate(mesh.positions_m, kPlate_n_m, mesh.hinges);
  const std::vector<double> ratios = Stiffness(patch, mesh.hinges, 0.01).Ratios();
  EXPECT_NEAR(ratios[0], 1, 0.02);
  EXPECT_NEAR(ratios[4], 1, 0.02);
}

TEST(HingeFitTest, EquilateralTrianglesStayAsTheyAre) {
  const Mesh before = MeshOf(SquarePatch(15, Diagonals::kAlike, 0, true), 0.3, 1);
  Mesh after = before;
  FitHingesToPlate(after.positions_m, kPlate_n_m, after.hinges);
  for (size_t h = 0; h < before.hinges.size(); ++h) {
    EXPECT_NEAR(after.hinges[h].stiffness_n_per_m / before.hinges[h].stiffness_n_per_m, 1, 1e-9);
  }
}

TEST(HingeFitTest, NarrowStripsStayAsTheyAre) {
  const Mesh before = MeshOf(SquarePatch(5, Diagonals::kCrossed, 0.2), 0.3, 1);
  Mesh after = before;
  FitHingesToPlate(after.positions_m, kPlate_n_m, after.hinges);
  for (size_t h = 0; h < before.hinges.size(); ++h) {
    EXPECT_EQ(after.hinges[h].stiffness_n_per_m, before.hinges[h].stiffness_n_per_m);
  }
}

// The factors are those of the shape: neither its place nor its size nor its rigidity matter.
TEST(HingeFitTest, SizeAngleAndRigidityChangeNoFactor) {
  const Patch patch = SquarePatch(12, Diagonals::kRandom, 0.3);
  std::vector<double> expected;
  for (const auto& [angle, cell_m, rigidity_n_m] :
       {std::tuple(0.0, 1.0, kPlate_n_m), std::tuple(1.1, 1.0, 1e-9), std::tuple(2.3, 1e-3, 5.0),
        std::tuple(0.4, 100.0, kPlate_n_m)}) {
    Mesh mesh = MeshOf(patch, angle, cell_m, rigidity_n_m);
    const std::vector<ElasticElement> before = mesh.hinges;
    FitHingesToPlate(mesh.positions_m, rigidity_n_m, mesh.hinges);
    for (size_t h = 0; h < before.size(); ++h) {
      const double factor = mesh.hinges[h].stiffness_n_per_m / before[h].stiffness_n_per_m;
      if (angle == 0) {
        expected.push_back(factor);
      } else {
        EXPECT_NEAR(factor, expected[h], 1e-4) << h << ", " << angle;
      }
    }
  }
}

}  // namespace
}  // namespace drape
