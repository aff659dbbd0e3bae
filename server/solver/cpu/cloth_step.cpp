#include "server/solver/cpu/cloth_step.h"

#include <cmath>

#include "server/solver/cpu/constraint_math-inl.h"
#include "server/solver/cpu/constraint_math.h"
#include "server/solver/cpu/contacts.h"
#include "server/solver/cpu/elastic.h"
#include "server/solver/cpu/joints.h"
#include "server/solver/cpu/measure.h"
#include "server/solver/cpu/strips.h"
#include "server/solver/cpu/twist.h"
#include "server/solver/cpu/wind.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// A_i(p, v) by the springs of particle i.
Lanes SpringAcceleration(const FloatModel& model, const Lanes* p, const Lanes* v, uint32_t i) {
  Lanes force{};
  for (uint32_t e = model.spring_offsets[i]; e < model.spring_offsets[i + 1]; ++e) {
    const FloatSpringEnd& end = model.spring_ends[e];
    const uint32_t j = end.other_particle;
    force += SpringForce(p[i], p[j], v[i], v[j], end.rest_length, end.stiffness, end.damping);
  }
  return model.inverse_masses[i] * force;
}

void ApplySprings(const StepContext& context, const Lanes* positions, float duration) {
  const FloatModel& model = context.model;
  StepScratch& scratch = context.scratch;
  Lanes* const v = scratch.state.velocities.data();
  for (const uint32_t i : model.free_particles) {
    scratch.accelerations[i] = SpringAcceleration(model, positions, v, i);
  }
  for (const uint32_t i : model.free_particles) v[i] += duration * scratch.accelerations[i];
}

// What acts on the velocities for some time, from the same positions and velocities.
void Kick(const StepContext& context, const std::vector<Lanes>& positions, float duration) {
  if (duration == 0) return;
  if (context.controls.has_half_kicks) ApplySprings(context, positions.data(), duration);
  if (context.model.has_elastic()) ApplyElastic(context, positions.data(), duration);
  if (context.controls.has_air_forces) ApplyWind(context, positions.data(), duration);
}

// The same on the predicted velocities u, from the predicted positions b + H u.
void KickWithin(const StepContext& context) {
  const FloatControls& controls = context.controls;
  if (!controls.has_half_kicks && !controls.has_air_forces && !context.model.has_elastic()) return;
  StepScratch& scratch = context.scratch;
  for (size_t i = 0; i < scratch.predicted.size(); ++i) {
    scratch.predicted[i] =
        scratch.state.positions[i] + context.substep.interval * scratch.state.velocities[i];
  }
  Kick(context, scratch.predicted, context.substep.kick_within);
}

void PredictPins(const StepContext& context) {
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    const uint32_t i = context.model.pins[k];
    const Lanes way = (context.pin_targets[k] - state.positions[i]) / substep.pin_shares;
    state.velocities[i] = way * substep.inverse_duration;
    state.positions[i] += way * substep.pin_lead;
  }
}

// Bender et al. 2009, section 3.1, eq. 2: the velocities become u = v + a H/2.
void PredictBallistic(const StepContext& context) {
  const FloatModel& model = context.model;
  const FloatControls& controls = context.controls;
  StepScratch& scratch = context.scratch;
  Lanes* const v = scratch.state.velocities.data();
  const float half = context.substep.half_interval;
  if (controls.has_spring_forces) {
    const Lanes* const p = scratch.state.positions.data();
    for (const uint32_t i : model.free_particles) {
      scratch.accelerations[i] = controls.gravity + SpringAcceleration(model, p, v, i);
    }
    for (const uint32_t i : model.free_particles) v[i] += scratch.accelerations[i] * half;
  } else {
    const Lanes kick = controls.gravity * half;
    for (const uint32_t i : model.free_particles) v[i] += kick;
  }
}

// The backward differentiation formula of second order: the positions become b = p + (p - p')/3,
// the velocities u = (v + (v - v')/3 + H g) / (1 + c H).
void PredictTwoStep(const StepContext& context) {
  constexpr float kThird = 1.0f / 3;
  const FloatSubstep& substep = context.substep;
  StepScratch& scratch = context.scratch;
  const Lanes kick = context.controls.gravity * substep.interval;
  for (const uint32_t i : context.model.free_particles) {
    Lanes& p = scratch.state.positions[i];
    Lanes& v = scratch.state.velocities[i];
    Lanes& previous_p = scratch.previous.positions[i];
    Lanes& previous_v = scratch.previous.velocities[i];
    const Lanes base = p + (p - previous_p) * kThird;
    const Lanes mean = ((v + (v - previous_v) * kThird) + kick) * substep.damping_factor;
    previous_p = substep.sets_previous ? p : previous_p;
    previous_v = substep.sets_previous ? v : previous_v;
    p = base;
    v = mean;
  }
}

