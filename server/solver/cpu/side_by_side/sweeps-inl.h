// The sweeps of a substep for a group of cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_SWEEPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_SWEEPS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_SWEEPS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_SWEEPS_INL_H_
#endif

#include <array>
#include <vector>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/contacts-inl.h"
#include "server/solver/cpu/side_by_side/path_pairs-inl.h"
#include "server/solver/cpu/side_by_side/refine-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/step/strip_solve-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// The open stages of the particles that pair k of the strips is the first to have.
template <bool kHasOwnPins>
HWY_NOINLINE void VisitPair(const FloatModel& model, const ParticleVisit<kHasOwnPins>& visit,
                            size_t k) {
  for (uint32_t n = model.pair_particle_offsets[k]; n < model.pair_particle_offsets[k + 1]; ++n) {
    visit(model.pair_particles[n]);
  }
}

// Two strips of each cloth: what strip_solve-inl.h sweeps over. `kHasOwnPins`: the inverse masses
// are of each cloth.
template <bool kHasOwnPins, bool kAsksForImpulses>
class StripPairs : public PathPairs {
 public:
  static constexpr bool kAsks = kAsksForImpulses;
  using Mask = MaskPair;
  using Link = PairLink;
  using Group = StripPair;

  // `visit`: of the open stages, which are done when a pair comes to a particle; null: there are
  // none.
  StripPairs(const GroupContext& context, const ParticleVisit<kHasOwnPins>* visit)
      : PathPairs(context, context.substep.link_interval, context.substep.inverse_link_interval),
        visit_(visit) {}

  const std::vector<StripPair>& groups() const { return context().model.strip_pairs; }
  void Prepare(const StripPair& pair) const {
    if (visit_ == nullptr) return;
    VisitPair(context().model, *visit_, static_cast<size_t>(&pair - groups().data()));
  }
  const PairLink* links() const { return context().model.pair_links.data(); }
  VectorsPair* end_directions() const { return context().end_directions; }
  float tolerance() const { return context().controls.tolerance; }
  VecPair end_share() const { return {context().end_share, context().end_share}; }

  VecPair InverseMassFrom(const PairLink& link, const Ends& from) const {
    if (HasOwn(link)) return InverseMasses(link, from);
    return Number(link.inverse_mass_from);
  }
  VecPair InverseMassTo(const PairLink& link) const {
    if (HasOwn(link)) return InverseMasses(link, link.to);
    return Number(link.inverse_mass_to);
  }
  VecPair Diagonal(const PairLink& link, const Ends& from) const {
    if (HasOwn(link)) {
      const VecPair sum = InverseMasses(link, from) + InverseMasses(link, link.to);
      return Select(sum > Splat(0), sum, Splat(1));
    }
    return Number(link.diagonal);
  }
  VecPair DiagonalFactor(const StripPair& pair) const {
    const VecCloths one = SplatCloths(1), give = context().span_give;
    if constexpr (kHasOwnPins) {
      const VecPair& spans = context().own_pins.spans[&pair - groups().data()];
      return {one + give * spans.low, one + give * spans.high};
    }
    return {one + give * SplatCloths(pair.span.low), one + give * SplatCloths(pair.span.high)};
  }
  VecPair MinPivot(const PairLink& link) const {
    if (HasOwn(link)) {
      return Select(InverseMasses(link, link.to) > Splat(0),
                    Splat(static_cast<float>(kMinStripPivot)),
                    Splat(static_cast<float>(kMinStripPivotAtPin)));
    }
    return Number(link.min_pivot);
  }

  // The error of a link that nothing moves is none.
  VecPair LooseError(const PairLink& link, const Ends& from, const VecPair& error) const {
    if (HasOwn(link)) {
      const VecPair sum = InverseMasses(link, from) + InverseMasses(link, link.to);
      return Select(sum > Splat(0), error, Splat(0));
    }
    return error;
  }

  VecPair RoundOffs(const Ends& ends) const {
    const VecCloths* const round_offs = context().quiet_round_offs;
    return {round_offs[ends[0]], round_offs[ends[1]]};
  }
  // The lanes whose sweeps continue.
  MaskPair Running(const MaskPair& mask) const {
    return {mask.low & context().is_running, mask.high & context().is_running};
  }

  HWY_INLINE void PullAtLink(uint32_t link, const VectorsPair& impulses) const {
    const GroupImpulses& given = *context().given;
    if (!Holds(given, links()[link])) return;
    given.PullAtLink(link, impulses);
  }
  HWY_INLINE void PullAtFirst(const StripPair& pair, const VectorsPair& impulses) const {
    context().given->PullAtFirst(static_cast<size_t>(&pair - groups().data()), impulses);
  }

