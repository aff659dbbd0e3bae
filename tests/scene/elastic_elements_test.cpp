// Elements of bending and shear: their energies against those of plates, and the sharing of masses.
#include "server/scene/elastic_elements.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/scene/scene_model.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr double kRigidity_n_m = 3e-3;

// Energy of all elements in a state, from their definition.
double Energy(const std::vector<ElasticElement>& elements, const std::vector<Vector3d>& p) {
  double energy = 0;
  for (const ElasticElement& element : elements) {
    const double deflection = DeflectionOf_m(element, [&](uint32_t i) { return p[i]; });
    energy += element.stiffness_n_per_m / 2 * deflection * deflection;
  }
  return energy;
}

// y = (xx x^2 + 2 xz x z + zz z^2) / 2.
struct Curvature {
  double xx, xz, zz;
};

std::vector<Vector3d> Bent(std::vector<Vector3d> p, const Curvature& k) {
  for (Vector3d& q : p) {
    q.y() += k.xx / 2 * q.x() * q.x() + k.xz * q.x() * q.z() + k.zz / 2 * q.z() * q.z();
  }
  return p;
}

// A plate of Poisson's ratio 0 stores B/2 (k_xx^2 + k_zz^2 + 2 k_xz^2) per area, in whatever
// direction it is bent. The rods of a grid are there (columns - 2) / (columns - 1) times their
// length, and each stands for its share of the width; the second differences of a parabola are
// exact.
TEST(GridBendingTest, IsThatOfAPlateInEveryDirection) {
  constexpr uint32_t kColumns = 45, kRows = 27;
  const GridTopology grid{kColumns, kRows, 1.1, 0.4};
  const ParticleSystem system = BuildGrid(grid, {.bending_rigidity_n_m = kRigidity_n_m});
  const double area = grid.width_m * grid.height_m;
  for (const auto& k : {Curvature{0.3, 0, 0}, Curvature{0, 0, 0.3}, Curvature{0, 0.3, 0},
                        Curvature{0.1, 0.1, 0.1}, Curvature{0.2, -0.1, -0.2}}) {
    const double along_rows = k.xx * k.xx * (kColumns - 2) / (kColumns - 1);
    const double along_columns = k.zz * k.zz * (kRows - 2) / (kRows - 1);
    const double expected =
        kRigidity_n_m / 2 * area * (along_rows + along_columns + 2 * k.xz * k.xz);
    EXPECT_NEAR(Energy(system.elastic_elements, Bent(system.rest_positions_m, k)), expected,
                1e-9 * expected);
  }
}

// Equilateral triangles with edges along z or x. A mesh has no hinges at its rim: the share of the
// inner edges of its area is bent, the same in all three directions. The weights are those of a
// second difference; 2 sin(a/2) and a differ by a^3/24, and slopes of up to 0.002 turn normals by
// as little.
TEST(MeshBendingTest, OfEquilateralTrianglesIsThatOfAPlate) {
  constexpr double kEdge_m = 0.02;
  TriangleMesh mesh;
  constexpr uint32_t kSide = 40;
  for (uint32_t row = 0; row < kSide; ++row) {
    for (uint32_t column = 0; column < kSide; ++column) {
      mesh.positions_m.emplace_back((column + 0.5 * row) * kEdge_m, 0,
                                    row * kEdge_m * std::sqrt(3.0) / 2);
      if (row + 1 == kSide || column + 1 == kSide) continue;
      const uint32_t i = row * kSide + column;
      mesh.triangles.push_back({i, i + kSide, i + 1});
      mesh.triangles.push_back({i + 1, i + kSide, i + kSide + 1});
    }
  }
  const ParticleSystem system = BuildMesh(mesh, {.bending_rigidity_n_m = kRigidity_n_m});
  // The inner edges of each direction, each for the two triangles beside it.
  constexpr double kAlong = (kSide - 1.0) * (kSide - 2), kAcross = (kSide - 1.0) * (kSide - 1);
  const double pair_m2 = kEdge_m * kEdge_m * std::sqrt(3.0) / 2;
  const std::array<double, 3> counts = {kAlong, kAlong, kAcross};
  const std::array<Vector3d, 3> normals = {Vector3d(0, 0, 1), Vector3d(std::sqrt(3.0) / 2, 0, -0.5),
                                           Vector3d(std::sqrt(3.0) / 2, 0, 0.5)};
  for (const auto& k : {Curvature{0.002, 0, 0}, Curvature{0, 0, 0.002}, Curvature{0, 0.002, 0},
                        Curvature{0.001, -0.001, 0.001}}) {
    // Across an edge with normal n the slope jumps by (3/4 k_nn - 1/4 k_tt) edge / (sqrt(3)/2).
    double expected = 0;
    for (size_t direction = 0; direction < 3; ++direction) {
      const Vector3d& n = normals[direction];
      const double k_nn = k.xx * n.x() * n.x() + 2 * k.xz * n.x() * n.z() + k.zz * n.z() * n.z();
      const double k_tt = k.xx + k.zz - k_nn;
      const double jump = (3 * k_nn - k_tt) / 4 * kEdge_m * 2 / std::sqrt(3.0);
      expected += counts[direction] * kRigidity_n_m / 2 * std::pow(kEdge_m * jump, 2) / pair_m2;
    }
    EXPECT_NEAR(Energy(system.elastic_elements, Bent(mesh.positions_m, k)), expected,
                1e-4 * expected);
  }
  // With as many hinges in each direction the three together are the plate: per area, of a cylinder
  // of any direction, B/2 k^2 times the sum of (3/4 k_nn - 1/4 k_tt)^2, over (sqrt(3)/2)^4.
  for (const double angle : {0.0, 0.2, 0.7, 1.3}) {
    double sum = 0;
    for (const Vector3d& n : normals) {
      const double k_nn = std::pow(n.x() * std::cos(angle) + n.z() * std::sin(angle), 2);
      sum += std::pow((3 * k_nn - (1 - k_nn)) / 4, 2);
    }
    EXPECT_NEAR(sum / std::pow(std::sqrt(3.0) / 2, 4), 1, 1e-12);
  }
}

