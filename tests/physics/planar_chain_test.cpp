// The reference of the moving chains is itself held against closed forms.
#include "tests/support/planar_chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/closed_forms.h"

namespace drape::test {
namespace {

constexpr double kG = 9.81;

PlanarChain BentChain(uint32_t links) {
  std::vector<PlanarChain::Link> list;
  for (uint32_t k = 0; k < links; ++k) {
    list.push_back({.length_m = 0.1 + 0.02 * (k % 3),
                    .mass_kg = 0.5 + 0.25 * (k % 2),
                    .angle_rad = 1.2 - 0.3 * k,
                    .rate_rad_s = 0.5 * (k % 2)});
  }
  return PlanarChain(list);
}

double Distance(const PlanarChain& a, const PlanarChain& b) {
  double largest = 0;
  for (size_t k = 0; k <= a.links().size(); ++k) {
    largest = std::max(largest, (a.Positions_m()[k] - b.Positions_m()[k]).norm());
  }
  return largest;
}

// A quarter of the exact period brings the pendulum to the bottom, a half to the other side, a
// whole one back.
TEST(PlanarChainTest, OneLinkIsThePendulum) {
  for (const double angle : {0.1, 2.0, 3.0}) {
    PlanarChain pendulum = StraightChain(1, 0.7, 3, angle);
    const double period = PendulumPeriod_s(0.7, kG, angle);
    for (const double expected : {0.0, -angle, 0.0, angle}) {
      pendulum.AdvanceConverged(period / 4, 1e-12);
      EXPECT_NEAR(pendulum.links()[0].angle_rad, expected, 1e-9) << angle;
    }
  }
}

// The textbook's equations of the double pendulum (Lagrange), by a central difference of the
// chain's own rates.
TEST(PlanarChainTest, TwoLinksObeyTheLagrangeEquationsOfTheDoublePendulum) {
  const double m1 = 0.4, m2 = 0.9, l1 = 0.5, l2 = 0.3;
  PlanarChain chain({{l1, m1, 1.1, -0.7}, {l2, m2, -0.4, 2.5}});
  PlanarChain before = chain, after = chain;
  constexpr double kStep_s = 1e-5;
  before.Advance(-kStep_s, 1);
  after.Advance(kStep_s, 1);
  double acceleration[2];
  for (size_t k = 0; k < 2; ++k) {
    acceleration[k] = (after.links()[k].rate_rad_s - before.links()[k].rate_rad_s) / (2 * kStep_s);
  }
  const double a1 = chain.links()[0].angle_rad, a2 = chain.links()[1].angle_rad;
  const double w1 = chain.links()[0].rate_rad_s, w2 = chain.links()[1].rate_rad_s;
  const double c = std::cos(a1 - a2), s = std::sin(a1 - a2);
  EXPECT_NEAR((m1 + m2) * l1 * acceleration[0] + m2 * l2 * (acceleration[1] * c + w2 * w2 * s) +
                  (m1 + m2) * kG * std::sin(a1),
              0, 1e-6);
  EXPECT_NEAR(l2 * acceleration[1] + l1 * (acceleration[0] * c - w1 * w1 * s) + kG * std::sin(a2),
              0, 1e-6);
}

TEST(PlanarChainTest, EnergyIsKept) {
  for (const uint32_t links : {1u, 2u, 9u}) {
    PlanarChain chain = BentChain(links);
    const double before = chain.Energy_j();
    chain.AdvanceConverged(0.5, 1e-11);
    EXPECT_NEAR(chain.Energy_j(), before, 1e-8) << links;
  }
}

TEST(PlanarChainTest, IsOfFourthOrder) {
  PlanarChain exact = BentChain(5);
  exact.Advance(0.4, 25600);
  std::vector<double> errors;
  for (const uint32_t steps : {100u, 200u, 400u}) {
    PlanarChain chain = BentChain(5);
    chain.Advance(0.4, steps);
    errors.push_back(Distance(chain, exact));
  }
  for (size_t k = 1; k < errors.size(); ++k) {
    EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 4, 0.3) << errors[k];
  }
}

TEST(PlanarChainTest, ConvergedMeansWithinTheTolerance) {
  PlanarChain exact = BentChain(5);
  exact.Advance(0.4, 51200);
  for (const double tolerance : {1e-6, 1e-9}) {
    PlanarChain chain = BentChain(5);
    EXPECT_LE(chain.AdvanceConverged(0.4, tolerance), tolerance);
    EXPECT_LE(Distance(chain, exact), 2 * tolerance);
  }
}

TEST(PlanarChainTest, AHangingChainCarriesWhatIsBelow) {
  PlanarChain chain({{0.2, 1, 0, 0}, {0.3, 2, 0, 0}, {0.1, 4, 0, 0}});
  const std::vector<double> tensions = chain.Tensions_n();
  EXPECT_NEAR(tensions[0], 7 * kG, 1e-12);
  EXPECT_NEAR(tensions[1], 6 * kG, 1e-12);
  EXPECT_NEAR(tensions[2], 4 * kG, 1e-12);
}

// Let go horizontally, links further out know nothing of the pivot yet: no tension, free fall.
TEST(PlanarChainTest, TheCurtainStartsInFreeFall) {
  PlanarChain column = CurtainColumn(32, 1);
  ASSERT_EQ(column.links().size(), 31u);
  EXPECT_NEAR(column.Positions_m().back().x(), 1, 1e-12);
  for (const double tension : column.Tensions_n()) EXPECT_NEAR(tension, 0, 1e-12);
  column.AdvanceConverged(0.6, 1e-8);
  EXPECT_LT(column.Positions_m().back().y(), -0.5);
}

}  // namespace
}  // namespace drape::test