void Predict(const StepContext& context) {
  if (context.substep.is_two_step) {
    PredictTwoStep(context);
  } else {
    PredictContacts(context);
    PredictBallistic(context);
  }
  PredictPins(context);
  if (context.substep.is_two_step) KickWithin(context);
  const FloatModel& model = context.model;
  const bool has_impulses = model.has_compliance() || model.has_inequalities();
  context.scratch.distance_impulses.assign(has_impulses ? model.groups.size() + 1 : 0, Lanes{});
  context.scratch.joint_impulses.assign(model.joints.size(), Lanes{});
}

// Four tethers along the start of the substep: `speeds` [m/s] are to be taken off their lengths,
// `n_end` are the directions at its end.
void PullAlongStarts(const StepContext& context, const TetherGroup& group, const LaneVectors& n_end,
                     Lanes speeds) {
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes start[kLaneCount];
  for (uint32_t k = 0; k < kLaneCount; ++k) start[k] = p[group.particle[k]] - p[group.pin[k]];
  const auto lines = BlendDirections(Transpose(start[0], start[1], start[2], start[3]), n_end,
                                     Splat(context.controls.end_share));
  const auto n = Transpose(lines.n);
  const Lanes scale = speeds / lines.slope;
  Lanes* const u = context.scratch.state.velocities.data();
  for (uint32_t k = 0; k < kLaneCount; ++k) u[group.particle[k]] -= scale[k] * n[k];
}

// No particle ends the substep farther from a pin than the cloth between them is long
// (scene/tethers.h).
void ApplyTethers(const StepContext& context) {
  const float h = context.substep.interval;
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const u = context.scratch.state.velocities.data();
  for (const TetherGroup& group : context.model.tethers) {
    Lanes d[kLaneCount];
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      const uint32_t i = group.particle[k], pin = group.pin[k];
      d[k] = PredictedDifference(p[pin], p[i], u[pin], u[i], h);
    }
    const LaneVectors t = Transpose(d[0], d[1], d[2], d[3]);
    const Lanes length_sq = (t.x * t.x + t.y * t.y) + t.z * t.z;
    const LaneMask is_taut = length_sq > group.length * group.length;
    if (!IsAnyLaneSet(is_taut)) continue;
    const Lanes length = Sqrt(length_sq);
    const Lanes speed = TetherSpeed(length, group.length, context.substep.inverse_interval);
    if (context.controls.has_start_directions()) {
      PullAlongStarts(context, group, Directions(t, length), is_taut ? speed : Lanes{});
      continue;
    }
    const Lanes speed_per_length = is_taut ? speed / length : Lanes{};
    for (uint32_t k = 0; k < kLaneCount; ++k) u[group.particle[k]] -= speed_per_length[k] * d[k];
  }
}

// For particles without distance: the impulse acts along +x.
void ReplaceShortDirections(Lanes (&differences)[kLaneCount], Lanes& lengths) {
  for (uint32_t k = 0; k < kLaneCount; ++k) {
    if (!(lengths[k] < kMinDirectionLength)) continue;
    differences[k] = Lanes{1, 0, 0, 0};
    lengths[k] = 1;
  }
}

// The lines of the impulses of four constraints whose predicted differences are `end`.
ImpulseLines<LaneVectors, Lanes> LinesOf(const StepContext& context, const DistanceGroup& group,
                                         const LaneVectors& end, Lanes length) {
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes start[kLaneCount];
  for (uint32_t k = 0; k < kLaneCount; ++k) start[k] = p[group.j[k]] - p[group.i[k]];
  return BlendDirections(Transpose(start[0], start[1], start[2], start[3]), Directions(end, length),
                         Splat(context.controls.end_share));
}