  VecPair Compliances(uint32_t link) const {
    return Number(context().model.pair_compliances[link]);
  }
  bool reads_impulses() const { return context().SolvesLinksAgain(); }
  bool keeps_impulses() const { return context().KeepsImpulses(); }
  VecPair Impulses(const Ends& places) const {
    return {context().distance_impulses[places[0]], context().distance_impulses[places[1]]};
  }
  void AddImpulses(const Ends& places, const VecPair& impulses) const {
    VecCloths* const sums = context().distance_impulses;
    sums[places[0]] = sums[places[0]] + impulses.low;
    sums[places[1]] = sums[places[1]] + impulses.high;
  }

 private:
  // Whether the numbers of the link are of each cloth.
  HWY_INLINE bool HasOwn(const PairLink& link) const {
    return kHasOwnPins && context().own_pins.lists->has_own_link[&link - links()] != 0;
  }
  // Whether some cloth holds the end of one of the links.
  static bool Holds(const GroupImpulses& given, const PairLink& link) {
    if constexpr (kHasOwnPins) return given.IsHeld(link.to[0]) || given.IsHeld(link.to[1]);
    return link.has_pins;
  }
  // Of the particles at one end of a link, 0 where it is padding.
  VecPair InverseMasses(const PairLink& link, const Ends& ends) const {
    const VecCloths* const w = context().own_pins.inverse_masses;
    const uint32_t none = context().model.spare_particle();
    return {w[link.rest_length.low > 0 ? ends[0] : none],
            w[link.rest_length.high > 0 ? ends[1] : none]};
  }

  const ParticleVisit<kHasOwnPins>* const visit_;
};

template <bool kAsks, bool kHasOwnPins>
MaskCloths SolveStripsOf(GroupContext& context, const ParticleVisit<kHasOwnPins>& visit) {
  const FloatModel& model = context.model;
  const bool is_open = context.open.any();
  if (is_open) VisitPair(model, visit, model.strip_pairs.size());  // particles of no strip
  if (is_open && kHasOwnPins) {
    for (const uint32_t i : context.own_pins.lists->released) visit(i);
  }
  const MaskPair changed =
      SweepStrips(StripPairs<kHasOwnPins, kAsks>(context, is_open ? &visit : nullptr),
                  {model.has_compliance(), context.controls.has_start_directions(),
                   context.has_quiet_particles});
  context.open = {};
  return changed.low | changed.high;
}

// Settles open stages on the way, while the caches have the particles of a pair.
MaskCloths SolveStrips(GroupContext& context) {
  MaskCloths changed;
  WithVisit(context, [&](const auto& visit) {
    changed = context.given != nullptr ? SolveStripsOf<true>(context, visit)
                                       : SolveStripsOf<false>(context, visit);
  });
  return changed;
}

