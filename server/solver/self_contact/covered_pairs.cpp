#include "server/solver/self_contact/covered_pairs.h"

#include "shaders/interface/self_contact_search.h"

namespace drape::self_contact {

template <class V>
bool IsCovered(const ContactSurface& surface, std::span<const V> positions,
               const ContactPair<V>& pair) {
  using Real = ScalarOf<V>;
  if (pair.kind != PairKind::kVertexTriangle || !IsAtBorder(pair)) return false;
  // The nearest point is the corner `at`, or between that and `end`.
  constexpr uint32_t kNone = UINT32_MAX;
  uint32_t at = kNone, end = kNone, beside = kNone;
  for (int k = 1; k < 4; ++k) {
    uint32_t& place = pair.weights[k] == 0 ? beside : (at == kNone ? at : end);
    place = pair.particles[k];
  }
  if (at == kNone) return false;
  const auto leans_over = [&](uint32_t i) {
    constexpr Real kLeastSine = static_cast<Real>(DRAPE_CONTACT_LEAST_LEAN);
    const V side = positions[i] - positions[at];
    const Real along = Dot(pair.normal, side);
    return along > 0 && along * along > kLeastSine * kLeastSine * SquaredLength(side);
  };
  for (const auto& [i, j] : surface.corners_around(at)) {
    if (end == kNone) {
      if (leans_over(i) || leans_over(j)) return true;
    } else if (i == end || j == end) {
      const uint32_t other = i == end ? j : i;
      if (other != beside && leans_over(other)) return true;
    }
  }
  return false;
}

template bool IsCovered(const ContactSurface&, std::span<const Vector3f>,
                        const ContactPair<Vector3f>&);
template bool IsCovered(const ContactSurface&, std::span<const Vector3d>,
                        const ContactPair<Vector3d>&);

}  // namespace drape::self_contact