// One sweep over all colours, four constraints of a colour at once (Bender et al. 2009, section 3.2
// and 3.3). Returns whether an error was larger than the tolerance.
template <bool kHasCompliance, bool kHasInequalities, bool kHasOwnLengths, bool kHasStarts>
bool SweepDistances(const StepContext& context) {
  const float h = context.substep.interval;
  const float inverse_h = context.substep.inverse_interval;
  const float tolerance = context.controls.tolerance;
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const u = context.scratch.state.velocities.data();
  LaneMask changed{};
  size_t g = 0;
  for (const DistanceGroup& group : context.model.groups) {
    Lanes d[kLaneCount];
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      const uint32_t i = group.i[k], j = group.j[k];
      d[k] = PredictedDifference(p[i], p[j], u[i], u[j], h);
    }
    const LaneVectors t = Transpose(d[0], d[1], d[2], d[3]);
    const Lanes length = Sqrt((t.x * t.x + t.y * t.y) + t.z * t.z);
    Lanes divisor = length;
    if (IsAnyLaneSet(length < kMinDirectionLength)) [[unlikely]]
      ReplaceShortDirections(d, divisor);

    const Lanes rest_length = kHasOwnLengths ? context.scratch.rest_lengths[g] : group.rest_length;
    Lanes residual = length - rest_length;
    Lanes weight = group.inverse_mass_i + group.inverse_mass_j;
    if constexpr (kHasStarts) {
      const auto lines = LinesOf(context, group, t, length);
      weight *= lines.slope;
      const auto n = Transpose(lines.n);
      std::copy(n.begin(), n.end(), d);
      divisor = Splat(1);
    }
    if constexpr (kHasCompliance) {
      const Lanes alpha_over_h = context.model.compliances[g] * inverse_h;
      residual += alpha_over_h * context.scratch.distance_impulses[g];
      weight += alpha_over_h * inverse_h;
    }
    LaneMask is_active = Abs(residual) > tolerance * rest_length;
    Lanes impulse = is_active ? DistanceImpulse(residual, inverse_h, weight) : Lanes{};
    if constexpr (kHasInequalities) {
      const ImpulseBounds& bounds = context.model.bounds[g];
      impulse = ClampImpulse(context.scratch.distance_impulses[g], impulse, bounds.min, bounds.max);
      is_active &= impulse != 0;
    }
    if constexpr (kHasCompliance || kHasInequalities) {
      context.scratch.distance_impulses[g] += impulse;
    }
    const Lanes impulse_per_length = impulse / divisor;
    const Lanes scale_i = group.inverse_mass_i * impulse_per_length;
    const Lanes scale_j = group.inverse_mass_j * impulse_per_length;
#pragma GCC unroll 4  // constant lanes: shuffles instead of loads
    for (uint32_t k = 0; k < kLaneCount; ++k) {
      u[group.i[k]] -= scale_i[k] * d[k];
      u[group.j[k]] += scale_j[k] * d[k];
    }
    changed |= is_active;
    ++g;
  }
  return IsAnyLaneSet(changed);
}

// SweepDistances with the flags that the cloth needs.
template <bool... kFlags>
bool ChooseSweep(const StepContext& context) {
  if constexpr (sizeof...(kFlags) == 4) {
    return SweepDistances<kFlags...>(context);
  } else {
    const bool flags[] = {context.model.has_compliance(), context.model.has_inequalities(),
                          context.own_lengths != nullptr, context.controls.has_start_directions()};
    return flags[sizeof...(kFlags)] ? ChooseSweep<kFlags..., true>(context)
                                    : ChooseSweep<kFlags..., false>(context);
  }
}

bool SolveDistance(const StepContext& context) {
  return ChooseSweep<>(context);
}

// The impulse that removes the error of a rigid link, along its direction at the end of the
// substep.
void SolveLink(const StepContext& context, uint32_t place) {
  const DistanceGroup& group = context.model.groups[place / kLaneCount];
  const uint32_t lane = place % kLaneCount;
  const uint32_t i = group.i[lane], j = group.j[lane];
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const u = context.scratch.state.velocities.data();
  Lanes d = PredictedDifference(p[i], p[j], u[i], u[j], context.substep.interval);
  const float length = Length(d);
  float divisor = length;
  if (length < kMinDirectionLength) [[unlikely]] {
    d = Lanes{1, 0, 0, 0};
    divisor = 1;
  }
  const float weight = group.inverse_mass_i[lane] + group.inverse_mass_j[lane];
  const float impulse =
      DistanceImpulse(length - group.rest_length[lane], context.substep.inverse_interval, weight);
  const float impulse_per_length = impulse / divisor;
  u[i] -= (group.inverse_mass_i[lane] * impulse_per_length) * d;
  u[j] += (group.inverse_mass_j[lane] * impulse_per_length) * d;
}