// One constraint of some of the cloths (Bender et al. 2009, section 3.2 and 3.3). Returns the lanes
// in which the error was larger than the tolerance.
template <bool kHasCompliance, bool kHasInequalities, bool kHasStarts, bool kHasOwnPins>
MaskCloths SolveConstraint(const GroupContext& context, size_t g, uint32_t k, MaskCloths cloths,
                           float tolerance) {
  const float inverse_h = context.substep.inverse_interval;
  const DistanceGroup& group = context.model.groups[g];
  ClothParticle& from = context.particles[group.i[k]];
  ClothParticle& to = context.particles[group.j[k]];
  const VecCloths one = SplatCloths(1), zero = SplatCloths(0);
  const VectorsCloths start = to.p - from.p;
  const VectorsCloths end = start + (to.u - from.u) * context.substep.interval;
  const VecCloths length = Sqrt(Dot(end, end));
  const VecCloths rest_length = SplatCloths(group.rest_length[k]);
  VecCloths residual = length - rest_length;
  VecCloths inverse_mass_i, inverse_mass_j;
  if constexpr (kHasOwnPins) {
    inverse_mass_i = context.own_pins.inverse_masses[group.i[k]];
    inverse_mass_j = context.own_pins.inverse_masses[group.j[k]];
  } else {
    inverse_mass_i = SplatCloths(group.inverse_mass_i[k]);
    inverse_mass_j = SplatCloths(group.inverse_mass_j[k]);
  }
  VecCloths weight = inverse_mass_i + inverse_mass_j;
  VectorsCloths d = end;
  VecCloths divisor = length;
  if constexpr (kHasStarts) {
    const auto lines = BlendDirections(start, Directions(end, length), context.end_share);
    weight = weight * lines.slope;
    d = lines.n;
    divisor = one;
  } else {
    // Without a distance the impulse acts along +x.
    const MaskCloths is_short = length < SplatCloths(kMinDirectionLength);
    if (IsAnyLaneSet(is_short)) [[unlikely]] {
      d = {Select(is_short, one, d.x), Select(is_short, zero, d.y), Select(is_short, zero, d.z)};
      divisor = Select(is_short, one, length);
    }
  }
  VecCloths* const lambda = context.distance_impulses + (g * kVec4Size + k);
  if constexpr (kHasCompliance) {
    const VecCloths alpha_over_h = SplatCloths(context.model.compliances[g][k]) * inverse_h;
    residual = residual + alpha_over_h * *lambda;
    weight = weight + alpha_over_h * inverse_h;
  }
  MaskCloths is_active = cloths & (Abs(residual) > SplatCloths(tolerance * group.rest_length[k]));
  if constexpr (kHasOwnPins) is_active &= inverse_mass_i + inverse_mass_j > zero;
  VecCloths impulse = Select(is_active, DistanceImpulse(residual, inverse_h, weight), zero);
  if constexpr (kHasInequalities) {
    const ImpulseBounds& bounds = context.model.bounds[g];
    impulse =
        ClampImpulse(*lambda, impulse, SplatCloths(bounds.min[k]), SplatCloths(bounds.max[k]));
    is_active &= impulse != zero;
  }
  if constexpr (kHasCompliance || kHasInequalities) *lambda = *lambda + impulse;
  const VecCloths impulse_per_length = impulse / divisor;
  from.u = from.u - (inverse_mass_i * impulse_per_length) * d;
  to.u = to.u + (inverse_mass_j * impulse_per_length) * d;
  if (context.given != nullptr) {
    context.given->PullAtConstraint(g * kVec4Size + k, group.i[k], group.j[k],
                                    impulse_per_length * d);
  }
  return is_active;
}

// One sweep over all colours.
template <bool... kFlags>
MaskCloths SweepDistances(const GroupContext& context) {
  const FloatModel& model = context.model;
  MaskCloths changed;
  for (size_t g = 0; g < model.groups.size(); ++g) {
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      if (model.groups[g].i[k] == model.spare_particle()) break;  // padding is behind
      changed |=
          SolveConstraint<kFlags...>(context, g, k, context.is_running, context.controls.tolerance);
    }
  }
  return changed;
}

// SweepDistances with the flags that the cloths need.
template <bool... kFlags>
MaskCloths ChooseSweep(const GroupContext& context) {
  if constexpr (sizeof...(kFlags) == 4) {
    return SweepDistances<kFlags...>(context);
  } else {
    const bool flags[] = {context.model.has_compliance(), context.model.has_inequalities(),
                          context.controls.has_start_directions(), context.has_own_pins()};
    return flags[sizeof...(kFlags)] ? ChooseSweep<kFlags..., true>(context)
                                    : ChooseSweep<kFlags..., false>(context);
  }
}

MaskCloths SolveDistance(GroupContext& context) {
  Settle(context);
  return ChooseSweep<>(context);
}

// What a joint does to those of its particles that are held.
void PullByJoint(const GroupContext& context, const FloatJoint& joint,
                 const VectorsCloths& impulse) {
  if (context.given == nullptr) return;
  const GroupImpulses& given = *context.given;
  if (given.IsHeld(joint.i)) given.Pull(joint.i, GroupImpulses::None() - impulse);
  if (given.IsHeld(joint.j)) given.Pull(joint.j, impulse);
}

// One sweep over all point joints.
MaskCloths SolveJoints(const GroupContext& context) {
  const FloatControls& controls = context.controls;
  const float inverse_h = controls.inverse_h;
  const VecCloths zero = SplatCloths(0);
  MaskCloths changed;
  for (size_t k = 0; k < context.model.joints.size(); ++k) {
    const FloatJoint& joint = context.model.joints[k];
    ClothParticle& from = context.particles[joint.i];
    ClothParticle& to = context.particles[joint.j];
    const VecCloths w_i = context.InverseMass(joint.i), w_j = context.InverseMass(joint.j);
    VectorsCloths& lambda = context.joint_impulses[k];
    const float alpha_over_h = joint.compliance * inverse_h;
    const VectorsCloths residual =
        ((to.p - from.p) + (to.u - from.u) * controls.h) + lambda * alpha_over_h;
    MaskCloths is_active = controls.tolerance > 0
                               ? context.is_running & (Sqrt(Dot(residual, residual)) >
                                                       SplatCloths(controls.contact_tolerance))
                               : context.is_running;
    if (context.has_own_pins()) is_active &= IsLoose(context, joint.i, joint.j);
    const VecCloths weight = (w_i + w_j) + SplatCloths(alpha_over_h * inverse_h);
    const VectorsCloths impulse =
        Select(is_active, JointImpulse(residual, inverse_h, weight), {zero, zero, zero});
    lambda = lambda + impulse;
    from.u = from.u - w_i * impulse;
    to.u = to.u + w_j * impulse;
    PullByJoint(context, joint, impulse);
    changed |= is_active;
  }
  return changed;
}

