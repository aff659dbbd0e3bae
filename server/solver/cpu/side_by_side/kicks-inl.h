// Kicks of a group of cloths: springs, elastic elements and the air change the velocities; and
// stage `solve_hinges`, which is made of kicks. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_KICKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_KICKS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_KICKS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_KICKS_INL_H_
#endif

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/grid_elastic-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// By the springs of particle i [N]. Positions: a function of the particle.
template <class Positions>
VectorsCloths SpringForceOn(const GroupContext& context, const Positions& p, uint32_t i) {
  const FloatModel& model = context.model;
  const VecCloths zero = SplatCloths(0);
  VectorsCloths force{zero, zero, zero};
  for (uint32_t e = model.spring_offsets[i]; e < model.spring_offsets[i + 1]; ++e) {
    const FloatSpringEnd& end = model.spring_ends[e];
    const uint32_t j = end.other_particle;
    force = force + SpringForce(p(j) - p(i), context.particles[j].u - context.particles[i].u,
                                end.rest_length, end.stiffness, end.damping);
  }
  return force;
}

// A_i(p, v) by the springs of particle i.
template <class Positions>
VectorsCloths SpringAcceleration(const GroupContext& context, const Positions& p, uint32_t i) {
  return context.InverseMass(i) * SpringForceOn(context, p, i);
}

template <class Positions>
void PullBySprings(const GroupContext& context, const Positions& p, float duration) {
  if (context.given == nullptr) return;
  for (const uint32_t i : context.given->held()) {
    context.given->Pull(i, SplatCloths(duration) * SpringForceOn(context, p, i));
  }
}

// Springs in the force: the accelerations of the substep, gravity with them.
void AccelerateBySprings(GroupContext& context) {
  if (!context.controls.plan.solver.has_spring_forces || context.substep.is_two_step) return;
  Settle(context);
  const auto p = [&](uint32_t i) { return context.particles[i].p; };
  PullBySprings(context, p, context.substep.interval);
  for (const uint32_t i : context.free_particles) {
    context.accelerations[i] = context.gravity + SpringAcceleration(context, p, i);
  }
}

template <class Positions>
void ApplySprings(const GroupContext& context, const Positions& p, float duration) {
  PullBySprings(context, p, duration);
  for (const uint32_t i : context.free_particles) {
    context.accelerations[i] = SpringAcceleration(context, p, i);
  }
  for (const uint32_t i : context.free_particles) {
    context.particles[i].u = context.particles[i].u + context.accelerations[i] * duration;
  }
}

template <class Values>
ElementDifferences<VectorsCloths> Differences(const ElasticGroup& group, size_t k,
                                              const Values& values) {
  const VectorsCloths first = values(group.particles[0][k]);
  return {values(group.particles[1][k]) - first, values(group.particles[2][k]) - first,
          values(group.particles[3][k]) - first};
}

// Null: all cloths have the same.
const OwnElement* OwnElementOf(const GroupContext& context, size_t element) {
  if (!context.has_own_pins()) return nullptr;
  const uint32_t place = context.own_pins.element_places[element];
  return place != 0 ? &context.own_pins.elements[place] : nullptr;
}

// Stores the impulses of a hinge of each cloth.
template <class Positions>
void StoreHingeImpulses(const GroupContext& context, size_t element, const Positions& p,
                        float duration) {
  const ElasticGroup& group = context.elastic_groups[element / kVec4Size];
  const size_t k = element % kVec4Size;
  const OwnElement* const own = OwnElementOf(context, element);
  const VecCloths mass = own != nullptr ? own->mass : SplatCloths(group.mass[k]);
  const VecCloths frequency_sq =
      own != nullptr ? own->frequency_sq : SplatCloths(group.frequency_sq[k]);
  const VecCloths stiffness =
      mass * Min(frequency_sq, SplatCloths(context.controls.max_elastic_frequency_sq));
  const std::array<VecCloths, 3> weights = {SplatCloths(group.weights[0][k]),
                                            SplatCloths(group.weights[1][k]),
                                            SplatCloths(group.weights[2][k])};
  const ElementDifferences<VectorsCloths> d = Differences(group, k, p);
  if (context.model.source->elastic_shares().impulses_per_element == 1) {
    context.impulses[element] = ImpulseOfFlatHinge(weights, stiffness, d, duration);
    return;
  }
  const auto on_places =
      HingeImpulses(weights, SplatCloths(group.rest_length[k]), stiffness, d, duration);
  std::copy(on_places.begin(), on_places.end(), context.impulses + 4 * element);
}

