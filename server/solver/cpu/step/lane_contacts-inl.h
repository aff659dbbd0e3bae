// Contacts of particles in lanes with one collider: of one particle of each cloth of a group, or of
// many particles of one cloth. Compiled once per instruction set.
#if defined(DRAPE_CPU_STEP_LANE_CONTACTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_STEP_LANE_CONTACTS_INL_H_
#undef DRAPE_CPU_STEP_LANE_CONTACTS_INL_H_
#else
#define DRAPE_CPU_STEP_LANE_CONTACTS_INL_H_
#endif

#include <hwy/highway.h>

#include <array>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/contact_math-inl.h"
#include "server/solver/cpu/formulas/distance_map_gap.h"
#include "server/solver/cpu/model/float_controls.h"
#include "server/solver/cpu/simd/vec_cloths-inl.h"
#include "server/solver/cpu/step/step_context.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Where one collider of each cloth is (FloatPlace).
struct ClothPlace {
  VectorsCloths point, vector;
  std::array<VectorsCloths, 3> axes;
  FloatPlace of_map{};  // of a distance map, which is that of one cloth
};

// One collider of each cloth, all of one kind (FloatCollider).
struct ClothCollider {
  ShapeKind kind;
  ClothPlace place;
  VecCloths offset, size;
  const FloatCollider* map = nullptr;  // of one cloth only: the same in all lanes, a distance map
};

// MovingSurface::Pose of each cloth.
struct ClothPose {
  VectorsCloths position;
  ClothPlace place;
};

// How one collider of each cloth moves in a substep (MovingSurface).
struct ClothMotion {
  ClothPose start, end;
  VectorsCloths velocity, angular_velocity;
  VecCloths chord_sine, chord_cosine, duration;
  VecCloths size = SplatCloths(0);  // of the pivot's and the collider's coordinates, added up [m]
};

// The impulses of that collider on one particle of each cloth in this substep, times w
// (ContactImpulses).
struct ClothContact {
  VectorsCloths tangent;
  VecCloths normal, floor, rebound;
};

// ParticleBox of each cloth.
struct ClothBox {
  VectorsCloths low, high;
};
// Set for the cloths whose place is in their box; never for a place that is not a number.
HWY_INLINE MaskCloths Holds(const ClothBox& box, const VectorsCloths& place) {
  return ((place.x >= box.low.x) & (box.high.x >= place.x)) &
         ((place.y >= box.low.y) & (box.high.y >= place.y)) &
         ((place.z >= box.low.z) & (box.high.z >= place.z));
}

using ClothGap = Gaps<VecCloths, VectorsCloths>;

HWY_NOINLINE ClothGap MapGap(const VectorsCloths& q, const FloatCollider& map,
                             const FloatPlace& place) {
  alignas(64) float x[kClothCount], y[kClothCount], z[kClothCount], gaps[kClothCount];
  hn::Store(q.x.v, ClothsTag(), x);
  hn::Store(q.y.v, ClothsTag(), y);
  hn::Store(q.z.v, ClothsTag(), z);
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const Gap gap = DistanceMapGap(Vec4{x[lane], y[lane], z[lane], 0}, place.point, place.axes,
                                   map.samples, map.offset);
    gaps[lane] = gap.gap;
    x[lane] = gap.normal[0];
    y[lane] = gap.normal[1];
    z[lane] = gap.normal[2];
  }
  return {LoadCloths(gaps), {LoadCloths(x), LoadCloths(y), LoadCloths(z)}};
}

// `place`: where the collider is.
HWY_INLINE ClothGap GapAt(const VectorsCloths& q, const ClothCollider& collider,
                          const ClothPlace& place) {
  if (collider.map != nullptr) return MapGap(q, *collider.map, place.of_map);
  return ShapeGap(collider.kind, q, place.point, place.vector, place.axes, collider.offset);
}

class RestingSurfaces {
 public:
  static constexpr bool kMoves = false;

  explicit RestingSurfaces(const ClothCollider& collider) : collider_(collider) {}

  ClothGap GapAtStart(const VectorsCloths& p) const { return GapAt(p, collider_, collider_.place); }
  ClothGap GapAtEnd(const VectorsCloths& q) const { return GapAt(q, collider_, collider_.place); }
  // Of the gap at q [m].
  VecCloths RoundOff(const VectorsCloths& q) const {
    return SplatCloths(kTouchRoundOff) * (SumOfSizes(q) + collider_.size);
  }

 private:
  const ClothCollider& collider_;
};

class MovingSurfaces {
 public:
  static constexpr bool kMoves = true;

  MovingSurfaces(const ClothCollider& collider, const ClothMotion& motion)
      : collider_(collider), motion_(motion) {}