// A roof that is bent at rest: nothing there, as much on either side of it in l.
TEST(HingeTest, RestsAtTheAngleOfTheMesh) {
  const std::vector<Vector3d> roof = {{0, 0, 0}, {0, 0, 1}, {1, 0.4, 0.2}, {-1, 0.4, 0.7}};
  const ElasticElement hinge = Hinge({0, 1, 2, 3}, roof, kRigidity_n_m);
  EXPECT_NEAR(Energy({hinge}, roof), 0, 1e-20);
  std::vector<Vector3d> other = roof;
  for (Vector3d& p : other) p.y() = -p.y();
  // From l0 to -l0: twice the sine of the angle that both slopes have together, times the edge.
  const double l0 = 2 * std::sin(std::atan(0.4)) * 1;
  const Vector3d normal =
      HingeNormal(roof[1] - roof[0],
                  hinge.weights[2] * (roof[2] - roof[0]) - hinge.weights[3] * (roof[3] - roof[0]));
  EXPECT_NEAR(std::abs(hinge.rest_length_m) * normal.norm(), l0, 1e-12);
  EXPECT_NEAR(Energy({hinge}, other), hinge.stiffness_n_per_m / 2 * 4 * l0 * l0, 1e-12);
  // Weights of a rigid motion: none.
  EXPECT_NEAR(hinge.weights[0] + hinge.weights[1] + hinge.weights[2] + hinge.weights[3], 0, 1e-15);
}

// The diagonal of a cell stretches by a dx dz / diagonal to first order in the angle a; the second
// order, of the other sign in the next cell, leaves a relative a^2.
TEST(GridShearTest, StoresHalfTheModulusTimesTheSquareOfTheAngle) {
  for (const GridTopology& grid :
       {GridTopology{5, 5, 1, 1}, GridTopology{45, 27, 0.7, 0.9}, GridTopology{3, 20, 0.2, 0.1}}) {
    const ParticleSystem system = BuildGrid(grid, {.shear_modulus_n_per_m = 40});
    std::vector<Vector3d> p = system.rest_positions_m;
    constexpr double kAngle = 1e-3;
    for (Vector3d& q : p) q.x() += kAngle * q.z();
    const double expected = 40.0 / 2 * kAngle * kAngle * grid.width_m * grid.height_m;
    const double aspect =
        std::max(grid.width_m / (grid.columns - 1), grid.height_m / (grid.rows - 1)) /
        std::min(grid.width_m / (grid.columns - 1), grid.height_m / (grid.rows - 1));
    EXPECT_NEAR(Energy(system.elastic_elements, p), expected,
                std::pow(kAngle * aspect, 2) * expected + 1e-9 * expected);
  }
}

// With both, a cell would resist twist by its shear modulus (server/solver/method.md).
TEST(GridShearTest, EachCellHasOneDiagonalInTurn) {
  const GridTopology grid{6, 5, 0.5, 0.4};
  const ParticleSystem system = BuildGrid(grid, {.shear_modulus_n_per_m = 40});
  std::vector<int> diagonals(size_t{grid.columns - 1} * (grid.rows - 1), 0);
  for (const ElasticElement& element : system.elastic_elements) {
    const auto [i, j, unused, other] = element.particles;
    const bool falls = j - i == grid.columns + 1;
    EXPECT_EQ(j - i, falls ? grid.columns + 1 : grid.columns - 1);
    const uint32_t row = i / grid.columns, column = i % grid.columns - (falls ? 0 : 1);
    EXPECT_EQ(falls, (row + column) % 2 == 0);
    ++diagonals[row * (grid.columns - 1) + column];
  }
  EXPECT_EQ(diagonals, std::vector<int>(diagonals.size(), 1));
}

