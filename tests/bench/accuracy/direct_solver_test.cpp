// The solver that judges positions, judged by the exact planar chain and by conserved quantities.
#include "tests/bench/accuracy/direct_solver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/planar_chain.h"
#include "tests/support/scenes.h"

namespace drape::bench {
namespace {

using Eigen::Vector3d;

const Vector3d kGravity_m_per_s2(0, -9.81, 0);

// A curtain let go horizontally is as many planar chains as it has columns.
TEST(DirectSolverTest, ACurtainMovesLikeTheExactChainToSecondOrder) {
  constexpr uint32_t kColumns = 4, kRows = 8;
  const test::Scene curtain = test::Grid(kColumns, kRows, 0.5, 1, {0, 1, 2, 3});
  test::PlanarChain chain = test::CurtainColumn(kRows, 1);
  chain.AdvanceConverged(0.5, 1e-10);
  const std::vector<Vector3d> exact = chain.Positions_m();
  const auto error_m = [&](const std::vector<Vector3d>& positions_m) {
    double largest = 0;
    for (uint32_t i = 0; i < positions_m.size(); ++i) {
      const Vector3d& column = exact[i / kColumns];
      const double x = curtain.model->rest_positions_m()[i].x();
      largest = std::max(largest, (positions_m[i] - Vector3d(x, column.y(), column.x())).norm());
    }
    return largest;
  };
  std::vector<double> errors;
  for (const uint32_t steps : {250u, 500u, 1000u}) {
    DirectSolver solver(curtain.model, curtain.state, kGravity_m_per_s2);
    solver.Advance(0.5, steps);
    errors.push_back(error_m(solver.state().positions_m));
  }
  // Second order: halving divides by 4. The next even order at 1000 steps is within 5 %.
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), 2, 0.07);
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.2);

  const ConvergedMotion converged =
      ConvergeDirect(curtain.model, curtain.state, kGravity_m_per_s2, 0.5, 250, 4000, 1e-9);
  EXPECT_LE(error_m(converged.positions_m), converged.error_m);
  EXPECT_LT(converged.error_m, errors[2] / 100);
  EXPECT_NEAR(converged.order, 2, 0.05);
}

// Out of the plane, with a mesh of rows and columns that pull at each other: nothing stretches, and
// what gravity gives is all in the motion.
TEST(DirectSolverTest, KeepsLengthsAndEnergy) {
  test::Scene sheet = test::Grid(5, 6, 0.8, 1, {0, 1, 2, 3, 4, 5, 10, 15, 20, 25});
  DirectSolver solver(sheet.model, sheet.state, kGravity_m_per_s2);
  constexpr double kDuration_s = 0.3;
  constexpr uint32_t kSteps = 2000;
  solver.Advance(kDuration_s, kSteps);
  const ParticleState& end = solver.state();
  for (const DistanceConstraint& c : sheet.model->constraints()) {
    EXPECT_NEAR((end.positions_m[c.j] - end.positions_m[c.i]).norm(), c.rest_length_m,
                2 * DirectSolver::kTolerance * c.rest_length_m);
  }
  double kinetic_j = 0, fallen_j = 0, mass_kg = 0;
  for (uint32_t i = 0; i < end.positions_m.size(); ++i) {
    if (sheet.model->inverse_masses_per_kg()[i] == 0) continue;
    const double m = sheet.model->masses_kg()[i];
    mass_kg += m;
    kinetic_j += m * end.velocities_m_per_s[i].squaredNorm() / 2;
    fallen_j -= m * 9.81 * end.positions_m[i].y();
  }
  EXPECT_GT(fallen_j, 0.05 * mass_kg * 9.81);
  // The velocities are those after gravity's half step and before the next impulses (no RATTLE
  // stage), off by h g/2 at most: with speeds of up to sqrt(2 g l) that is the bound.
  const double off_m_per_s = 9.81 * kDuration_s / kSteps / 2;
  EXPECT_NEAR(kinetic_j, fallen_j, 3 * mass_kg * off_m_per_s * std::sqrt(2 * 9.81));
}

TEST(DirectSolverDeathTest, RefusesConstraintsThatDependOnEachOther) {
  const test::Scene taut = test::Grid(4, 3, 1, 1, {0, 3});
  DirectSolver solver(taut.model, taut.state, kGravity_m_per_s2);
  EXPECT_DEATH(solver.Advance(0.01, 10), "independent");
}

}  // namespace
}  // namespace drape::bench
