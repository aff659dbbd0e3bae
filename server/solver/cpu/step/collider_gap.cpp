#include "server/solver/cpu/step/collider_gap.h"

namespace drape::cpu {

Gap GapOfLargerShape(const FloatCollider& collider, Vec4 q) {
  const auto& [kind, point, vector, offset, axes, samples] = collider;
  if (kind == FloatCollider::Kind::kDistanceMap) {
    return DistanceMapGap(q, point, axes, samples, offset);
  }
  const std::array<float, 3> half_extents = {vector[0], vector[1], vector[2]};
  const auto at_q = kind == FloatCollider::Kind::kCapsule
                        ? HWY_NAMESPACE::CapsuleGap(q, point, vector, axes[0], offset)
                        : HWY_NAMESPACE::BoxGap(q, point, half_extents, axes, offset);
  return {at_q.gap, at_q.normal};
}

}  // namespace drape::cpu
