#include "server/solver/cpu/alone/distances.h"

#include <algorithm>
#include <span>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// The inverse masses of the ends of four constraints.
struct EndMasses {
  EndMasses(const StepContext& context, const DistanceGroup& group)
      : i(group.inverse_mass_i), j(group.inverse_mass_j) {
    if (!context.held.has_grips) return;
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      if (group.i[k] == context.model.spare_particle()) break;  // padding is behind
      i[k] = context.held.inverse_masses[group.i[k]];
      j[k] = context.held.inverse_masses[group.j[k]];
    }
  }
  // Set for those of which something is free.
  Mask4 AreLoose() const { return i + j > 0; }

  Vec4 i, j;
};

// For particles without distance: the impulse acts along +x.
void ReplaceShortDirections(Vec4 (&differences)[kVec4Size], Vec4& lengths) {
  for (uint32_t k = 0; k < kVec4Size; ++k) {
    if (!(lengths[k] < kMinDirectionLength)) continue;
    differences[k] = Vec4{1, 0, 0, 0};
    lengths[k] = 1;
  }
}

// The lines of the impulses of four constraints whose predicted differences are `end`.
ImpulseLines<Vectors4, Vec4> LinesOf(const StepContext& context, const DistanceGroup& group,
                                     const Vectors4& end, Vec4 length) {
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4 start[kVec4Size];
  for (uint32_t k = 0; k < kVec4Size; ++k) start[k] = p[group.j[k]] - p[group.i[k]];
  return BlendDirections(Transpose(start[0], start[1], start[2], start[3]), Directions(end, length),
                         Splat(context.controls.end_share));
}

// The impulses of group g on those of its particles that are held: `impulses` along `lines`.
void PullHeld(const StepContext& context, size_t g, Vec4 impulses,
              std::span<const Vec4, kVec4Size> lines) {
  ImpulseSums* const sums = context.impulses();
  if (sums == nullptr) return;
  const DistanceGroup& group = context.model.groups[g];
  for (uint32_t k = 0; k < kVec4Size; ++k) {
    const Vec4 impulse = impulses[k] * lines[k];
    if (!context.held.IsFree(group.i[k])) sums->PullAtConstraint(g * kVec4Size + k, 0, -impulse);
    if (!context.held.IsFree(group.j[k])) sums->PullAtConstraint(g * kVec4Size + k, 1, impulse);
  }
}

// Groups [begin, end) of a colour, four constraints at once (Bender et al. 2009, section 3.2 and
// 3.3). Returns whether an error was larger than the tolerance.
template <bool kHasCompliance, bool kHasInequalities, bool kHasOwnLengths, bool kHasStarts>
bool SweepDistances(const StepContext& context, size_t begin, size_t end) {
  const float h = context.substep.interval;
  const float inverse_h = context.substep.inverse_interval;
  const float tolerance = context.controls.tolerance;
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4* const u = context.scratch.state.velocities.data();
  Mask4 changed{};
  for (size_t g = begin; g < end; ++g) {
    const DistanceGroup& group = context.model.groups[g];
    Vec4 d[kVec4Size];
#pragma GCC unroll 4  // so that they stay in registers
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const uint32_t i = group.i[k], j = group.j[k];
      d[k] = PredictedDifference(p[i], p[j], u[i], u[j], h);
    }
    const Vectors4 t = Transpose(d[0], d[1], d[2], d[3]);
    const Vec4 length = Sqrt((t.x * t.x + t.y * t.y) + t.z * t.z);
    Vec4 divisor = length;
    if (IsAnyLaneSet(length < kMinDirectionLength)) [[unlikely]]
      ReplaceShortDirections(d, divisor);

    const Vec4 rest_length = kHasOwnLengths ? context.scratch.rest_lengths[g] : group.rest_length;
    Vec4 residual = length - rest_length;
    const EndMasses masses(context, group);
    Vec4 weight = masses.i + masses.j;
    if constexpr (kHasStarts) {
      const auto lines = LinesOf(context, group, t, length);
      weight *= lines.slope;
      const auto n = Transpose(lines.n);
      std::copy(n.begin(), n.end(), d);
      divisor = Splat(1);
    }
    if constexpr (kHasCompliance) {
      const Vec4 alpha_over_h = context.model.compliances[g] * inverse_h;
      residual += alpha_over_h * context.scratch.distance_impulses[g];
      weight += alpha_over_h * inverse_h;
    }
    Mask4 is_active = (Abs(residual) > tolerance * rest_length) & masses.AreLoose();
    Vec4 impulse = is_active ? DistanceImpulse(residual, inverse_h, weight) : Vec4{};
    if constexpr (kHasInequalities) {
      const ImpulseBounds& bounds = context.model.bounds[g];
      impulse = ClampImpulse(context.scratch.distance_impulses[g], impulse, bounds.min, bounds.max);
      is_active &= impulse != 0;
    }
    if constexpr (kHasCompliance || kHasInequalities) {
      context.scratch.distance_impulses[g] += impulse;
    }
    const Vec4 impulse_per_length = impulse / divisor;
    const Vec4 scale_i = masses.i * impulse_per_length;
    const Vec4 scale_j = masses.j * impulse_per_length;
#pragma GCC unroll 4  // constant lanes: shuffles instead of loads
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      u[group.i[k]] -= scale_i[k] * d[k];
      u[group.j[k]] += scale_j[k] * d[k];
    }
    PullHeld(context, g, impulse_per_length, d);
    changed |= is_active;
  }
  return IsAnyLaneSet(changed);
}

