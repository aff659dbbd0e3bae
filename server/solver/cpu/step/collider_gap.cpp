#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {

Gap GapOfLargerShape(const FloatCollider& collider, Vec4 q) {
  const auto& [kind, point, vector, offset, axes, samples, size] = collider;
  if (kind == ShapeKind::kDistanceMap) return DistanceMapGap(q, point, axes, samples, offset);
  const auto at_q = HWY_NAMESPACE::ShapeGap(kind, q, point, vector, axes, offset);
  return {at_q.gap, at_q.normal};
}

}  // namespace drape::cpu
