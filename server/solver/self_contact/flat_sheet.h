// Sheets that are flat and convex at rest, and whether they still lie so flat that nothing of them
// can touch: then nothing needs to be searched.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// The map from a convex domain to space whose gradients F are near one of them, M, keeps points
// apart: along the straight line between X and Y,
//   |x(X) - x(Y)| = |M (X - Y) + (mean of F - M)(X - Y)| >= (s - d) |X - Y|,
// with s the smaller singular value of M and d the largest |F - M|. As the triangles move, F
// changes by no more than the gradient of their velocities times the time. Constant after
// construction.
class FlatSheet {
 public:
  // None unless the triangles cover a convex part of a plane once, without holes.
  static std::optional<FlatSheet> Of(std::span<const Vector3d> rest_positions,
                                     std::span<const std::array<uint32_t, 3>> triangles);

  // Vertices, edges and triangles without a common vertex are at least this far apart at rest: the
  // line from a vertex to anything beyond its triangles crosses one of them, and of two edges that
  // do not cross an end is nearest to the other one [m].
  double least_gap_m() const { return least_gap_m_; }

  // Whether all points are at least `share` of their distance at rest apart, for all of
  // `duration`, in which each particle keeps its velocity [-]. False: perhaps not.
  template <class V>
  bool KeepsApart(std::span<const V> positions, std::span<const V> velocities, ScalarOf<V> duration,
                  ScalarOf<V> share) const;

 private:
  // Columns of the gradient: weighted edges of a triangle, from its first corner.
  struct Gradient {
    std::array<uint32_t, 3> corners;
    std::array<float, 4> weights;  // of both edges in the first column, then in the second
  };
  // M is the mean over the sheet: a weighted sum over its boundary.
  struct OfMean {
    uint32_t particle;
    std::array<float, 2> weights;
  };

  std::vector<Gradient> gradients_;
  std::vector<OfMean> mean_;
  double least_gap_m_ = 0;  // the least height of a triangle
};

extern template bool FlatSheet::KeepsApart<Vector3f>(std::span<const Vector3f>,
                                                     std::span<const Vector3f>, float, float) const;
extern template bool FlatSheet::KeepsApart<Vector3d>(std::span<const Vector3d>,
                                                     std::span<const Vector3d>, double,
                                                     double) const;

}  // namespace drape::self_contact
