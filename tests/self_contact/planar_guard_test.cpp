#include "server/solver/self_contact/planar_guard.h"

#include <gtest/gtest.h>

#include <random>

#include "server/solver/self_contact/crossing_search.h"
#include "tests/self_contact/crumpled.h"

namespace drape::test {
namespace {

using self_contact::ContactPair;
using self_contact::PlanarGuard;
using self_contact::ScalarOf;
using self_contact::Vector3d;
using self_contact::Vector3f;

template <class V>
class PlanarGuardTest : public ::testing::Test {};
using GuardPrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(PlanarGuardTest, GuardPrecisions);

// Every pair of a folded sheet, which then flies through itself.
template <class V>
struct Flight {
  using Real = ScalarOf<V>;

  Flight(const Scene& scene, double speed, uint32_t seed, const std::vector<uint32_t>& pins = {})
      : surface(*scene.model), starts(As<V>(Folded(*scene.model, 2, 0.4, 0.001, seed))) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> way(-speed, speed);
    for (const double mass : scene.model->masses_kg()) {
      inverse_masses.push_back(static_cast<Real>((1 + 0.5 * way(random) / speed) / mass));
    }
    for (const uint32_t pin : pins) inverse_masses[pin] = 0;
    for (size_t i = 0; i < starts.size(); ++i) {
      const bool is_pin = inverse_masses[i] == 0;
      const V move =
          self_contact::ToVector<V>(Eigen::Vector3d(way(random), way(random), way(random)));
      ends.push_back(is_pin ? starts[i] : V(starts[i] + move));
      velocities.push_back((ends[i] - starts[i]) / kDuration);
    }
    ForAllPairs(surface, [&](self_contact::PairKind kind, const std::array<uint32_t, 4>& p) {
      ContactPair<V> pair;
      pair.particles = p;
      pair.kind = kind;
      pair.touch = static_cast<Real>(self_contact::TouchDistance_m(surface, kind, p, 0.005, true));
      EXPECT_TRUE(FindNormal<V>(starts.data(), inverse_masses, pair));
      active.push_back(static_cast<uint32_t>(pairs.size()));
      pairs.push_back(pair);
    });
  }

  bool Run() {
    PlanarGuard<V> guard;
    const std::vector<Real> ways(active.size(), 20);
    return guard.Run(pairs, active, ways,
                     {starts, ends, velocities, {}, {}, inverse_masses, kDuration});
  }

  size_t Crossings(const std::vector<V>& positions) const {
    std::vector<Vector3d> exact;
    for (const V& p : positions) {
      exact.push_back(Vector3d{double{p[0]}, double{p[1]}, double{p[2]}, 0});
    }
    return self_contact::FindCrossings(surface, exact).size();
  }

  Eigen::Vector3d Sum(const std::vector<V>& vectors) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < vectors.size(); ++i) {
      if (inverse_masses[i] == 0) continue;
      const V& v = vectors[i];
      sum += Eigen::Vector3d(v[0], v[1], v[2]) / double{inverse_masses[i]};
    }
    return sum;
  }

  static constexpr Real kDuration = Real(1) / 1024;
  ContactSurface surface;
  std::vector<V> starts, ends, velocities;
  std::vector<Real> inverse_masses;
  std::vector<ContactPair<V>> pairs;
  std::vector<uint32_t> active;
};

TYPED_TEST(PlanarGuardTest, NothingPassesAndMomentumStays) {
  using V = TypeParam;
  for (const Scene& scene : {Grid(9, 7, 1, 0.75), MeshedGrid(8, 8, 1, 1)}) {
    size_t crossings_without = 0;
    for (const double speed : {0.003, 0.03, 0.3}) {  // way [m]
      for (uint32_t seed = 1; seed < 4; ++seed) {
        Flight<V> flight(scene, speed, seed);
        ASSERT_EQ(flight.Crossings(flight.starts), 0u);
        crossings_without += flight.Crossings(flight.ends);
        const Eigen::Vector3d before = flight.Sum(flight.ends);
        EXPECT_TRUE(flight.Run());
        EXPECT_EQ(flight.Crossings(flight.ends), 0u) << speed << " m, seed " << seed;
        const double round_off =
            64 * double{std::numeric_limits<ScalarOf<V>>::epsilon()} * 0.2 * (1 + speed);
        EXPECT_NEAR((flight.Sum(flight.ends) - before).norm(), 0, round_off);
      }
    }
    EXPECT_GT(crossings_without, 100u);
  }
}

TYPED_TEST(PlanarGuardTest, RestingPinsStayWhereTheyAre) {
  using V = TypeParam;
  const std::vector<uint32_t> pins = {0, 8, 30, 31, 40};
  for (uint32_t seed = 1; seed < 4; ++seed) {
    Flight<V> flight(Grid(9, 7, 1, 0.75), 0.1, seed, pins);
    EXPECT_TRUE(flight.Run());
    EXPECT_EQ(flight.Crossings(flight.ends), 0u);
    for (const uint32_t pin : pins) {
      EXPECT_EQ(self_contact::Length(V(flight.ends[pin] - flight.starts[pin])), 0);
    }
  }
}

TYPED_TEST(PlanarGuardTest, WhatIsApartStaysAsItIs) {
  using V = TypeParam;
  Flight<V> flight(Grid(9, 7, 1, 0.75), 1e-5, 1);
  const std::vector<V> ends = flight.ends;
  EXPECT_TRUE(flight.Run());
  for (size_t i = 0; i < ends.size(); ++i) {
    EXPECT_EQ(self_contact::Length(V(flight.ends[i] - ends[i])), 0);
  }
}

}  // namespace
}  // namespace drape::test
