// How flat a patch is, and what that says of the distances in it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "server/solver/self_contact/closest_side_by_side.h"
#include "server/solver/self_contact/contact_surface.h"
#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// Neighbouring patches lie flat if in their surroundings (patches that share a vertex with one of
// them, and themselves) no normal is farther than this from its patch's axis, and no axis from
// theirs [-, cosine]: 19 degrees each. What does not share a vertex is then apart
// by at least kFlatShare of its distance in the rest shape, times the share of the height that is
// left of the triangle that lost most (shear brings rows together) [-]. Larger shares: pairs of
// folds are missed; smaller ones: pairs of flat cloth are looked at in vain.
inline constexpr double kFlatCosine = 0.945;
inline constexpr double kFlatShare = 0.6;

// Of a patch, or of its surroundings.
template <class V>
struct PatchShape {
  V axis;                  // mean of the normals of its triangles, a unit vector
  ScalarOf<V> min_cosine;  // of a normal and its axis, and of an axis and that of the patch
  // Smallest height of a triangle, above its longest edge, over that at rest; at most 1.
  ScalarOf<V> height_share;
};

// Of four triangles; those of no area have the normal 0.
template <class V>
struct FourTriangles {
  FourPoints<V> normals;
  V height_shares;  // of the height above the longest edge at rest
};

template <class V>
FourTriangles<V> ShapeOf(const FourPoints<V>& a, const FourPoints<V>& b, const FourPoints<V>& c,
                         const V& rest_heights) {
  const V zero{};
  const auto to_b = b - a, to_c = c - a, across = to_c - to_b;
  const FourPoints<V> cross = {to_b.y * to_c.z - to_b.z * to_c.y, to_b.z * to_c.x - to_b.x * to_c.z,
                               to_b.x * to_c.y - to_b.y * to_c.x};
  const V double_areas = RootOf(Dot(cross, cross));
  const V longest = RootOf(Larger(Larger(Dot(to_b, to_b), Dot(to_c, to_c)), Dot(across, across)));
  const V units = rest_heights * longest;
  const auto has_area = double_areas > 0;
  const FourPoints<V> directions = cross / double_areas;
  return {{has_area ? directions.x : zero, has_area ? directions.y : zero,
           has_area ? directions.z : zero},
          units > 0 ? double_areas / units : zero};
}

template <class V>
PatchShape<V> ShapeOf(const ContactSurface& surface, const ContactPatch& patch,
                      std::span<const V> positions) {
  using Real = ScalarOf<V>;
  constexpr size_t kFours = kPatchTriangles / kPairsSideBySide;
  const std::span<const uint32_t> triangles = surface.triangles_of(patch);
  std::array<FourPoints<V>, kFours> normals;
  PatchShape<V> result;
  V sum{};
  result.height_share = 1;
  for (size_t begin = 0; begin < triangles.size(); begin += kPairsSideBySide) {
    const size_t count = std::min(kPairsSideBySide, triangles.size() - begin);
    const auto triangle = [&](size_t lane) { return triangles[begin + std::min(lane, count - 1)]; };
    const auto corner = [&](size_t k) {
      const auto of = [&](size_t lane) {
        return positions[surface.triangles()[triangle(lane)][k]];
      };
      return Transposed(of(0), of(1), of(2), of(3));
    };
    const auto height = [&](size_t lane) {
      return static_cast<Real>(surface.rest_height_m(triangle(lane)));
    };
    const FourTriangles<V> four =
        ShapeOf(corner(0), corner(1), corner(2), V{height(0), height(1), height(2), height(3)});
    const FourPoints<V>& n = normals[begin / kPairsSideBySide] = four.normals;
    for (size_t lane = 0; lane < count; ++lane) {
      sum += V{n.x[lane], n.y[lane], n.z[lane], 0};
      result.height_share = std::min(result.height_share, four.height_shares[lane]);
    }
  }
  const Real length = Length(sum);
  result.axis = length > 0 ? V(sum / length) : V{};
  result.min_cosine = 1;
  const V zero{};
  const FourPoints<V> axis = {zero + result.axis[0], zero + result.axis[1], zero + result.axis[2]};
  for (size_t begin = 0; begin < triangles.size(); begin += kPairsSideBySide) {
    // Lanes behind the last triangle are like it.
    const V cosines = Dot(normals[begin / kPairsSideBySide], axis);
    for (int lane = 0; lane < 4; ++lane) {
      result.min_cosine = std::min(result.min_cosine, cosines[lane]);
    }
  }
  return result;
}

// Adds a patch to the surroundings of one. A patch that is flat by itself can cover itself: where a
// fold goes through triangles of others, it lies on both sides.
template <class V>
void AddToSurroundings(PatchShape<V>& surroundings, const PatchShape<V>& other) {
  surroundings.min_cosine =
      std::min({surroundings.min_cosine, other.min_cosine, Dot(surroundings.axis, other.axis)});
  surroundings.height_share = std::min(surroundings.height_share, other.height_share);
}

// How far primitives without a common vertex of two neighbouring patches are apart at least, by
// their surroundings; 0 unless they lie flat [m].
template <class V>
ScalarOf<V> FlatGap(const PatchShape<V>& a, const PatchShape<V>& b, double rest_gap_m) {
  using Real = ScalarOf<V>;
  constexpr auto kCosine = static_cast<Real>(kFlatCosine);
  const bool is_flat =
      std::min(a.min_cosine, b.min_cosine) > kCosine && Dot(a.axis, b.axis) > kCosine;
  if (!is_flat) return 0;
  return static_cast<Real>(kFlatShare * rest_gap_m) * std::min(a.height_share, b.height_share);
}

}  // namespace drape::self_contact
