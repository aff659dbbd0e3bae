#include "server/solver/cpu/alone/elastic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/elastic.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/alone/grid_elastic.h"
#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/simd/vec8-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

HWY_INLINE Vec8 Weights(const ElasticGroup* groups, size_t place) {
  return JoinVectors(groups[0].weights[place], groups[1].weights[place]);
}

// The positions of the particles at `place` of two groups of elements, less those at the first.
HWY_INLINE Vectors8 DifferencesAt(const ElasticGroup* groups, size_t place, const Vec4* p) {
  const auto at = [&](size_t of_place, uint32_t k) {
    return JoinVectors(p[groups[0].particles[of_place][k]], p[groups[1].particles[of_place][k]]);
  };
  VectorPairs d;
#pragma GCC unroll 4
  for (uint32_t k = 0; k < kVec4Size; ++k) d[k] = at(place, k) - at(0, k);
  return Transpose(d);
}

// One vector of each of eight elements, to every `stride`-th of `impulses`.
HWY_INLINE void StoreEight(const Vectors8& vectors, size_t stride, Vec4* impulses) {
  const VectorPairs of_elements = Transpose(vectors);
#pragma GCC unroll 4
  for (uint32_t k = 0; k < kVec4Size; ++k) {
    const auto [low, high] = SplitVectors(of_elements[k]);
    impulses[stride * k] = low;
    impulses[stride * (k + kVec4Size)] = high;
  }
}

