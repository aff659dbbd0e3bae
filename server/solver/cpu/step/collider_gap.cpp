#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {

Gap GapOfLargerShape(const FloatCollider& collider, const FloatPlace& place, Vec4 q) {
  const auto& [point, vector, axes] = place;
  if (collider.kind == ShapeKind::kDistanceMap) {
    return DistanceMapGap(q, point, axes, collider.samples, collider.offset);
  }
  const auto at_q = HWY_NAMESPACE::ShapeGap(collider.kind, q, point, vector, axes, collider.offset);
  return {at_q.gap, at_q.normal};
}

}  // namespace drape::cpu