// One sweep over the velocities that rigid joints forbid.
void SolveJointVelocities(const GroupContext& context) {
  for (const FloatJoint& joint : context.model.joints) {
    if (joint.compliance > 0) continue;
    ClothParticle& from = context.particles[joint.i];
    ClothParticle& to = context.particles[joint.j];
    const VecCloths w_i = context.InverseMass(joint.i), w_j = context.InverseMass(joint.j);
    const VecCloths zero = SplatCloths(0);
    const VectorsCloths impulse = Select(IsLoose(context, joint.i, joint.j),
                                         (from.u - to.u) / (w_i + w_j), {zero, zero, zero});
    from.u = from.u - w_i * impulse;
    to.u = to.u + w_j * impulse;
    PullByJoint(context, joint, impulse);
  }
}

// Sweeps until no cloth has an error, at most max_iterations.
void Solve(GroupContext& context, std::span<GroupCloth> cloths) {
  const FloatControls& controls = context.controls;
  alignas(64) float running[kClothCount];
  std::fill_n(running, kClothCount, 1.0f);
  std::fill(running + cloths.size(), running + kClothCount, 0.0f);
  context.is_running = LoadCloths(running) > SplatCloths(0);
  for (uint32_t iteration = 0; iteration < context.max_iterations; ++iteration) {
    for (size_t lane = 0; lane < cloths.size(); ++lane) {
      if (running[lane] > 0) ++cloths[lane].report.iterations;
    }
    // All always run: a contact can break what the distances have just met.
    MaskCloths has_changed;
    if (controls.Has(StepStage::kSolveStrips)) has_changed |= SolveStrips(context);
    if (context.substep.is_last && iteration + 1 == context.max_iterations) Refine(context);
    if (controls.Has(StepStage::kSolveDistance)) has_changed |= SolveDistance(context);
    has_changed |= SolveJoints(context);
    has_changed |= SolveContacts(context);
    if (controls.tolerance == 0) continue;
    context.is_running &= has_changed;
    if (!IsAnyLaneSet(context.is_running)) return;
    hn::Store(Select(context.is_running, SplatCloths(1), SplatCloths(0)).v, ClothsTag(), running);
  }
  if (controls.tolerance == 0) return;
  for (size_t lane = 0; lane < cloths.size(); ++lane) {
    if (running[lane] > 0) cloths[lane].report.converged = false;
  }
}

// No velocity along rigid links is left (Bender et al. 2009, section 3.2).
void SolveVelocity(GroupContext& context) {
  const FloatModel& model = context.model;
  if (context.controls.plan.solver.velocity_iterations == 0) return;
  Settle(context);
  for (uint32_t sweep = 0; sweep < context.controls.plan.solver.velocity_iterations; ++sweep) {
    for (size_t g = 0; g < model.groups.size(); ++g) {
      const DistanceGroup& group = model.groups[g];
      const Mask4 is_rigid = model.RigidLanes(g);
      for (uint32_t k = 0; k < kVec4Size; ++k) {
        if (group.i[k] == model.spare_particle() || !is_rigid[k]) continue;
        ClothParticle& from = context.particles[group.i[k]];
        ClothParticle& to = context.particles[group.j[k]];
        const VecCloths inverse_mass_i = context.InverseMass(group.i[k]);
        const VecCloths inverse_mass_j = context.InverseMass(group.j[k]);
        const VectorsCloths d = to.p - from.p;
        const VectorsCloths n = Directions(d, Sqrt(Dot(d, d)));
        const VecCloths impulse =
            VelocityImpulse(Dot(n, to.u - from.u), inverse_mass_i, inverse_mass_j);
        from.u = from.u - (inverse_mass_i * impulse) * n;
        to.u = to.u + (inverse_mass_j * impulse) * n;
        if (context.given != nullptr) {
          context.given->PullAtConstraint(g * kVec4Size + k, group.i[k], group.j[k], impulse * n);
        }
      }
    }
    SolveJointVelocities(context);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