// The impulses of hinges, all from the same positions; pairs [begin, end) of groups.
void StoreHingeImpulses(const StepContext& context, const Vec4* p, float duration, size_t begin,
                        size_t end) {
  const Vec8 max_frequency_sq = Splat8(context.controls.max_elastic_frequency_sq);
  const size_t per_element = context.model.source->elastic_shares().impulses_per_element;
  Vec4* impulses = context.scratch.elastic_impulses.data() + per_element * begin * kVec8Size;
  for (size_t pair = begin; pair < end; ++pair) {
    const ElasticGroup* const groups = context.model.elastic_groups.data() + 2 * pair;
    const ElementDifferences<Vectors8> d = {
        DifferencesAt(groups, 1, p), DifferencesAt(groups, 2, p), DifferencesAt(groups, 3, p)};
    const std::array<Vec8, 3> weights = {Weights(groups, 0), Weights(groups, 1),
                                         Weights(groups, 2)};
    const Vec8 frequency_sq = JoinVectors(groups[0].frequency_sq, groups[1].frequency_sq);
    const Vec8 stiffness = JoinVectors(groups[0].mass, groups[1].mass) *
                           Select(frequency_sq > max_frequency_sq, max_frequency_sq, frequency_sq);
    if (per_element == 1) {
      StoreEight(ImpulseOfFlatHinge(weights, stiffness, d, duration), 1, impulses);
    } else {
      const std::array<Vectors8, 4> on_places =
          HingeImpulses(weights, JoinVectors(groups[0].rest_length, groups[1].rest_length),
                        stiffness, d, duration);
#pragma GCC unroll 4
      for (uint32_t place = 0; place < 4; ++place)
        StoreEight(on_places[place], 4, impulses + place);
    }
    impulses += per_element * kVec8Size;
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(StoreHingeImpulses);

namespace {

// change(i, of_elements): the change of the velocity of each free particle i within `duration` [s].
// pull(i, k, impulse): of each held one, k its place; only where anybody asks for it.
template <class Change, class Pull>
void ForHingeChanges(const StepContext& context, const Vec4* positions, float duration,
                     const Change& change, const Pull& pull) {
  const FloatModel& model = context.model;
  StepScratch& scratch = context.scratch;
  context.ForRanges(model.elastic_groups.size() / 2, kGroupGrain, [&](size_t begin, size_t end) {
    HWY_DYNAMIC_DISPATCH(StoreHingeImpulses)(context, positions, duration, begin, end);
  });
  const auto impulse_on = [&](uint32_t i) {
    Vec4 impulse{};
    for (uint32_t e = model.elastic_offsets[i]; e < model.elastic_offsets[i + 1]; ++e) {
      const FloatElasticEnd& end = model.elastic_ends[e];
      impulse += end.weight * scratch.elastic_impulses[end.impulse];
    }
    return impulse;
  };
  if (context.impulses() != nullptr) {
    for (size_t k = 0; k < context.held.particles.size(); ++k) {
      const uint32_t i = context.held.particles[k];
      pull(i, k, impulse_on(i));
    }
  }
  context.ForFreeParticles(
      [&](uint32_t i) { change(i, context.held.inverse_masses[i] * impulse_on(i)); });
}

}  // namespace

void ApplyElastic(const StepContext& context, const Vec4* positions, float duration) {
  if (!context.controls.Has(StepStage::kApplyElastic)) return;
  if (context.controls.grid_strengths != nullptr) {
    return ApplyGridElastic(context, positions, duration);
  }
  std::vector<Vec4>& v = context.scratch.state.velocities;
  ForHingeChanges(
      context, positions, duration, [&](uint32_t i, Vec4 of_elements) { v[i] += of_elements; },
      [&](uint32_t i, size_t, Vec4 impulse) { context.impulses()->Pull(i, impulse); });
}

namespace {

// ImpulseSums::held_hinges times `factor`.
void PullByHinges(const StepContext& context, float factor) {
  ImpulseSums& sums = *context.impulses();
  for (size_t k = 0; k < context.held.particles.size(); ++k) {
    sums.Pull(context.held.particles[k], factor * sums.held_hinges[k]);
  }
}

// As long as forces act on u in this substep; found for all substeps that share them.
void ShareHinges(const StepContext& context) {
  StepScratch& scratch = context.scratch;
  if (context.substep.finds_hinges) {
    if (context.impulses() != nullptr) {
      context.impulses()->held_hinges.resize(context.held.particles.size());
    }
    PredictPositions(context, context.substep.hinge_interval);
    ForHingeChanges(
        context, scratch.predicted.data(), 1,
        [&](uint32_t i, Vec4 per_s) { scratch.hinge_changes[i] = per_s; },
        [&](uint32_t, size_t k, Vec4 force) { context.impulses()->held_hinges[k] = force; });
  }
  if (context.impulses() != nullptr) PullByHinges(context, context.substep.force_time);
  const float force_time = context.substep.force_time;
  context.ForFreeParticles(
      [&](uint32_t i) { scratch.state.velocities[i] += force_time * scratch.hinge_changes[i]; });
}

}  // namespace

// Stage by stage, each from where the particles will be at the velocities so far.
void SolveHinges(const StepContext& context) {
  if (!context.controls.Has(StepStage::kSolveHinges)) return;
  StepScratch& scratch = context.scratch;
  if (context.controls.plan.solver.hinge_period > 1) return ShareHinges(context);
  std::vector<Vec4>& u = scratch.state.velocities;
  scratch.hinge_changes.assign(context.model.particle_count, Vec4{});
  if (context.impulses() != nullptr) {
    context.impulses()->held_hinges.assign(context.held.particles.size(), Vec4{});
  }
  for (const auto& [momentum, gain] : context.controls.hinge_stages) {
    PredictPositions(context, context.substep.interval);
    ForHingeChanges(
        context, scratch.predicted.data(), context.substep.force_time,
        [&](uint32_t i, Vec4 of_elements) {
          Vec4& change = scratch.hinge_changes[i];
          change = momentum * change + gain * of_elements;
          u[i] += change;
        },
        [&](uint32_t, size_t k, Vec4 impulse) {
          Vec4& sum = context.impulses()->held_hinges[k];
          sum = momentum * sum + gain * impulse;
        });
    if (context.impulses() != nullptr) PullByHinges(context, 1);
  }
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