// change(i, v): the change of the velocity of each free particle i by the impulses on it,
// impulse(e) of e from offsets[i] to offsets[i + 1]. pull(i, k, impulse): of each particle that is
// held, k its place; only where anybody asks for it.
template <class Offsets, class Impulse, class Change, class Pull>
void ForChanges(const GroupContext& context, const Offsets& offsets, const Impulse& impulse,
                const Change& change, const Pull& pull) {
  const VecCloths zero = SplatCloths(0);
  const auto sum_on = [&](uint32_t i) {
    VectorsCloths sum{zero, zero, zero};
    for (uint32_t e = offsets[i]; e < offsets[i + 1]; ++e) sum = sum + impulse(e);
    return sum;
  };
  if (context.given != nullptr) {
    const std::span<const uint32_t> held = context.given->held();
    for (size_t k = 0; k < held.size(); ++k) pull(held[k], k, sum_on(held[k]));
  }
  for (const uint32_t i : context.free_particles) change(i, context.InverseMass(i) * sum_on(i));
}

template <class Positions, class Change, class Pull>
void ForHingeChanges(const GroupContext& context, const Positions& p, float duration,
                     const Change& change, const Pull& pull) {
  const FloatModel& model = context.model;
  const size_t element_count = model.source->elastic_elements().size();
  for (size_t e = 0; e < element_count; ++e) StoreHingeImpulses(context, e, p, duration);
  const auto impulse = [&](uint32_t e) {
    const FloatElasticEnd& end = model.elastic_ends[e];
    return SplatCloths(end.weight) * context.impulses[end.impulse];
  };
  ForChanges(context, model.elastic_offsets, impulse, change, pull);
}

template <class Positions>
void ApplyElastic(const GroupContext& context, const Positions& p, float duration) {
  if (context.controls.grid_strengths != nullptr) return ApplyGridElastic(context, p, duration);
  ForHingeChanges(
      context, p, duration,
      [&](uint32_t i, const VectorsCloths& of_elements) {
        context.particles[i].u = context.particles[i].u + of_elements;
      },
      [&](uint32_t i, size_t, const VectorsCloths& impulse) { context.given->Pull(i, impulse); });
}

// The impulse on a triangle of each cloth.
template <class Positions>
VectorsCloths AirImpulses(const GroupContext& context, const TriangleGroup& group, size_t k,
                          const Positions& p, float duration) {
  const std::array<uint32_t, 3> corners = {group.corners[0][k], group.corners[1][k],
                                           group.corners[2][k]};
  const auto weighted = [&](size_t corner) {
    return SplatCloths(group.weights[corner][k]) * context.particles[corners[corner]].u;
  };
  const VecCloths mass = SplatCloths(group.mass[k]);
  const VectorsCloths relative = context.wind - (weighted(0) + weighted(1) + weighted(2));
  const VectorsCloths first = p(corners[0]);
  const VectorsCloths normal = Cross(p(corners[1]) - first, p(corners[2]) - first);
  return mass * AirVelocityChange(relative, normal, context.air_drag * duration / mass,
                                  context.air_lift * duration / mass);
}

template <class Positions>
void ApplyWind(const GroupContext& context, const Positions& p, float duration) {
  const FloatModel& model = context.model;
  const auto triangles = model.source->particle_triangles();
  const size_t triangle_count = model.source->triangles().size();
  for (size_t t = 0; t < triangle_count; ++t) {
    context.impulses[t] =
        AirImpulses(context, model.triangles[t / kVec4Size], t % kVec4Size, p, duration);
  }
  ForChanges(
      context, model.source->triangle_offsets(),
      [&](uint32_t e) { return context.impulses[triangles[e]]; },
      [&](uint32_t i, const VectorsCloths& of_air) {
        const VecCloths share = SplatCloths(model.corner_shares[i]);
        context.particles[i].u = context.particles[i].u + share * of_air;
      },
      [&](uint32_t i, size_t, const VectorsCloths& impulse) {
        context.given->Pull(i, SplatCloths(model.corner_shares[i]) * impulse);
      });
}

