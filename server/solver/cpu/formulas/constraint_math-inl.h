// The formulas of constraints over any lanes; no state, no loops over particles. Scalars is one
// number of each lane: Vec4 or Vec8 (constraints of one cloth side by side), or VecCloths
// (one constraint of several cloths side by side); Vectors are the x, y and z of one vector of each
// lane. The same operations in the same order whatever the lanes are: a cloth has the same bits on
// either path. Symbols as in constraint_math.h. Compiled once per instruction set.
#if defined(DRAPE_CPU_FORMULAS_CONSTRAINT_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_FORMULAS_CONSTRAINT_MATH_INL_H_
#undef DRAPE_CPU_FORMULAS_CONSTRAINT_MATH_INL_H_
#else
#define DRAPE_CPU_FORMULAS_CONSTRAINT_MATH_INL_H_
#endif

#include <hwy/highway.h>

#include <array>

#include "server/solver/cpu/formulas/constraint_math.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {

// d / |d|; +x where d is too short to have a direction. `length` = |d|.
template <class Vectors, class Scalars>
inline Vectors Directions(const Vectors& d, const Scalars& length) {
  const auto is_short = length < SplatLike(kMinDirectionLength, length);
  const Scalars one = SplatLike(1, length);
  const Scalars inverse_length = one / Select(is_short, one, length);
  Scalars x = inverse_length * d.x, y = inverse_length * d.y, z = inverse_length * d.z;
  if (IsAnyLaneSet(is_short)) [[unlikely]] {
    const Scalars zero = SplatLike(0, length);
    x = Select(is_short, one, x);
    y = Select(is_short, zero, y);
    z = Select(is_short, zero, z);
  }
  return {x, y, z};
}

// Lines of impulses, and how much of a displacement along them changes the lengths
// (server/solver/method.md, "Direction").
template <class Vectors, class Scalars>
struct ImpulseLines {
  Vectors n;
  Scalars slope;  // n . n_end
};

// `start` are the differences of positions at the start of the substep [m].
template <class Vectors, class Scalars>
inline ImpulseLines<Vectors, Scalars> BlendDirections(const Vectors& start, const Vectors& n_end,
                                                      const Scalars& end_share) {
  const Scalars one = SplatLike(1, end_share);
  const Vectors n_start = Directions(start, Sqrt(Dot(start, start)));
  const auto turns_far =
      Dot(n_start, n_end) < SplatLike(static_cast<float>(kMinDirectionCosine), end_share);
  const Scalars share = Select(turns_far, one, end_share);
  const Vectors n = (one - share) * n_start + share * n_end;
  return {n, Dot(n, n_end)};
}

// The error of a link that does not pull what friction holds (server/solver/method.md,
// "Quiet links"): 0 where only rounding separates it from its length before the substep, plus what
// the substep changes, with all its digits. `start` and `end` are the differences of positions,
// `move` is what leads from one to the other, `length` = |end|, `round_off` that of |start|.
template <class Vectors, class Scalars>
inline Scalars QuietError(const Vectors& start, const Vectors& move, const Vectors& end,
                          const Scalars& length, const Scalars& rest_length,
                          const Scalars& round_off) {
  const Scalars before = Dot(start, start) - rest_length * rest_length;
  const Scalars limit = (rest_length + rest_length) * round_off;
  const Scalars left = before + Max(-limit, -Max(before, -limit));
  const Scalars divisor = Max(length + rest_length, SplatLike(kMinDirectionLength, length));
  return (left + Dot(start + end, move)) / divisor;  // 0 for the links of no length that fill lanes
}

// Impulse that removes the residual r = C + (alpha/h) Lambda within h (Bender et al. 2009,
// section 3.2; C_distance of section 4.3; the compliance is an extension, see
// server/solver/method.md): Delta Lambda = -r / h / (w_i + w_j + alpha/h^2). Negative pulls the
// particles together.
template <class Scalars>
inline Scalars DistanceImpulse(const Scalars& residual, float inverse_h,
                               const Scalars& inverse_mass_sum) {
  return -residual * inverse_h / inverse_mass_sum;
}