  ClothGap GapAtStart(const VectorsCloths& p) const {
    return GapAt(p, collider_, motion_.start.place);
  }
  ClothGap GapAtEnd(const VectorsCloths& q) const { return GapAt(q, collider_, motion_.end.place); }
  // Of the gap at q [m].
  VecCloths RoundOff(const VectorsCloths& q) const {
    return SplatCloths(kTouchRoundOff) * (SumOfSizes(q) + motion_.size);
  }
  // Velocities of the points of the colliders that are at `place` then [m/s].
  VectorsCloths VelocityAtStart(const VectorsCloths& place) const {
    return VelocityFrom(motion_.start, place);
  }
  VectorsCloths VelocityAtEnd(const VectorsCloths& place) const {
    return VelocityFrom(motion_.end, place);
  }
  // Over the substep, of the points that are at `place` when it starts [m/s]: v + (R r - r)/h for r
  // from the position of the pivot, without the difference: with a = |w| h, sin(a)/a w x r + h (1 -
  // cos(a))/a^2 w x (w x r).
  VectorsCloths MeanVelocity(const VectorsCloths& place) const {
    const VectorsCloths tangent = Cross(motion_.angular_velocity, place - motion_.start.position);
    return motion_.velocity + motion_.chord_sine * tangent +
           motion_.chord_cosine * Cross(motion_.angular_velocity, tangent);
  }
  // Where they go in the substep [m].
  VectorsCloths WayOf(const VectorsCloths& place) const {
    return motion_.duration * MeanVelocity(place);
  }

 private:
  VectorsCloths VelocityFrom(const ClothPose& pose, const VectorsCloths& place) const {
    return motion_.velocity + Cross(motion_.angular_velocity, place - pose.position);
  }

  const ClothCollider& collider_;
  const ClothMotion& motion_;
};

// What contacts need to know of the cloth in each lane (FloatControls).
struct ContactCloths {
  // `number_of(member)`: that of FloatControls in each lane.
  template <class NumberOf>
  ContactCloths(const VectorsCloths& its_gravity, const NumberOf& number_of)
      : gravity(its_gravity),
        friction_static(number_of(&FloatControls::friction_static)),
        friction_dynamic(number_of(&FloatControls::friction_dynamic)),
        restitution(number_of(&FloatControls::restitution)),
        slowest_rebound(number_of(&FloatControls::slowest_rebound)),
        slowest_landing(number_of(&FloatControls::slowest_landing)),
        slowest_slip(number_of(&FloatControls::slowest_slip)),
        has_restitution(IsAnyLaneSet(restitution > SplatCloths(0))),
        has_two_frictions(IsAnyLaneSet(friction_static > friction_dynamic)) {}

  VectorsCloths gravity;
  VecCloths friction_static, friction_dynamic;
  VecCloths restitution, slowest_rebound, slowest_landing, slowest_slip;
  bool has_restitution;    // in some lane
  bool has_two_frictions;  // the same
};

// And of a substep; `controls`: only what all cloths share.
struct ContactNumbers : ContactCloths {
  ContactNumbers(const ContactCloths& cloths, const FloatControls& controls,
                 const FloatSubstep& substep)
      : ContactCloths(cloths),
        h(controls.h),
        interval(substep.interval),
        inverse_interval(substep.inverse_interval),
        half_interval(substep.half_interval),
        depenetration_distance(controls.depenetration_distance),
        tolerance(controls.contact_tolerance),
        is_two_step(substep.is_two_step),
        has_quiet_links(controls.plan.solver.has_quiet_links),
        judges_sliding(is_two_step && has_two_frictions) {}

  float h, interval, inverse_interval, half_interval;
  float depenetration_distance, tolerance;
  bool is_two_step, has_quiet_links;
  bool judges_sliding;  // what slides slowly keeps the static friction
};

// Relative to the surface where the particle is.
template <class Surface>
HWY_INLINE VectorsCloths VelocityBefore(const Surface& surface, const VectorsCloths& p,
                                        const VectorsCloths& v) {
  if constexpr (Surface::kMoves) return v - surface.VelocityAtStart(p);
  return v;
}

