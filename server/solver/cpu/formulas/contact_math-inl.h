// The formulas of contacts for both paths: Scalars and Vectors are one number and one vector of a
// particle (float, Vec4) or of the same particle of several cloths (VecCloths, VectorsCloths). The
// operations and their order are the same, so a cloth has the same bits on either path. Symbols as
// in constraint_math.h. Compiled once per instruction set.
#if defined(DRAPE_CPU_FORMULAS_CONTACT_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_FORMULAS_CONTACT_MATH_INL_H_
#undef DRAPE_CPU_FORMULAS_CONTACT_MATH_INL_H_
#else
#define DRAPE_CPU_FORMULAS_CONTACT_MATH_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>

#include "server/scene/colliders.h"
#include "server/solver/cpu/formulas/constraint_math.h"
#include "server/solver/solver_constants.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

template <class Scalars>
using MaskOfScalars = decltype(Scalars() < Scalars());

// Signed distances from a collider [m], < 0 inside, and the outward normals there.
template <class Scalars, class Vectors>
struct Gaps {
  Scalars gap;
  Vectors normal;
};

// From the nearest point: d leads from there to the particle. The normal is `otherwise` where d has
// no direction.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> GapAlong(const Vectors& d, const Vectors& otherwise,
                                       const Scalars& offset) {
  const Scalars distance = Sqrt(Dot(d, d));
  const auto is_short = distance < SplatLike(kMinDirectionLength, offset);
  return {distance - offset, Select(is_short, otherwise, d / distance)};
}

// `offset` = radius + thickness. The centre pushes along +y.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> SphereGap(const Vectors& q, const Vectors& center,
                                        const Scalars& offset) {
  return GapAlong(q - center, VectorLike(0, 1, 0, q), offset);
}

// `offset` = thickness.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> PlaneGap(const Vectors& q, const Vectors& point,
                                       const Vectors& normal, const Scalars& offset) {
  return {Dot(q - point, normal) - offset, normal};
}

// `segment` from a to b; `offset` = radius + thickness; on the segment `axis_normal` pushes.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> CapsuleGap(const Vectors& q, const Vectors& a, const Vectors& segment,
                                         const Vectors& axis_normal, const Scalars& offset) {
  const Scalars zero = SplatLike(0, offset), one = SplatLike(1, offset);
  const Vectors from_a = q - a;
  const Scalars length_sq = Dot(segment, segment);
  const Scalars ratio = Dot(from_a, segment) / length_sq;
  const Scalars within = Select(ratio < zero, zero, Select(one < ratio, one, ratio));
  const auto is_point = length_sq < SplatLike(kMinDirectionLength * kMinDirectionLength, offset);
  const Scalars along = Select(is_point, zero, within);
  return GapAlong(from_a - along * segment, axis_normal, offset);
}

// `axes`: the box's unit axes; `offset` = thickness. Inside and above a face the normal is the axis
// of the nearest face (the first of equals), elsewhere it comes from the nearest point.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> BoxGap(const Vectors& q, const Vectors& center,
                                     const std::array<Scalars, 3>& half_extents,
                                     const std::array<Vectors, 3>& axes, const Scalars& offset) {
  using Mask = MaskOfScalars<Scalars>;
  const Scalars zero = SplatLike(0, offset), one = SplatLike(1, offset);
  const Vectors d = q - center;
  std::array<Scalars, 3> side, outside;
  Scalars face = zero, side_of_face = one;
  Vectors axis_of_face = axes[0];
  Mask is_beyond_one{}, is_beyond_two{};
  for (size_t k = 0; k < 3; ++k) {
    const Scalars local = Dot(d, axes[k]);
    side[k] = Select(local < zero, -one, one);
    const Scalars beyond = Abs(local) - half_extents[k];
    outside[k] = Max(zero, beyond);
    const Mask is_beyond = beyond > zero;
    is_beyond_two |= is_beyond_one & is_beyond;
    is_beyond_one |= is_beyond;
    const Mask is_nearer = k == 0 ? zero < one : beyond > face;
    face = Select(is_nearer, beyond, face);
    side_of_face = Select(is_nearer, side[k], side_of_face);
    axis_of_face = Select(is_nearer, axes[k], axis_of_face);
  }
  const Vectors normal = side_of_face * axis_of_face;
  if (!IsAnyLaneSet(is_beyond_two)) return {face - offset, normal};
  const Scalars distance =
      Sqrt((outside[0] * outside[0] + outside[1] * outside[1]) + outside[2] * outside[2]);
  const Vectors from_nearest =
      ((side[0] * outside[0]) * axes[0] + (side[1] * outside[1]) * axes[1]) +
      (side[2] * outside[2]) * axes[2];
  const Mask has_direction = distance >= SplatLike(kMinDirectionLength, offset);
  const Mask is_at_edge = is_beyond_two & has_direction;
  return {Select(is_at_edge, distance, face) - offset,
          Select(is_at_edge, from_nearest / distance, normal)};
}