// Impulse that closes a point joint, along all axes at once, with the residual r = p_j - p_i +
// (alpha/h) Lambda and the sum w_i + w_j + alpha/h^2 (Bender et al. 2009, section 3.2, for the
// equality constraint p_j - p_i = 0).
template <class Vectors, class Scalars>
inline Vectors JointImpulse(const Vectors& residual, float inverse_h,
                            const Scalars& inverse_mass_sum) {
  return -residual * inverse_h / inverse_mass_sum;
}

// Impulse that takes the velocity along a link, n . (v_j - v_i) (Bender et al. 2009, section 3.2, a
// velocity constraint: no 1/h). Padding has no mass: none.
template <class Scalars>
inline Scalars VelocityImpulse(const Scalars& speed, const Scalars& inverse_mass_i,
                               const Scalars& inverse_mass_j) {
  const Scalars sum = inverse_mass_i + inverse_mass_j;
  const Scalars zero = SplatLike(0, speed), one = SplatLike(1, speed);
  return Select(sum > zero, -speed / Select(sum > zero, sum, one), zero);
}

// The part of an impulse that keeps the accumulated one within its bounds: inequality constraints
// push or pull, never both (Bender et al. 2009, section 3.2).
template <class Scalars>
inline Scalars ClampImpulse(const Scalars& lambda, const Scalars& impulse, const Scalars& min,
                            const Scalars& max) {
  return Min(Max(lambda + impulse, min), max) - lambda;
}

// Speed towards a pin that brings a particle back within reach by the end of the substep: (|d| -
// reach) / h. Only the particle moves: the pin's inverse mass is 0 (Bender et al. 2009,
// section 3.2, for the inequality reach - |d| >= 0).
template <class Scalars>
inline Scalars TetherSpeed(const Scalars& length, const Scalars& reach, float inverse_h) {
  return (length - reach) * inverse_h;
}

