// How flat a patch is, and what that says of the distances in it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

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

template <class V>
PatchShape<V> ShapeOf(const ContactSurface& surface, const ContactPatch& patch,
                      std::span<const V> positions) {
  using Real = ScalarOf<V>;
  PatchShape<V> result;
  std::array<V, 16> normals{};
  size_t count = 0;
  V sum{};
  result.height_share = 1;
  for (const uint32_t t : surface.triangles_of(patch)) {
    const auto& [i, j, k] = surface.triangles()[t];
    const V a = positions[i];
    const V to_j = positions[j] - a, to_k = positions[k] - a, across = to_k - to_j;
    const V cross = Cross(to_j, to_k);
    const Real double_area = Length(cross);
    const Real longest =
        std::sqrt(std::max({SquaredLength(to_j), SquaredLength(to_k), SquaredLength(across)}));
    const auto rest_m = static_cast<Real>(surface.rest_height_m(t));
    const Real unit = rest_m * longest;
    result.height_share = std::min(result.height_share, unit > 0 ? double_area / unit : Real{0});
    normals[count] = double_area > 0 ? V(cross / double_area) : V{};
    sum += normals[count++];
  }
  const Real length = Length(sum);
  result.axis = length > 0 ? V(sum / length) : V{};
  result.min_cosine = 1;
  for (size_t k = 0; k < count; ++k) {
    result.min_cosine = std::min(result.min_cosine, Dot(normals[k], result.axis));
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