// Links that strips have left far off, and those at their ends, one by one. The strips of the last
// phase have just been solved.
void Refine(const StepContext& context) {
  const StripSet& strips = context.model.source->strips();
  const RefineLimits& limits = context.controls.refine_limits;
  const Lanes* const p = context.scratch.state.positions.data();
  const Lanes* const u = context.scratch.state.velocities.data();
  Refinement& refinement = context.scratch.refinement;
  refinement.Begin(context.model.particle_count);
  const uint32_t strip_count = strips.phase_offsets[strips.phase_count() - 1];
  for (uint32_t s = 0; s < strip_count; ++s) {
    uint32_t from = strips.particles[strips.strip_offsets[s] + s];
    Lanes start = p[from] + context.substep.interval * u[from];
    for (uint32_t k = strips.strip_offsets[s]; k < strips.strip_offsets[s + 1]; ++k) {
      const uint32_t to = strips.particles[k + s + 1];
      const Lanes end = p[to] + context.substep.interval * u[to];
      const Lanes d = end - start;
      const float length_sq = Dot(d, d);
      const float rest_length_sq = context.model.strip_lengths_sq[k];
      if (length_sq < limits.min_sq * rest_length_sq ||
          length_sq > limits.max_sq * rest_length_sq) {
        refinement.Mark(from, to, 1);
      }
      from = to;
      start = end;
    }
  }
  const std::span<const RefinedLink> links = refinement.TakeLinks(context.model);
  for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
    for (const RefinedLink& link : links) SolveLink(context, link.place);
  }
}

// Bender et al. 2009, section 3.1, eq. 1: p = b + H u; the velocities become v = u + a H/2, with
// two steps they are u.
void Integrate(const StepContext& context) {
  const FloatControls& controls = context.controls;
  const FloatSubstep& substep = context.substep;
  FloatState& state = context.scratch.state;
  const Lanes kick = controls.gravity * substep.half_interval;
  for (const uint32_t i : context.model.free_particles) {
    state.positions[i] += substep.interval * state.velocities[i];
    if (substep.is_two_step) continue;
    state.velocities[i] += controls.has_spring_forces
                               ? context.scratch.accelerations[i] * substep.half_interval
                               : kick;
  }
  for (size_t k = 0; k < context.model.pins.size(); ++k) {
    const uint32_t i = context.model.pins[k];
    // At the end of the step a pin is where it was asked to be, to the bit.
    state.positions[i] = substep.pin_shares == 1
                             ? context.pin_targets[k]
                             : state.positions[i] + substep.interval * state.velocities[i];
  }
}

// No velocity along rigid links is left (Bender et al. 2009, section 3.2).
void SolveVelocity(const StepContext& context) {
  const FloatModel& model = context.model;
  const Lanes* const p = context.scratch.state.positions.data();
  Lanes* const v = context.scratch.state.velocities.data();
  for (uint32_t sweep = 0; sweep < context.controls.solver.velocity_iterations; ++sweep) {
    for (size_t g = 0; g < model.groups.size(); ++g) {
      const DistanceGroup& group = model.groups[g];
      Lanes d[kLaneCount], difference[kLaneCount];
      for (uint32_t k = 0; k < kLaneCount; ++k) {
        d[k] = p[group.j[k]] - p[group.i[k]];
        difference[k] = v[group.j[k]] - v[group.i[k]];
      }
      const LaneVectors t = Transpose(d[0], d[1], d[2], d[3]);
      const LaneVectors n = Directions(t, Sqrt(Dot(t, t)));
      const LaneVectors approach =
          Transpose(difference[0], difference[1], difference[2], difference[3]);
      const Lanes impulse = Select(
          model.RigidLanes(g),
          VelocityImpulse(Dot(n, approach), group.inverse_mass_i, group.inverse_mass_j), Lanes{});
      const auto line = Transpose(n);
      const Lanes scale_i = group.inverse_mass_i * impulse;
      const Lanes scale_j = group.inverse_mass_j * impulse;
      for (uint32_t k = 0; k < kLaneCount; ++k) {
        v[group.i[k]] -= scale_i[k] * line[k];
        v[group.j[k]] += scale_j[k] * line[k];
      }
    }
    SolveJointVelocities(context);
  }
}

// Sweeps until none finds an error, at most max_iterations.
void Solve(const StepContext& context, StepReport& report) {
  const FloatControls& controls = context.controls;
  for (uint32_t iteration = 0; iteration < context.max_iterations; ++iteration) {
    ++report.iterations;
    // All always run: a contact can break what the distances have just met.
    bool has_changed = controls.solver.has_strips && SolveStrips(context);
    if (controls.has_refinement()) Refine(context);
    if (controls.solver.has_colours) has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveContacts(context);
    if (controls.tolerance > 0 && !has_changed) return;
  }
  if (controls.tolerance > 0) report.converged = false;
}

// Of positions and velocities. A zero has no sign: which one it got depends on what padding added
// to it, and so on the path.
void DropSignsOfZeros(FloatState& state) {
  for (Lanes& p : state.positions) p += Lanes{};
  for (Lanes& v : state.velocities) v += Lanes{};
}