// Springs, elastic elements and the air act on the velocities for some time.
template <class Positions>
void KickFrom(const GroupContext& context, const Positions& p, float duration) {
  if (context.controls.Has(StepStage::kApplySprings)) ApplySprings(context, p, duration);
  if (context.controls.Has(StepStage::kApplyElastic)) ApplyElastic(context, p, duration);
  if (context.controls.Has(StepStage::kApplyWind)) ApplyWind(context, p, duration);
}

bool HasKicks(const GroupContext& context, float duration) {
  return duration > 0 &&
         context.controls.plan.stages.HasAnyOf(
             {StepStage::kApplySprings, StepStage::kApplyElastic, StepStage::kApplyWind});
}

void Kick(GroupContext& context, float duration) {
  if (!HasKicks(context, duration)) return;
  Settle(context);
  KickFrom(
      context, [&](uint32_t i) { return context.particles[i].p; }, duration);
}

// b + `interval` u of all particles.
void PredictPositions(const GroupContext& context, float interval) {
  for (size_t i = 0; i < context.particle_count(); ++i) {
    const ClothParticle& particle = context.particles[i];
    context.predicted[i] = particle.p + particle.u * interval;
  }
}

// The same on the predicted velocities u, from the predicted positions b + H u.
void KickWithin(GroupContext& context) {
  const FloatSubstep& substep = context.substep;
  if (!HasKicks(context, substep.kick_within)) return;
  if (IsGridElasticAlone(context)) return KickGridWithin(context);
  Settle(context);
  PredictPositions(context, substep.interval);
  KickFrom(
      context, [&](uint32_t i) { return context.predicted[i]; }, substep.kick_within);
}

// GroupImpulses::hinges times `factor`.
void PullByHinges(const GroupContext& context, float factor) {
  if (context.given == nullptr) return;
  const std::span<const uint32_t> held = context.given->held();
  for (size_t k = 0; k < held.size(); ++k) {
    context.given->Pull(held[k], SplatCloths(factor) * context.given->hinges()[k]);
  }
}

// As long as forces act on u in this substep; found for all substeps that share them.
void ShareHinges(const GroupContext& context) {
  if (context.substep.finds_hinges) {
    PredictPositions(context, context.substep.hinge_interval);
    ForHingeChanges(
        context, [&](uint32_t i) { return context.predicted[i]; }, 1,
        [&](uint32_t i, const VectorsCloths& per_s) { context.hinge_changes[i] = per_s; },
        [&](uint32_t, size_t k, const VectorsCloths& force) {
          Assign(context.given->hinges()[k], force);
        });
  }
  PullByHinges(context, context.substep.force_time);
  for (const uint32_t i : context.free_particles) {
    ClothParticle& particle = context.particles[i];
    particle.u = particle.u + context.hinge_changes[i] * context.substep.force_time;
  }
}

// Stage by stage, each from where the particles will be at the velocities so far.
void SolveHinges(GroupContext& context) {
  if (!context.controls.Has(StepStage::kSolveHinges)) return;
  Settle(context);
  if (context.controls.plan.solver.hinge_period > 1) return ShareHinges(context);
  const VecCloths zero = SplatCloths(0);
  std::fill_n(context.hinge_changes, context.model.particle_count, VectorsCloths{zero, zero, zero});
  if (context.given != nullptr) {
    std::fill_n(context.given->hinges(), context.given->held().size(), GroupImpulses::None());
  }
  for (const auto& stage : context.controls.hinge_stages) {
    PredictPositions(context, context.substep.interval);
    ForHingeChanges(
        context, [&](uint32_t i) { return context.predicted[i]; }, context.substep.force_time,
        [&](uint32_t i, const VectorsCloths& of_elements) {
          VectorsCloths& change = context.hinge_changes[i];
          change = change * stage.momentum + of_elements * stage.gain;
          context.particles[i].u = context.particles[i].u + change;
        },
        [&](uint32_t, size_t k, const VectorsCloths& impulse) {
          VectorsCloths& sum = context.given->hinges()[k];
          sum = sum * stage.momentum + impulse * stage.gain;
        });
    PullByHinges(context, 1);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
