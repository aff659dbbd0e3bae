#include "server/solver/cpu/alone/elastic.h"

#include "server/solver/cpu/alone/advance.h"
#include "server/solver/cpu/formulas/constraint_math-inl.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

ElementDifferences<Vectors4> Differences(const ElasticGroup& group, const Vec4* vectors) {
  const Vectors4 first = Gather(vectors, group.particles[0]);
  return {Gather(vectors, group.particles[1]) - first, Gather(vectors, group.particles[2]) - first,
          Gather(vectors, group.particles[3]) - first};
}

// First phase: the impulses of the elements, all from the same velocities. Groups [begin, end).
void StoreElasticImpulses(const StepContext& context, const Vec4* p, float duration, size_t begin,
                          size_t end) {
  const FloatControls& controls = context.controls;
  const Vec4* const v = context.scratch.state.velocities.data();
  Vec4* impulses = context.scratch.elastic_impulses.data() + begin * kVec4Size;
  for (size_t g = begin; g < end; ++g) {
    const ElasticGroup& group = context.model.elastic_groups[g];
    const auto velocities = [&] { return Differences(group, v); };
    const Vectors4 of_elements =
        ElasticImpulse(group, Differences(group, p), velocities, duration, controls.h,
                       controls.inverse_h, controls.max_elastic_frequency_sq);
    for (const Vec4& impulse : Transpose(of_elements)) *impulses++ = impulse;
  }
}

// change(i, of_elements): the change of the velocity of each free particle i within `duration` [s].
template <class Change>
void ForElasticChanges(const StepContext& context, const Vec4* positions, float duration,
                       const Change& change) {
  const FloatModel& model = context.model;
  StepScratch& scratch = context.scratch;
  context.ForRanges(model.elastic_groups.size(), kGroupGrain, [&](size_t begin, size_t end) {
    StoreElasticImpulses(context, positions, duration, begin, end);
  });
  context.ForFreeParticles([&](uint32_t i) {
    Vec4 impulse{};
    for (uint32_t e = model.elastic_offsets[i]; e < model.elastic_offsets[i + 1]; ++e) {
      const FloatElasticEnd& end = model.elastic_ends[e];
      impulse += end.weight * scratch.elastic_impulses[end.element];
    }
    change(i, context.held.inverse_masses[i] * impulse);
  });
}

}  // namespace

void ApplyElastic(const StepContext& context, const Vec4* positions, float duration) {
  if (!context.controls.Has(StepStage::kApplyElastic)) return;
  std::vector<Vec4>& v = context.scratch.state.velocities;
  ForElasticChanges(context, positions, duration,
                    [&](uint32_t i, Vec4 of_elements) { v[i] += of_elements; });
}

// Stage by stage, each from where the particles will be at the velocities so far.
void SolveHinges(const StepContext& context) {
  if (!context.controls.Has(StepStage::kSolveHinges)) return;
  StepScratch& scratch = context.scratch;
  std::vector<Vec4>& u = scratch.state.velocities;
  scratch.hinge_changes.assign(context.model.particle_count, Vec4{});
  for (const auto& [momentum, gain] : context.controls.hinge_stages) {
    PredictPositions(context);
    ForElasticChanges(context, scratch.predicted.data(), context.substep.force_time,
                      [&](uint32_t i, Vec4 of_elements) {
                        Vec4& change = scratch.hinge_changes[i];
                        change = momentum * change + gain * of_elements;
                        u[i] += change;
                      });
  }
}

}  // namespace drape::cpu