// Colour by colour: sweep(context, begin, end) of its groups.
template <class Sweep>
bool AnyColour(const StepContext& context, const Sweep& sweep) {
  const std::vector<uint32_t>& offsets = context.model.colour_offsets;
  bool has_changed = false;
  for (size_t colour = 0; colour + 1 < offsets.size(); ++colour) {
    has_changed |= context.team.AnyOf(
        offsets[colour], offsets[colour + 1], kGroupGrain,
        [&](size_t begin, size_t end, uint32_t) { return sweep(context, begin, end); });
  }
  return has_changed;
}

// One sweep with the flags that the cloth needs.
template <bool... kFlags>
bool ChooseSweep(const StepContext& context) {
  if constexpr (sizeof...(kFlags) == 4) {
    return AnyColour(context, SweepDistances<kFlags...>);
  } else {
    const bool flags[] = {context.model.has_compliance(), context.model.has_inequalities(),
                          context.own_lengths != nullptr, context.controls.has_start_directions()};
    return flags[sizeof...(kFlags)] ? ChooseSweep<kFlags..., true>(context)
                                    : ChooseSweep<kFlags..., false>(context);
  }
}

// Groups [begin, end) of a colour.
void SweepVelocities(const StepContext& context, size_t begin, size_t end) {
  const FloatModel& model = context.model;
  const Vec4* const p = context.scratch.state.positions.data();
  Vec4* const v = context.scratch.state.velocities.data();
  for (size_t g = begin; g < end; ++g) {
    const DistanceGroup& group = model.groups[g];
    Vec4 d[kVec4Size], difference[kVec4Size];
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      d[k] = p[group.j[k]] - p[group.i[k]];
      difference[k] = v[group.j[k]] - v[group.i[k]];
    }
    const Vectors4 t = Transpose(d[0], d[1], d[2], d[3]);
    const Vectors4 n = Directions(t, Sqrt(Dot(t, t)));
    const Vectors4 approach = Transpose(difference[0], difference[1], difference[2], difference[3]);
    const EndMasses masses(context, group);
    const Vec4 impulse =
        Select(model.RigidLanes(g), VelocityImpulse(Dot(n, approach), masses.i, masses.j), Vec4{});
    const auto line = Transpose(n);
    const Vec4 scale_i = masses.i * impulse;
    const Vec4 scale_j = masses.j * impulse;
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      v[group.i[k]] -= scale_i[k] * line[k];
      v[group.j[k]] += scale_j[k] * line[k];
    }
    PullHeld(context, g, impulse, line);
  }
}

}  // namespace

bool SolveDistance(const StepContext& context) {
  return ChooseSweep<>(context);
}

void SolveDistanceVelocities(const StepContext& context) {
  AnyColour(context, [](const StepContext& same, size_t begin, size_t end) {
    SweepVelocities(same, begin, end);
    return false;
  });
}

}  // namespace drape::cpu
