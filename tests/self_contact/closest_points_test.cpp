#include "server/solver/self_contact/closest_points.h"

#include <gtest/gtest.h>

#include <random>

namespace drape::self_contact {
namespace {

template <class V>
class ClosestPointsTest : public ::testing::Test {};
using Precisions = ::testing::Types<Vector3f, Vector3d>;
TYPED_TEST_SUITE(ClosestPointsTest, Precisions);

// The smallest distance between points of a fine net over both primitives, and its mesh size.
double Sampled(PairKind kind, const std::array<Vector3d, 4>& p) {
  constexpr int kSteps = 40;
  double smallest = 1e300;
  for (int a = 0; a <= kSteps; ++a) {
    const double s = double(a) / kSteps;
    for (int b = 0; b <= kSteps; ++b) {
      const double t = double(b) / kSteps;
      if (kind == PairKind::kEdges) {
        smallest = std::min(
            smallest, Length(Vector3d((p[0] + s * (p[1] - p[0])) - (p[2] + t * (p[3] - p[2])))));
      } else if (s + t <= 1) {
        const Vector3d q = p[1] + s * (p[2] - p[1]) + t * (p[3] - p[1]);
        smallest = std::min(smallest, Length(Vector3d(p[0] - q)));
      }
    }
  }
  return smallest;
}

TYPED_TEST(ClosestPointsTest, AreNearerThanSamplesByAtMostTheirSpacing) {
  using V = TypeParam;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    for (const PairKind kind : {PairKind::kVertexTriangle, PairKind::kEdges}) {
      std::array<Vector3d, 4> exact;
      std::array<V, 4> p;
      for (int k = 0; k < 4; ++k) {
        // Some lie in a plane, some edges are parallel.
        const double z = trial % 3 == 0 ? 0 : coordinate(random);
        exact[k] = Vector3d{coordinate(random), coordinate(random), z, 0};
        if (trial % 5 == 0 && k == 3) exact[3] = exact[2] + 0.5 * (exact[1] - exact[0]);
        p[k] = ToVector<V>(FromVector(exact[k]));
      }
      const ClosestPoints<V> closest = Closest(kind, p);
      const double distance = Length(closest.difference);
      const double sampled = Sampled(kind, exact);
      EXPECT_LE(distance, sampled + 1e-5);
      EXPECT_GE(distance, sampled - 2 * 3.5 / 40);
      V sum{};
      double total = 0;
      for (int k = 0; k < 4; ++k) {
        sum += closest.weights[k] * p[k];
        total += double{closest.weights[k]};
        const double sign = k < FirstCorners(kind) ? 1 : -1;
        EXPECT_GE(sign * double{closest.weights[k]}, -1e-6);
      }
      EXPECT_NEAR(total, 0, 1e-6);
      EXPECT_NEAR(Length(V(sum - closest.difference)), 0, 2e-6);
      // The gap along the direction of the nearest points of two convex bodies is their distance.
      if (distance > 1e-2) {
        EXPECT_NEAR(GapAlong(kind, p, V(closest.difference / static_cast<ScalarOf<V>>(distance))),
                    distance, 2e-4);
      }
    }
  }
}

}  // namespace
}  // namespace drape::self_contact