FaultReason FindFault(const FloatState& state) {
  bool is_runaway = false;
  for (size_t i = 0; i < state.positions.size(); ++i) {
    const Lanes p = state.positions[i], v = state.velocities[i];
    for (uint32_t axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(p[axis]) || !std::isfinite(v[axis])) return FaultReason::kNotFinite;
      is_runaway |= std::fabs(p[axis]) > static_cast<float>(kMaxCoordinate_m);
    }
    is_runaway |= Length(v) > static_cast<float>(kMaxSpeed_m_per_s);
  }
  return is_runaway ? FaultReason::kRunaway : FaultReason::kNone;
}

// The new state replaces the old one unless it has blown up.
void Commit(const StepContext& context, FloatState& state, StepReport& report) {
  DropSignsOfZeros(context.scratch.state);
  report.fault = FindFault(context.scratch.state);
  if (report.fault == FaultReason::kNone) std::swap(state, context.scratch.state);
}

void Begin(const StepContext& context, const FloatState& state) {
  StepScratch& scratch = context.scratch;
  scratch.state = state;
  const bool has_two_steps = context.controls.schedule.has_two_steps();
  scratch.predicted.resize(has_two_steps ? state.positions.size() : 0);
  scratch.strip_links.resize(context.model.longest_strip);
  const bool has_starts = context.controls.has_start_directions();
  scratch.end_directions.resize(has_starts ? context.model.longest_strip : 0);
  scratch.accelerations.resize(context.model.has_springs() ? context.model.particle_count : 0);
  scratch.elastic_impulses.resize(context.model.elastic_groups.size() * kLaneCount);
  if (context.controls.has_air_forces) {
    scratch.air_impulses.resize(context.model.triangles.size() * kLaneCount);
  }
  scratch.contacts.resize(context.model.particle_count * context.controls.colliders.size());
}

}  // namespace

FloatSubstep::FloatSubstep(const Substep& substep, double damping_per_s)
    : interval(static_cast<float>(substep.interval_s)),
      half_interval(0.5f * interval),
      inverse_interval(static_cast<float>(1 / substep.interval_s)),
      is_two_step(substep.is_two_step),
      sets_previous(substep.sets_previous),
      pin_shares(static_cast<float>(substep.pin_shares)),
      inverse_duration(static_cast<float>(1 / substep.duration_s)),
      pin_lead(static_cast<float>(1 - substep.interval_s / substep.duration_s)),
      kick_before(static_cast<float>(substep.kick_before_s)),
      kick_after(static_cast<float>(substep.kick_after_s)),
      kick_within(static_cast<float>(substep.kick_within_s)),
      twist_share(static_cast<float>(substep.twist_share)),
      damping_factor(static_cast<float>(substep.is_two_step
                                            ? 1 / (1 + damping_per_s * substep.interval_s)
                                            : std::exp(-damping_per_s * substep.interval_s))) {}

void Finish(const StepContext& context, bool measure, FloatState& state, StepReport& report) {
  report.warnings.not_converged = !report.converged;
  Commit(context, state, report);
  if (report.fault != FaultReason::kNone) PlaceColliders(context, 0, 0);
  if (measure) report.measured = Measure(context, state, report.fault);
}

StepReport StepCloth(StepContext context, bool measure, FloatState& state) {
  const FloatControls& controls = context.controls;
  const std::vector<Lanes>& positions = context.scratch.state.positions;
  StepReport report;
  report.warnings = controls.warnings;
  Begin(context, state);
  for (uint32_t index = 0; index < controls.schedule.size(); ++index) {
    const Substep substep = controls.schedule[index];
    context.substep = FloatSubstep(substep, controls.damping_per_s);
    // Colliders are met by substeps of equal length only.
    PlaceColliders(context, index * substep.duration_s, (index + 1) * substep.duration_s);
    // Before the kick, which is part of what two steps continue.
    if (index == 0 && context.substep.sets_previous) {
      context.scratch.previous = context.scratch.state;
    }
    Kick(context, positions, context.substep.kick_before);
    Predict(context);
    if (context.own_lengths != nullptr) AdvanceLengths(context);
    if (context.substep.twist_share > 0) DampTwist(context);
    if (controls.use_tethers && context.own_lengths == nullptr) ApplyTethers(context);
    Solve(context, report);
    Integrate(context);
    SolveVelocity(context);
    CorrectVelocity(context);
    Kick(context, positions, context.substep.kick_after);
  }
  Finish(context, measure, state, report);
  return report;
}

}  // namespace drape::cpu
