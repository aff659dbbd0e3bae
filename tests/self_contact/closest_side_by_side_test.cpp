// Four pairs at a time have the bits of one at a time.
#include "server/solver/self_contact/closest_side_by_side.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <vector>

#include "server/solver/self_contact/contact_pair.h"

namespace drape::self_contact {
namespace {

template <class V>
class SideBySideTest : public ::testing::Test {};
using SideBySidePrecisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(SideBySideTest, SideBySidePrecisions);

uint64_t Bits(float value) {
  return std::bit_cast<uint32_t>(value);
}
uint64_t Bits(double value) {
  return std::bit_cast<uint64_t>(value);
}
template <class V>
void ExpectSame(const V& a, const V& b) {
  for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(Bits(a[axis]), Bits(b[axis]));
}

// Corners of four pairs after another: anywhere, in a plane, on a line, in a lattice (so that many
// are equal, parallel, or on the border of two cases), nearly flat, or all in one place.
template <class V>
std::vector<V> RandomCorners(int trial, std::mt19937& random) {
  using Real = ScalarOf<V>;
  std::uniform_real_distribution<double> coordinate(-1, 1);
  std::uniform_int_distribution<int> lattice(-1, 1);
  std::vector<V> corners(4 * kPairsSideBySide);
  for (V& corner : corners) {
    const auto x = static_cast<Real>(coordinate(random));
    const auto y = static_cast<Real>(coordinate(random));
    const auto z = static_cast<Real>(coordinate(random));
    const auto i = static_cast<Real>(lattice(random)), j = static_cast<Real>(lattice(random));
    corner = std::array{
        V{x, y, z, 0}, V{x, y, 0, 0}, V{x, 2 * x, -x, 0}, V{i, j, 0, 0}, V{i, j, Real(1e-3) * z, 0},
        V{1, 2, 3, 0}}[trial % 6];
  }
  return corners;
}

TYPED_TEST(SideBySideTest, HaveTheBitsOfOneAtATime) {
  using V = TypeParam;
  using Real = ScalarOf<V>;
  std::mt19937 random(11);
  size_t apart = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::vector<V> positions = RandomCorners<V>(trial, random);
    const std::vector<Real> inverse_masses(positions.size(), Real(0.7));
    for (const PairKind kind : {PairKind::kVertexTriangle, PairKind::kEdges}) {
      SCOPED_TRACE(trial);
      std::array<ContactPair<V>, kPairsSideBySide> pairs;
      std::array<ContactPair<V>*, kPairsSideBySide> places;
      FourPairs particles;
      for (uint32_t lane = 0; lane < kPairsSideBySide; ++lane) {
        const uint32_t i = 4 * lane;
        pairs[lane].particles = {i, i + 1, i + 2, i + 3};
        pairs[lane].kind = kind;
        places[lane] = &pairs[lane];
        particles[lane] = &pairs[lane].particles;
      }
      const FourCorners<V> corners = CornersOf(particles, positions.data());
      const FourClosestPoints<V> closest = Closest<V>(kind, corners);
      // The last lanes may be missing.
      const size_t count = 1 + static_cast<size_t>(trial) % kPairsSideBySide;
      const uint32_t are_apart =
          FindNormals<V>(positions.data(), inverse_masses, kind, std::span(places).first(count));
      for (uint32_t lane = 0; lane < kPairsSideBySide; ++lane) {
        const std::array<V, 4> p = CornersOf(pairs[lane], positions.data());
        const ClosestPoints<V> one = Closest(kind, p);
        for (int k = 0; k < 4; ++k) {
          ASSERT_EQ(Bits(one.weights[k]), Bits(closest.weights[k][lane]));
        }
        ExpectSame(one.difference, V{closest.difference.x[lane], closest.difference.y[lane],
                                     closest.difference.z[lane], 0});
        if (lane >= count) continue;
        ContactPair<V> alone;
        alone.particles = pairs[lane].particles;
        alone.kind = kind;
        const bool is_apart = FindNormal<V>(positions.data(), inverse_masses, alone);
        ASSERT_EQ(is_apart, (are_apart >> lane & 1) != 0);
        apart += is_apart;
        ExpectSame(alone.normal, pairs[lane].normal);
        ASSERT_EQ(Bits(alone.gap), Bits(pairs[lane].gap));
        ASSERT_EQ(Bits(alone.inverse_mass), Bits(pairs[lane].inverse_mass));
        for (int k = 0; k < 4; ++k) ASSERT_EQ(Bits(alone.weights[k]), Bits(pairs[lane].weights[k]));
      }
    }
  }
  EXPECT_GT(apart, 1000u);
}

}  // namespace
}  // namespace drape::self_contact