// From positions and velocities before the substep. Returns the gap then.
template <class Surface>
HWY_INLINE VecCloths PredictContact(const ContactNumbers& numbers, const Surface& surface,
                                    const VectorsCloths& p, const VectorsCloths& v_before,
                                    ClothContact& contact, VecCloths& quiet_round_off) {
  const VecCloths zero = SplatCloths(0);
  const ClothGap gap = surface.GapAtStart(p);
  contact.tangent = {zero, zero, zero};
  contact.normal = zero;
  contact.floor = ContactFloor(gap.gap, numbers.depenetration_distance);
  contact.rebound = zero;
  if (!numbers.has_restitution && !numbers.has_quiet_links) return gap.gap;
  const VectorsCloths v = VelocityBefore(surface, p, v_before);
  if (numbers.has_restitution) {
    contact.rebound = ReboundSpeed(gap.gap, gap.normal, v, numbers.gravity, numbers.restitution,
                                   numbers.slowest_rebound);
  }
  quiet_round_off = Max(quiet_round_off,
                        QuietRoundOff(gap.gap, surface.RoundOff(p), p, v, numbers.slowest_landing));
  return gap.gap;
}

// What a particle does relative to a surface when a substep with two steps begins.
struct StartOfContact {
  VectorsCloths sliding;
  MaskCloths has_landed;  // it hits the surface in the substep
  VecCloths extent;       // sum of its position's sizes [m], of which rounding is a share
};

// `p`, `v`: of the particle then.
template <class Surface>
StartOfContact StartOf(const ContactNumbers& numbers, const Surface& surface,
                       const VectorsCloths& p, const VectorsCloths& v) {
  const VectorsCloths normal = surface.GapAtStart(p).normal;
  const VectorsCloths relative = VelocityBefore(surface, p, v);
  return {Tangential(relative, normal), IsLanding(normal, relative, numbers.slowest_landing),
          SumOfSizes(p)};
}

// The coefficient with which friction gives what it can of `wanted`. `something_holds`: of the
// whole cloth.
inline VecCloths FrictionOf(const ContactNumbers& numbers, const StartOfContact& start,
                            VecCloths size, VecCloths impulse, MaskCloths something_holds) {
  const VecCloths at_once =
      FrictionAtOnce(size, impulse, numbers.friction_static, numbers.friction_dynamic);
  if (!numbers.judges_sliding) return at_once;
  const VecCloths slip_speed = SlipSpeed(numbers.friction_static, impulse, numbers.slowest_slip);
  const VecCloths by_speed = Select(Sqrt(Dot(start.sliding, start.sliding)) > slip_speed,
                                    numbers.friction_dynamic, numbers.friction_static);
  return Select(AndNot(start.has_landed, something_holds), by_speed, at_once);
}

// Friction of a particle, predicted from b. Returns the lanes that it changed beyond the tolerance.
// `start()`: StartOfContact. `something_holds`: the lanes are added in which static friction holds
// what acts on the particle, apart from what it takes to stop it.
template <class Surface, class Start>
MaskCloths SolveFriction(const ContactNumbers& numbers, const Surface& surface, const Start& start,
                         const VectorsCloths& b, const VectorsCloths& n, MaskCloths is_active,
                         ClothContact& contact, VectorsCloths& u, MaskCloths& something_holds) {
  VectorsCloths relative = u;
  // With two steps u is the velocity at the end of the substep, else the mean over it.
  if constexpr (Surface::kMoves) {
    relative = u - (numbers.is_two_step ? surface.VelocityAtEnd(b + u * numbers.interval)
                                        : surface.MeanVelocity(b));
  }
  const VecCloths impulse = numbers.is_two_step
                                ? WholeImpulse(contact.normal, contact.rebound, Dot(relative, n))
                                : contact.normal;
  const VectorsCloths wanted = contact.tangent - Tangential(relative, n);
  const VecCloths size = Sqrt(Dot(wanted, wanted));
  VecCloths friction =
      FrictionAtOnce(size, impulse, numbers.friction_static, numbers.friction_dynamic);
  if (numbers.judges_sliding) {
    const VecCloths limit = numbers.friction_static * impulse;
    MaskCloths holds = AndNot(size > limit, is_active);
    // What the dynamic friction holds has any of both.
    if (IsAnyLaneSet(is_active & (size > numbers.friction_dynamic * impulse))) {
      const StartOfContact at_start = start();
      const VectorsCloths acts = wanted + at_start.sliding;
      const VecCloths rounding = at_start.extent * (static_cast<float>(kSlipRoundOffs) * kRoundOff *
                                                    numbers.inverse_interval);
      const VecCloths doubt = Min(rounding, limit * static_cast<float>(kSlipDoubt));
      holds |= AndNot(Sqrt(Dot(acts, acts)) + doubt > limit, is_active);
      friction = FrictionOf(numbers, at_start, size, impulse, is_active);
    }
    something_holds |= holds;
  }
  const VectorsCloths tangent = FrictionImpulse(wanted, size, impulse, friction);
  const VectorsCloths change = tangent - contact.tangent;
  u = Select(is_active, u + change, u);
  contact.tangent = Select(is_active, tangent, contact.tangent);
  return is_active & (SplatCloths(numbers.interval) * Sqrt(Dot(change, change)) >
                      SplatCloths(numbers.tolerance));
}

