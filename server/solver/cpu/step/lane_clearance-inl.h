// The surfaces of one cloth's colliders for many of its particles, one in each lane, which know
// what is clear of them. Compiled once per instruction set.
#if defined(DRAPE_CPU_STEP_LANE_CLEARANCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_STEP_LANE_CLEARANCE_INL_H_
#undef DRAPE_CPU_STEP_LANE_CLEARANCE_INL_H_
#else
#define DRAPE_CPU_STEP_LANE_CLEARANCE_INL_H_
#endif

#include <hwy/highway.h>

#include "server/solver/cpu/step/clearance.h"
#include "server/solver/cpu/step/collider_surface.h"
#include "server/solver/cpu/step/lane_contacts-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Of the particle in each lane.
struct ClothClearance {
  VectorsCloths place;
  VecCloths way, at_s, arm;
};

inline VectorsCloths SplatVectors(const Vec4& v) {
  return {SplatCloths(v[0]), SplatCloths(v[1]), SplatCloths(v[2])};
}

HWY_INLINE VecCloths ClearWay(const FloatCollider& collider, VecCloths gap, VecCloths round_off) {
  const VecCloths reliable = gap * kReliableShare - round_off * kClearRoundOffs;
  return collider.kind == ShapeKind::kDistanceMap ? reliable / kMapSlope : reliable;
}

// `surface_way`: how far the collider may have come at the place since [m].
HWY_INLINE MaskCloths IsClear(const ClothClearance& clearance, const VectorsCloths& q,
                              VecCloths surface_way) {
  const VecCloths way = clearance.way - surface_way;
  const VectorsCloths d = q - clearance.place;
  return (way > SplatCloths(0)) & (Dot(d, d) < way * way);  // not, if q is no number
}

class RestingOfCloth : public RestingSurfaces {
 public:
  RestingOfCloth(const ClothCollider& collider, const FloatCollider& described)
      : RestingSurfaces(collider), described_(described) {}

  ClothClearance ClearanceAtStart(const VectorsCloths& p, VecCloths gap) const {
    const VecCloths zero = SplatCloths(0);
    return {p, ClearWay(described_, gap, RoundOff(p)), zero, zero};
  }
  MaskCloths IsClearAtStart(const ClothClearance& clearance, const VectorsCloths& p) const {
    return IsClear(clearance, p, SplatCloths(0));
  }
  MaskCloths IsClearAtEnd(const ClothClearance& clearance, const VectorsCloths& q) const {
    return IsClear(clearance, q, SplatCloths(0));
  }

 private:
  const FloatCollider& described_;
};

class MovingOfCloth : public MovingSurfaces {
 public:
  MovingOfCloth(const ClothCollider& collider, const FloatCollider& described,
                const ClothMotion& motion, const MovingSurface& surface)
      : MovingSurfaces(collider, motion),
        described_(described),
        position_(motion.start.position),
        speed_(SplatCloths(surface.speed())),
        turning_per_s_(SplatCloths(surface.turning_per_s())),
        start_s_(SplatCloths(surface.start_s())),
        end_s_(SplatCloths(surface.end_s())) {}

  ClothClearance ClearanceAtStart(const VectorsCloths& p, VecCloths gap) const {
    const VectorsCloths arm = p - position_;
    return {p, ClearWay(described_, gap, RoundOff(p)), start_s_, Sqrt(Dot(arm, arm))};
  }
  MaskCloths IsClearAtStart(const ClothClearance& clearance, const VectorsCloths& p) const {
    return IsClear(clearance, p, WayAtMost(clearance, start_s_));
  }
  MaskCloths IsClearAtEnd(const ClothClearance& clearance, const VectorsCloths& q) const {
    return IsClear(clearance, q, WayAtMost(clearance, end_s_));
  }

 private:
  // How far the collider may have come at the clearance's place until `time_s` of the step [m]: a
  // point that rests is at most as far from its position as it was, and what that has moved.
  HWY_INLINE VecCloths WayAtMost(const ClothClearance& clearance, VecCloths time_s) const {
    const VecCloths passed_s = time_s - clearance.at_s;
    return passed_s * (speed_ + turning_per_s_ * (clearance.arm + speed_ * passed_s));
  }

  const FloatCollider& described_;
  const VectorsCloths position_;
  const VecCloths speed_, turning_per_s_;
  const VecCloths start_s_, end_s_;
};

ClothPlace InAllLanes(const FloatPlace& place) {
  return {SplatVectors(place.point),
          SplatVectors(place.vector),
          {SplatVectors(place.axes[0]), SplatVectors(place.axes[1]), SplatVectors(place.axes[2])},
          place};
}

// One collider for all lanes.
ClothCollider InAllLanes(const FloatCollider& collider) {
  ClothCollider result{.kind = collider.kind,
                       .place = InAllLanes(collider.place),
                       .offset = SplatCloths(collider.offset),
                       .size = SplatCloths(collider.size)};
  if (collider.kind == ShapeKind::kDistanceMap) result.map = &collider;
  return result;
}
ClothPose InAllLanes(const MovingSurface::Pose& pose) {
  return {SplatVectors(pose.position), InAllLanes(pose.place)};
}
ClothMotion InAllLanes(const MovingSurface& surface, float substep_s) {
  ClothMotion motion{.start = InAllLanes(surface.start()),
                     .end = InAllLanes(surface.end()),
                     .velocity = SplatVectors(surface.velocity()),
                     .angular_velocity = SplatVectors(surface.angular_velocity()),
                     .chord_sine = SplatCloths(surface.chord_sine()),
                     .chord_cosine = SplatCloths(surface.chord_cosine()),
                     .duration = SplatCloths(substep_s)};
  motion.size = SumOfSizes(motion.end.position) + SumOfSizes(motion.end.place.point);
  return motion;
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