// `axis`: unit, from `center`; on it `axis_normal` pushes; `offset` = radius + thickness. The
// normal is that of the side or the nearer end, whichever is nearest (of equals the side); beyond
// both it comes from the rim.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> CylinderGap(const Vectors& q, const Vectors& center,
                                          const Vectors& axis, const Vectors& axis_normal,
                                          const Scalars& radius, const Scalars& half_length,
                                          const Scalars& offset) {
  using Mask = MaskOfScalars<Scalars>;
  const Scalars zero = SplatLike(0, offset), one = SplatLike(1, offset);
  const Scalars shortest = SplatLike(kMinDirectionLength, offset);
  const Scalars thickness = offset - radius;
  const Vectors d = q - center;
  const Scalars along = Dot(d, axis);
  const Vectors across = d - along * axis;
  const Scalars from_axis = Sqrt(Dot(across, across));
  const Vectors sideways = Select(from_axis < shortest, axis_normal, across / from_axis);
  const Vectors endways = Select(along < zero, -one, one) * axis;
  const Scalars beyond_side = from_axis - radius;
  const Scalars beyond_end = Abs(along) - half_length;
  const Mask is_nearer_end = beyond_side < beyond_end;
  const Scalars face = Select(is_nearer_end, beyond_end, beyond_side);
  const Vectors normal = Select(is_nearer_end, endways, sideways);
  const Mask is_beyond_both = (beyond_side > zero) & (beyond_end > zero);
  if (!IsAnyLaneSet(is_beyond_both)) return {face - thickness, normal};
  const Scalars distance = Sqrt(beyond_side * beyond_side + beyond_end * beyond_end);
  const Mask has_direction = distance >= shortest;
  const Mask is_at_rim = is_beyond_both & has_direction;
  const Vectors from_rim = beyond_side * sideways + beyond_end * endways;
  return {Select(is_at_rim, distance, face) - thickness,
          Select(is_at_rim, from_rim / distance, normal)};
}

// Every shape but a distance map.
template <class Scalars, class Vectors>
inline Gaps<Scalars, Vectors> ShapeGap(ShapeKind kind, const Vectors& q, const Vectors& point,
                                       const Vectors& vector, const std::array<Vectors, 3>& axes,
                                       const Scalars& offset) {
  switch (kind) {
    case ShapeKind::kPlane:
      return PlaneGap(q, point, vector, offset);
    case ShapeKind::kCapsule:
      return CapsuleGap(q, point, vector, axes[0], offset);
    case ShapeKind::kBox:
      return BoxGap(q, point, Components(vector), axes, offset);
    case ShapeKind::kCylinder: {
      const auto [radius, half_length, unused] = Components(vector);
      return CylinderGap(q, point, axes[0], axes[1], radius, half_length, offset);
    }
    case ShapeKind::kSphere:
    case ShapeKind::kDistanceMap:  // elsewhere: DistanceMapGap
      break;
  }
  return SphereGap(q, point, offset);
}

// Lowest gap that a contact accepts at the end of the substep: what starts deep inside comes out at
// most at kMaxDepenetrationSpeed_m_per_s (floor = min(0, gap(p) + speed h)).
template <class Scalars>
inline Scalars ContactFloor(const Scalars& gap_at_start, float depenetration_distance) {
  return Min(gap_at_start + SplatLike(depenetration_distance, gap_at_start),
             SplatLike(0, gap_at_start));
}