// A particle before the substep.
struct ParticlesBefore {
  VectorsCloths p, v;
};

// From where the particle predicted from b was before the substep, `before()` with two steps, to
// where it will be after it, relative to the surface.
template <class Surface, class Before>
HWY_INLINE VectorsCloths WayOf(const ContactNumbers& numbers, const Surface& surface,
                               const Before& before, const VectorsCloths& b,
                               const VectorsCloths& u) {
  const VectorsCloths move = u * numbers.interval;
  const VectorsCloths p = numbers.is_two_step ? before().p : b;
  const VectorsCloths way = numbers.is_two_step ? (b - p) + move : move;
  if constexpr (Surface::kMoves) return way - surface.WayOf(p);
  return way;
}

// Whether contacts have given an impulse in one of the lanes in this substep.
HWY_INLINE bool HasImpulse(const ClothContact& contact) {
  const VecCloths zero = SplatCloths(0);
  return IsAnyLaneSet((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
}

// Some lanes against one collider; `before()`: ParticlesBefore, with two steps. `after()` is called
// where it may have changed u.
template <class Surface, class Before, class After>
MaskCloths SolveContact(const ContactNumbers& numbers, const Surface& surface, const Before& before,
                        MaskCloths lanes, const VectorsCloths& b, ClothContact& contact,
                        VectorsCloths& u, MaskCloths& something_holds, const After& after) {
  const VecCloths zero = SplatCloths(0);
  const VectorsCloths q = b + u * numbers.interval;
  const ClothGap at_end = surface.GapAtEnd(q);
  const VecCloths round_off = surface.RoundOff(q);
  // With such a gap the error is more than 0, whatever the way (ContactError).
  const bool is_apart = AreAllLanesSet(at_end.gap > round_off + round_off);
  if (is_apart && !HasImpulse(contact)) return {};
  const VecCloths way = Dot(WayOf(numbers, surface, before, b, u), at_end.normal);
  const VecCloths error = ContactError(at_end.gap, way, round_off, contact.floor);
  const VecCloths impulse = ContactImpulse(contact.normal, error, numbers.inverse_interval);
  if (!IsAnyLaneSet(impulse > zero) && !HasImpulse(contact)) return {};
  // Changes within the tolerance are applied too, but do not keep the sweeps going: in short
  // substeps friction consists of nothing else.
  const VecCloths change = impulse - contact.normal;
  u = Select(lanes, u + change * at_end.normal, u);
  contact.normal = Select(lanes, impulse, contact.normal);
  const VecCloths tolerance = SplatCloths(numbers.tolerance);
  const MaskCloths changed = lanes & (SplatCloths(numbers.interval) * Abs(change) > tolerance);
  const MaskCloths has_friction =
      (numbers.friction_static > zero) &
      ((contact.normal > zero) | (Dot(contact.tangent, contact.tangent) > zero));
  const auto start = [&] {
    const ParticlesBefore particles = before();
    return StartOf(numbers, surface, particles.p, particles.v);
  };
  const MaskCloths slips = SolveFriction(numbers, surface, start, b, at_end.normal,
                                         lanes & has_friction, contact, u, something_holds);
  after();
  return changed | slips;
}

// The velocity at p after the contact, of the lanes that it pushed. `start`: with two steps.
template <class Surface>
VectorsCloths CorrectContact(const ContactNumbers& numbers, const Surface& surface,
                             const StartOfContact& start, const VectorsCloths& p,
                             const ClothContact& contact, MaskCloths has_impulse,
                             MaskCloths something_holds, const VectorsCloths& v) {
  const VecCloths zero = SplatCloths(0);
  // With two steps u has the speed at which the error of the whole substep was removed.
  const VectorsCloths kick = numbers.is_two_step ? VectorsCloths{zero, zero, zero}
                                                 : numbers.gravity * numbers.half_interval;
  const VectorsCloths n = surface.GapAtEnd(p).normal;
  const auto after_contact = [&](const VectorsCloths& relative) {
    return VelocityAfterContact(relative, n, kick, contact.tangent, contact.normal, contact.rebound,
                                numbers.is_two_step, [&](VecCloths size, VecCloths impulse) {
                                  return FrictionOf(numbers, start, size, impulse, something_holds);
                                });
  };
  if constexpr (Surface::kMoves) {
    const VectorsCloths of_surface = surface.VelocityAtEnd(p);
    return Select(has_impulse, of_surface + after_contact(v - of_surface), v);
  } else {
    return Select(has_impulse, after_contact(v), v);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
