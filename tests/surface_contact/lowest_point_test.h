// What tests of lowest points compare them with: sampling.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>

#include "server/solver/surface_contact/lowest_point.h"
#include "tests/surface_contact/random_solids.h"

namespace drape::surface_contact {

using self_contact::ToVector;
using test::RandomSolids;

inline constexpr double kThickness_m = 0.003;
inline constexpr float kLeast_m = 1e-5f;

template <class V>
class LowestPointTest : public testing::Test {
 protected:
  using Real = ScalarOf<V>;
  // Coordinates below 1 m; some 30 operations on them, the last of which divide by lengths of a
  // tenth.
  static constexpr double kRounding_m = 300 * std::numeric_limits<Real>::epsilon();

  static double GapOf(const Collider& collider, const Eigen::Vector3d& x) {
    return SurfaceOf(collider, x).distance_m - kThickness_m;
  }
  // The lowest of `count` + 1 places of an edge: off by no more than half an interval.
  static double LowestOf(const Collider& collider, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b, int count = 2000) {
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= count; ++k) {
      lowest = std::min(lowest, GapOf(collider, a + (b - a) * k / count));
    }
    return lowest;
  }
  static double LowestOf(const Collider& collider, const std::array<Eigen::Vector3d, 3>& corners,
                         int count = 100) {
    double lowest = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= count; ++i) {
      for (int j = 0; i + j <= count; ++j) {
        lowest =
            std::min(lowest, GapOf(collider, corners[0] + (corners[1] - corners[0]) * i / count +
                                                 (corners[2] - corners[0]) * j / count));
      }
    }
    return lowest;
  }
  static double RimOf(const Collider& collider, const std::array<Eigen::Vector3d, 3>& corners) {
    return std::min({LowestOf(collider, corners[0], corners[1], 400),
                     LowestOf(collider, corners[1], corners[2], 400),
                     LowestOf(collider, corners[2], corners[0], 400)});
  }
};

// Its centre and normal.
template <class V>
std::array<V, 3> TriangleAround(RandomSolids& random, const Eigen::Vector3d& centre,
                                const Eigen::Vector3d& n) {
  const Eigen::Vector3d along = n.unitOrthogonal(), across = n.cross(along);
  const double u = random.Between(0.02, 0.04), v = random.Between(0.02, 0.04);
  return {ToVector<V>(centre - u * along - v * across), ToVector<V>(centre + 2 * u * along),
          ToVector<V>(centre - u * along + v * across)};
}

using Vectors = testing::Types<self_contact::Vector3f, self_contact::Vector3d>;

}  // namespace drape::surface_contact