double StretchEnergy(const ParticleSystem& system, const std::vector<Vector3d>& p) {
  double energy = 0;
  for (const DistanceConstraint& c : system.distance_constraints) {
    energy += std::pow((p[c.i] - p[c.j]).norm() - c.rest_length_m, 2) / (2 * c.compliance_m_per_n);
  }
  return energy;
}

TEST(StretchStiffnessTest, OfAGridIsExactAtAnyResolution) {
  for (const GridTopology& grid : {GridTopology{2, 2, 0.4, 0.9}, GridTopology{45, 27, 0.4, 0.9},
                                   GridTopology{1, 9, 0.4, 0.9}}) {
    const ParticleSystem system = BuildGrid(grid, {.stretch_stiffness_n_per_m = 70});
    std::vector<Vector3d> p = system.rest_positions_m;
    for (Vector3d& q : p) q.z() *= 1.02;
    const double expected = 70.0 / 2 * 0.02 * 0.02 * grid.width_m * grid.height_m;
    EXPECT_NEAR(StretchEnergy(system, p), expected, 1e-9 * expected);
  }
}

// Pulled along one direction of equilateral triangles they narrow by a third of the strain (the
// Poisson's ratio of the lattice) and store E/2 strain^2, to first order in the strain.
TEST(StretchStiffnessTest, OfEquilateralTriangles) {
  TriangleMesh mesh;
  const double height = std::sqrt(3.0) / 2;
  mesh.positions_m = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, height}, {1.5, 0, height}};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  const ParticleSystem system = BuildMesh(mesh, {.stretch_stiffness_n_per_m = 70});
  constexpr double kStrain = 1e-5;
  std::vector<Vector3d> p = mesh.positions_m;
  for (Vector3d& q : p) q = {q.x() * (1 - kStrain / 3), 0, q.z() * (1 + kStrain)};
  const double expected = 70.0 / 2 * kStrain * kStrain * height;
  EXPECT_NEAR(StretchEnergy(system, p), expected, 2 * kStrain * expected);
}

// Shares of a particle add up to its mass: the sum over its elements of weight^2 mass times the
// number that Cauchy-Schwarz allows is at most what it weighs. The promise itself: for any
// velocities the elements' oscillators hold no more kinetic energy than the particles.
TEST(ElasticSharesTest, NoParticleIsClaimedForMoreThanItsMass) {
  const ParticleSystem system = BuildGrid(
      {7, 5, 0.6, 0.9}, {.bending_rigidity_n_m = kRigidity_n_m, .shear_modulus_n_per_m = 40});
  std::vector<double> w;
  for (const double mass : system.masses_kg) w.push_back(1 / mass);
  w[0] = w[6] = 0;
  const ElasticShares shares = ShareElasticElements(w, system.elastic_elements);
  double largest = 0;
  for (uint32_t sample = 0; sample < 200; ++sample) {
    std::vector<double> v(w.size());
    double kinetic = 0, of_elements = 0;
    for (uint32_t i = 0; i < v.size(); ++i) {
      // The fastest modes of bending, row against row, and of diagonals, which join every second
      // particle; or anything.
      const uint32_t row = i / 7, column = i % 7;
      if (sample == 0) v[i] = (row + column) % 2 == 0 ? 1 : -1;
      if (sample == 1) v[i] = (row + column) % 2 == 1 ? 0 : (row % 2 == 0 ? 1 : -1);
      if (sample > 1) v[i] = std::sin(12.9898 * (sample * 40 + i));
      if (w[i] == 0) v[i] = 0;
      if (w[i] > 0) kinetic += v[i] * v[i] / (2 * w[i]);
    }
    for (size_t e = 0; e < system.elastic_elements.size(); ++e) {
      const ElasticElement& element = system.elastic_elements[e];
      double rate = 0;
      for (size_t k = 0; k < 4; ++k) rate += element.weights[k] * v[element.particles[k]];
      of_elements += shares.masses_kg[e] / 2 * rate * rate;
      EXPECT_NEAR(shares.masses_kg[e] * shares.frequencies_sq_per_s2[e], element.stiffness_n_per_m,
                  1e-12 * element.stiffness_n_per_m);
    }
    EXPECT_LE(of_elements, kinetic * (1 + 1e-12));
    largest = std::max(largest, of_elements / kinetic);
  }
  // And not for far less, which would make the limit of a substep tighter than it has to be.
  EXPECT_GT(largest, 0.5);
}

}  // namespace
}  // namespace drape
