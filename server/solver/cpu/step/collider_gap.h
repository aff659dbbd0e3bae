// Gap and normal at a collider of one cloth. For code of the plain instruction set: it uses
// contact_math-inl.h.
#pragma once

#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/cpu/formulas/contact_math-inl.h"
#include "server/solver/cpu/model/float_controls.h"

namespace drape::cpu {

// The gap of any shape. Not inline: in loops over particles it would slow spheres and
// planes down.
Gap GapOfLargerShape(const FloatCollider& collider, const FloatPlace& place, Vec4 q);

// `place`: where the collider is.
inline Gap GapAt(const FloatCollider& collider, const FloatPlace& place, Vec4 q) {
  if (collider.kind == ShapeKind::kSphere) {
    const auto at_q = HWY_NAMESPACE::SphereGap(q, place.point, collider.offset);
    return {at_q.gap, at_q.normal};
  }
  if (collider.kind == ShapeKind::kPlane) {
    const auto at_q = HWY_NAMESPACE::PlaneGap(q, place.point, place.vector, collider.offset);
    return {at_q.gap, at_q.normal};
  }
  return GapOfLargerShape(collider, place, q);
}

// The counterpart of MovingSurface: a collider that rests as described.
class RestingSurface {
 public:
  explicit RestingSurface(const FloatCollider& collider) : collider_(collider) {}

  Gap GapAtStart(Vec4 p) const { return GapAt(collider_, collider_.place, p); }

 private:
  const FloatCollider& collider_;
};

}  // namespace drape::cpu
