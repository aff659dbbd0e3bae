// Four edges or triangles side by side against each by itself: the same bits.
#include "server/solver/surface_contact/four_parts.h"

#include <algorithm>
#include <vector>

#include "tests/surface_contact/lowest_point_test.h"

namespace drape::surface_contact {
namespace {

template <class V>
class FourPartsTest : public testing::Test {
 protected:
  using Real = ScalarOf<V>;

  // Corners near the surface of the collider: many of them on one face, others across edges. Some
  // parts have no size.
  template <size_t kCorners>
  std::array<V, kCorners> Part(const Collider& collider) {
    const Eigen::Vector3d near = random_.Point(0.3);
    const SurfaceDistance at = SurfaceOf(collider, near);
    const Eigen::Vector3d foot =
        near - (at.distance_m - kThickness_m - random_.Between(-1e-3, 4e-3)) * at.outward;
    const double size = random_.Between(0, 1) < 0.02 ? 0 : random_.Between(0.005, 0.05);
    const double tilt = random_.Between(0, 1) < 0.4 ? 0 : random_.Between(0, 0.3);
    std::array<V, kCorners> corners;
    for (V& corner : corners) {
      Eigen::Vector3d way = random_.Point(size);
      way -= (1 - tilt) * way.dot(at.outward) * at.outward;
      corner = ToVector<V>(foot + way);
    }
    return corners;
  }

  // What a part by itself is found to be: `lowest`, or what comes down next.
  LowestPoint<V> ByItself(const LowestPoint<V>& lowest, const LowestPoint<V>& next,
                          bool& comes_next) const {
    const bool asks = !lowest.is_inside && !(lowest.gap > expected_) && !(lowest.room > 0);
    comes_next = asks && next.is_inside && next.gap <= expected_;
    return comes_next ? next : lowest;
  }

  // Four parts of each of many solids; `look` at one of them gives {lowest, next}.
  template <size_t kCorners, class Look, class LookAtFour>
  void Compare(ShapeKind kind, const Look& look, const LookAtFour& look_at_four) {
    size_t known = 0, inside = 0, count = 0;
    for (int k = 0; k < 4000; ++k) {
      const Collider collider = random_.Convex(kind);
      const Solid<V> solid(collider, kThickness_m);
      std::array<std::array<V, kCorners>, kFour> parts;
      CornersOfFour<V, kCorners> corners;
      for (size_t part = 0; part < kFour; ++part) {
        parts[part] = Part<kCorners>(collider);
        for (size_t c = 0; c < kCorners; ++c) corners[c][part] = parts[part][c];
      }
      const FourLowest<V> four = look_at_four(solid, corners);
      for (size_t part = 0; part < kFour; ++part) {
        ++count;
        const LowestPoint<V>& actual = four.lowest[part];
        const auto [lowest, next] = look(solid, parts[part]);
        bool comes_next = false;
        const LowestPoint<V> expected = ByItself(lowest, next, comes_next);
        if ((four.known >> part & 1) == 0) continue;
        ++known;
        ASSERT_FALSE(comes_next) << k << ", " << part;
        ASSERT_EQ(actual.is_inside, expected.is_inside) << k << ", " << part;
        if (!expected.is_inside) {
          ASSERT_EQ(std::max(actual.room, actual.gap), std::max(expected.room, expected.gap))
              << k << ", " << part;
          continue;
        }
        ++inside;
        ASSERT_EQ(actual.gap, expected.gap) << k << ", " << part;
        ASSERT_EQ(actual.weights, expected.weights) << k << ", " << part;
        for (int c = 0; c < 3; ++c) ASSERT_EQ(actual.normal[c], expected.normal[c]);
      }
    }
    EXPECT_GT(known, count / 2);
    if (kCorners == 2) {
      EXPECT_GT(inside, count / 20);
    }
  }

  const Real least_ = static_cast<Real>(kLeast_m), expected_ = static_cast<Real>(2e-3);
  RandomSolids random_{7};
};
TYPED_TEST_SUITE(FourPartsTest, Vectors);

TYPED_TEST(FourPartsTest, EdgesHaveTheBitsOfEachByItself) {
  using V = TypeParam;
  for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kCylinder}) {
    this->template Compare<2>(
        kind,
        [&](const Solid<V>& solid, const std::array<V, 2>& edge) {
          return std::pair(LowestOnEdge(solid, edge[0], edge[1], this->least_),
                           NextOnEdge(solid, edge[0], edge[1], this->least_));
        },
        [&](const Solid<V>& solid, const CornersOfFour<V, 2>& corners) {
          return LowestOnFourEdges(solid, corners, this->least_, this->expected_);
        });
  }
}

TYPED_TEST(FourPartsTest, TrianglesHaveTheBitsOfEachByItself) {
  using V = TypeParam;
  std::vector<V> corners_of_solid;
  for (const ShapeKind kind : {ShapeKind::kBox, ShapeKind::kCylinder}) {
    this->template Compare<3>(
        kind,
        [&](const Solid<V>& solid, const std::array<V, 3>& triangle) {
          const LowestPoint<V> lowest = LowestOnTriangle(solid, triangle, this->least_);
          return std::pair(lowest,
                           LowestCornerUnder(solid, triangle, lowest.normal, corners_of_solid));
        },
        [&](const Solid<V>& solid, const CornersOfFour<V, 3>& corners) {
          return LowestOnFourTriangles(solid, corners, this->expected_);
        });
  }
}

}  // namespace
}  // namespace drape::surface_contact