// How large the components are: what is computed from them is rounded in proportion.
template <class Vectors>
inline auto SumOfSizes(const Vectors& v) {
  const auto [x, y, z] = Components(v);
  return (Abs(x) + Abs(y)) + Abs(z);
}

// What rounding of its position p may add to the errors of a particle's links [m]: 0 unless it
// touched the surface, its gap being within `touch_round_off`, and moved no faster than `slowest`
// along it. `v`: relative to the surface; all before the substep.
template <class Scalars, class Vectors>
inline Scalars QuietRoundOff(const Scalars& gap, const Scalars& touch_round_off, const Vectors& p,
                             const Vectors& v, const Scalars& slowest) {
  const auto is_away = (Abs(gap) > touch_round_off) | (Dot(v, v) > slowest * slowest);
  return Select(is_away, SplatLike(0, gap), SplatLike(kQuietRoundOff, gap) * SumOfSizes(p));
}

// By how much a predicted gap is off the floor [m]. `way`: of the particle relative to the surface
// during the substep, along the normal. What is left of the gap without it is where the particle
// was before. If that is within `round_off` the particle was on the surface, and the way is known
// with all its digits.
template <class Scalars>
inline Scalars ContactError(const Scalars& gap, const Scalars& way, const Scalars& round_off,
                            const Scalars& floor) {
  return Select(Abs(gap - way) > round_off, gap, way) - floor;
}

// New accumulated normal impulse times w of the inequality constraint C_contact >= 0 (Bender et al.
// 2009, section 4.3); the sum, not the single impulse, must not pull: max(beta - C/h, 0).
template <class Scalars>
inline Scalars ContactImpulse(const Scalars& beta_normal, const Scalars& error, float inverse_h) {
  return Max(SplatLike(0, error), beta_normal - error * inverse_h);
}

template <class Vectors>
inline Vectors Tangential(const Vectors& u, const Vectors& n) {
  return u - Dot(u, n) * n;
}

// New accumulated friction impulse times w: of `wanted` = beta_t - u_t, which stops the tangential
// velocity, what is within Coulomb's law (a velocity constraint in the sense of Bender et al. 2009,
// section 3.2; formula in server/solver/method.md): b = wanted, and if |b| > mu beta_n, b mu beta_n
// / |b|. `size` = |wanted|.
template <class Scalars, class Vectors>
inline Vectors FrictionImpulse(const Vectors& wanted, const Scalars& size,
                               const Scalars& beta_normal, const Scalars& friction) {
  const Scalars limit = friction * beta_normal;
  const auto slips = size > limit;
  if (!IsAnyLaneSet(slips)) return wanted;
  return Select(slips, (limit / size) * wanted, wanted);
}

// The coefficient of what slips as soon as the static one does not hold it.
template <class Scalars>
inline Scalars FrictionAtOnce(const Scalars& size, const Scalars& beta_normal,
                              const Scalars& friction_static, const Scalars& friction_dynamic) {
  return Select(size > friction_static * beta_normal, friction_dynamic, friction_static);
}

// How fast what has the dynamic friction has slid at least (kSlipSubsteps). `slowest`: SlowestSlip.
template <class Scalars>
inline Scalars SlipSpeed(const Scalars& friction_static, const Scalars& beta_normal,
                         const Scalars& slowest) {
  constexpr auto kSubsteps = static_cast<float>(kSlipSubsteps);
  constexpr auto kSpeed = static_cast<float>(kSlipSpeed_m_per_s);
  const Scalars stops = (SplatLike(kSubsteps, slowest) * friction_static);
  return Min(SplatLike(kSpeed, slowest), stops * Max(slowest, beta_normal));
}

// The normal impulse times w on which friction is judged with two steps: the whole one of the
// substep, of which the sweeps have made `beta_normal` so far. Nothing but `rebound` is left of the
// speed along the normal.
template <class Scalars>
inline Scalars WholeImpulse(const Scalars& beta_normal, const Scalars& rebound,
                            const Scalars& normal_speed) {
  return Max(SplatLike(0, beta_normal), beta_normal + (rebound - normal_speed));
}