// a x b, lane by lane.
template <class Vectors>
inline Vectors Cross(const Vectors& a, const Vectors& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Acceleration of particle i, before the factor w_i, from one spring to j (Bender et al. 2009,
// section 4.1): [k (|d| - l0) + c (v_j - v_i).n] n with n = d/|d|, d = p_j - p_i. No direction: no
// force.
template <class Vectors>
inline Vectors SpringForce(const Vectors& d, const Vectors& velocity_difference, float rest_length,
                           float stiffness, float damping) {
  const auto length = Sqrt(Dot(d, d));
  const Vectors n = d / length;
  const auto force =
      (length - SplatLike(rest_length, length)) * stiffness + Dot(velocity_difference, n) * damping;
  return Select(length < SplatLike(kMinDirectionLength, length), VectorLike(0, 0, 0, d), force * n);
}

// Vectors of the second to fourth particle of elastic elements, less that of the first.
template <class Vectors>
struct ElementDifferences {
  Vectors a, b, c;
};

// L of elastic elements (equation 15 of server/solver/method.md), or the same sum of velocities.
template <class Vectors, class Weights>
inline Vectors WeightedSum(const ElementDifferences<Vectors>& d, const Weights& weights) {
  const auto& [w_a, w_b, w_c] = weights;
  return (w_a * d.a + w_b * d.b) + w_c * d.c;
}

// The impulse of a hinge that is flat at rest, along L (equation 16); it acts times the weights.
template <class Vectors, class Weights, class Scalars>
inline Vectors ImpulseOfFlatHinge(const Weights& weights, const Scalars& stiffness,
                                  const ElementDifferences<Vectors>& d, float duration) {
  return (-stiffness * duration) * WeightedSum(d, weights);
}

// Impulses of a hinge on its particles within `duration` [s] (equations 15a and 16a of
// server/solver/method.md): they add up to 0. `stiffness` [N/m], `d` the differences of positions
// [m].
template <class Vectors, class Weights, class Scalars>
inline std::array<Vectors, 4> HingeImpulses(const Weights& weights, const Scalars& rest_length,
                                            const Scalars& stiffness,
                                            const ElementDifferences<Vectors>& d, float duration) {
  const auto& [w_a, w_b, w_c] = weights;
  const auto splat = [&](double value) {
    return SplatLike(static_cast<float>(value), rest_length);
  };
  const Vectors across = w_b * d.b - w_c * d.c;
  const Vectors normal = Cross(d.a, across);
  const Scalars edge_sq = Dot(d.a, d.a);
  const Scalars blur_sq = splat(4 * kHingeBlurSq) * edge_sq * edge_sq + splat(kLeastHingeArea_m4);
  const Scalars inverse_sq = splat(1) / (Dot(normal, normal) + blur_sq);
  const Scalars rest = splat(kHingeNormalScale) * (rest_length * Sqrt(inverse_sq));
  const Vectors from_rest = WeightedSum(d, weights) - rest * normal;
  const Scalars slope = Dot(from_rest, normal) * inverse_sq;
  const Vectors turn = rest * (from_rest - slope * normal);
  const Scalars gain = stiffness * duration;
  const Vectors impulse = -gain * from_rest;
  const Vectors on_edge =
      gain * (Cross(across, turn) - (splat(8 * kHingeBlurSq) * rest * slope * edge_sq) * d.a);
  const Vectors on_sides = gain * Cross(turn, d.a);
  const Vectors a = w_a * impulse + on_edge;
  const Vectors b = w_b * (impulse + on_sides), c = w_c * (impulse - on_sides);
  return {splat(-1) * (a + b + c), a, b, c};
}

// r - r' for triangles: how the air changes their velocities within a kick (apply_wind in
// server/solver/method.md). r is the velocity of the air relative to the triangle [m/s], `normal`
// is perpendicular to it and twice its area long [m^2]; drag and lift are duration * density of the
// air * coefficient / (4 * mass of the triangle) [s/m / m^2].
template <class Vectors, class Scalars>
inline Vectors AirVelocityChange(const Vectors& r, const Vectors& normal, const Scalars& drag,
                                 const Scalars& lift) {
  const Scalars zero = SplatLike(0, drag), one = SplatLike(1, drag);
  const Scalars twice_area = Sqrt(Dot(normal, normal));
  const Scalars speed = Sqrt(Dot(r, r));
  const auto has_force = (twice_area > zero) & (speed > zero);
  const Scalars area_divisor = Select(has_force, twice_area, one);
  const Vectors n{normal.x / area_divisor, normal.y / area_divisor, normal.z / area_divisor};
  const Scalars approach = Dot(r, n);
  const Scalars cosine = Min(Abs(approach) / Select(has_force, speed, one), one);
  const Scalars sine_sq = one - cosine * cosine;

  const Scalars max_ratio = SplatLike(static_cast<float>(kMaxAirRatio), drag);
  const Scalars drag_ratio = Min(drag * (twice_area * Abs(approach)), max_ratio);
  const Scalars lift_ratio = Min(lift * (twice_area * speed), max_ratio);
  const Scalars turn = lift_ratio * cosine / (one + lift_ratio * sine_sq);
  const Scalars turn_sq = turn * turn * sine_sq;
  const Scalars root = Sqrt(one + turn_sq);
  // r - r' without the difference of nearly equal numbers.
  const Scalars keep = one / (one + drag_ratio);
  const Scalars shrink = keep * (drag_ratio + turn_sq / (root * (one + root)));
  const Scalars along_n = keep * turn / root * Select(approach < zero, -speed, speed);
  const Scalars along_r = shrink - keep * turn / root * cosine;
  return {Select(has_force, along_r * r.x + along_n * n.x, zero),
          Select(has_force, along_r * r.y + along_n * n.y, zero),
          Select(has_force, along_r * r.z + along_n * n.z, zero)};
}

}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
