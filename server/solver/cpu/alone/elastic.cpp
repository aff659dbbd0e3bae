#include "server/solver/cpu/alone/elastic.h"

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
    const Vectors4 of_elements = ElasticImpulse(group, Differences(group, p), velocities, duration,
                                                controls.h, controls.inverse_h);
    for (const Vec4& impulse : Transpose(of_elements)) *impulses++ = impulse;
  }
}

}  // namespace

void ApplyElastic(const StepContext& context, const Vec4* positions, float duration) {
  if (!context.controls.Has(StepStage::kApplyElastic)) return;
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
    scratch.state.velocities[i] += model.inverse_masses[i] * impulse;
  });
}

}  // namespace drape::cpu