// How fast a particle that hits is to leave [m/s]: `restitution` times the speed with which it
// reaches the surface from where it is before the substep; 0 where that is too slow, or where it
// approaches more slowly than gravity lets a free particle arrive so fast within the substep.
template <class Scalars, class Vectors>
inline Scalars ReboundSpeed(const Scalars& gap, const Vectors& normal, const Vectors& v,
                            const Vectors& gravity, const Scalars& restitution,
                            const Scalars& slowest) {
  const Scalars zero = SplatLike(0, gap);
  const Scalars approach = -Dot(v, normal);
  const Scalars gained = (SplatLike(-2, gap) * Dot(gravity, normal)) * Max(zero, gap);
  const Scalars arrival = Sqrt(Max(zero, approach * approach + gained));
  return Select(Min(arrival, approach + approach) > slowest, restitution * arrival, zero);
}

// Whether a particle hits, with two steps: it approaches faster than one that rests or slides
// could. `v`: relative to the surface before the substep.
template <class Scalars, class Vectors>
inline MaskOfScalars<Scalars> IsLanding(const Vectors& normal, const Vectors& v,
                                        const Scalars& slowest) {
  constexpr auto kSine = static_cast<float>(kGrazingSine);
  return -Dot(v, normal) - (slowest + SplatLike(kSine, slowest) * Sqrt(Dot(v, v))) >
         SplatLike(0, slowest);
}

// Position [m] and velocity [m/s].
template <class Vectors>
struct Flight {
  Vectors position, velocity;
};

// The state a substep of length h before, of a particle that has flown freely to p and v.
template <class Vectors>
inline Flight<Vectors> FlightBefore(const Vectors& p, const Vectors& v, const Vectors& gravity,
                                    float h) {
  const Vectors kick = gravity * h;
  return {p - (v - kick * 0.5f) * h, v - kick};
}

// Velocity after a contact that the particle does not leave faster than `rebound` [m/s], or with
// two steps (`is_exact`) at exactly that speed along the normal, because u has the speed at which
// the error of the substep was removed. Coulomb friction is judged on the whole impulse of the
// substep. But with one step v also contains `kick`, the half step of gravity that constraints will
// take away in the next substep; what stops that has friction of its own (a velocity constraint,
// Bender et al. 2009, section 3.2). `friction_of(|wanted|, impulse)`: the coefficient.
template <class Scalars, class Vectors, class FrictionOf>
inline Vectors VelocityAfterContact(const Vectors& v, const Vectors& n, const Vectors& kick,
                                    const Vectors& beta_tangent, const Scalars& beta_normal,
                                    const Scalars& rebound, bool is_exact,
                                    const FrictionOf& friction_of) {
  const Scalars zero = SplatLike(0, rebound);
  const Vectors tangential_kick = Tangential(kick, n);
  const Scalars change = rebound - Dot(v, n);
  const auto is_hit = is_exact ? rebound >= zero : change > zero;
  if (!IsAnyLaneSet(is_hit)) return v;
  const Scalars normal_kick = is_exact ? zero : Max(zero, Min(change, -Dot(kick, n)));
  const Vectors sliding = is_exact ? Tangential(v, n) : Tangential(v, n) - tangential_kick;
  const Scalars impulse = Max(zero, beta_normal + (change - normal_kick));
  const auto friction = [&](const Vectors& wanted, const Scalars& normal_impulse) {
    const Scalars size = Sqrt(Dot(wanted, wanted));
    return FrictionImpulse(wanted, size, normal_impulse, friction_of(size, normal_impulse));
  };
  const Vectors tangent = friction(beta_tangent - sliding, impulse);
  Vectors left = sliding + (tangent - beta_tangent);
  if (!is_exact) {
    left = left + tangential_kick;
    left = left + friction(VectorLike(0, 0, 0, v) - left, normal_kick);
  }
  return Select(is_hit, left + rebound * n, v);
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
