#include "server/solver/self_contact/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace drape::test {
namespace {

using self_contact::Box;
using self_contact::Vector3d;
using self_contact::Vector3f;

template <class V>
class DriftTest : public ::testing::Test {};
using Precisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(DriftTest, Precisions);

template <class V>
struct Motion {
  std::vector<V> now, then, velocities;

  Motion(size_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<self_contact::ScalarOf<V>> unit(-1, 1);
    const auto vector = [&] { return V{unit(random), 10 * unit(random), unit(random), 0}; };
    for (size_t i = 0; i < count; ++i) {
      now.push_back(vector());
      then.push_back(vector());
      velocities.push_back(vector());
    }
  }
};

// One after the other, to the bit, whatever the processor does side by side.
TYPED_TEST(DriftTest, IsTheDiagonalOfTheBox) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  for (const size_t count : {1, 2, 3, 4, 5, 6, 7, 8, 9, 1023, 1024}) {
    const Motion<V> motion(count, static_cast<uint32_t>(count));
    constexpr Real kTime = Real(0.3);
    Box<V> box;
    for (size_t i = 0; i < count; ++i) {
      box.Add(V((motion.now[i] - motion.then[i]) - kTime * motion.velocities[i]));
    }
    EXPECT_EQ(self_contact::DriftOf<V>(motion.now, motion.then, motion.velocities, kTime),
              self_contact::Length(V(box.high - box.low)))
        << count;
  }
}

TYPED_TEST(DriftTest, IsInfiniteIfAnythingIsNoNumber) {
  using V = TypeParam;
  using Real = self_contact::ScalarOf<V>;
  for (const size_t count : {1, 2, 5, 64}) {
    for (size_t bad = 0; bad < count; ++bad) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const Real value :
             {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()}) {
          Motion<V> motion(count, 1);
          motion.now[bad][axis] = value;
          EXPECT_EQ(self_contact::DriftOf<V>(motion.now, motion.then, motion.velocities, Real(1)),
                    std::numeric_limits<Real>::infinity());
        }
      }
    }
  }
}

}  // namespace
}  // namespace drape::test
