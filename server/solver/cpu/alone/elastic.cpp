#include "server/solver/cpu/alone/elastic.h"

#include "server/solver/cpu/formulas/constraint_math-inl.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// Vectors of the particles at the second to fourth place of four elements, minus that at the first.
struct Differences {
  Differences(const ElasticGroup& group, const Vec4* vectors) {
    const Vectors4 first = Gather(vectors, group.particles[0]);
    for (size_t k = 0; k < 3; ++k) {
      from_first[k] = Minus(Gather(vectors, group.particles[k + 1]), first);
    }
  }

  std::array<Vectors4, 3> from_first;
};

Vectors4 WeightedSum(const ElasticGroup& group, const Differences& differences) {
  const auto& [a, b, c] = differences.from_first;
  const auto& [w_a, w_b, w_c] = group.weights;
  return {(w_a * a.x + w_b * b.x) + w_c * c.x, (w_a * a.y + w_b * b.y) + w_c * c.y,
          (w_a * a.z + w_b * b.z) + w_c * c.z};
}

// First phase: the impulses of the elements, all from the same velocities. Groups [begin, end).
void StoreElasticImpulses(const StepContext& context, const Vec4* p, float duration, size_t begin,
                          size_t end) {
  const FloatControls& controls = context.controls;
  const Vec4* const v = context.scratch.state.velocities.data();
  Vec4* impulses = context.scratch.elastic_impulses.data() + begin * kVec4Size;
  for (size_t g = begin; g < end; ++g) {
    const ElasticGroup& group = context.model.elastic_groups[g];
    const Differences d(group, p);
    const Vectors4 l = WeightedSum(group, d);
    const Vectors4 normal = Cross(d.from_first[0], Minus(d.from_first[2], d.from_first[1]));
    const Vec4 length = Sqrt(Dot(l, l));
    const Mask4 has_direction = length >= kMinDirectionLength;
    const Vec4 divisor = has_direction ? length : Splat(1);
    const Vec4 rest_length = Dot(l, normal) < 0 ? -group.rest_length : group.rest_length;
    Vec4 speed{};
    if (IsAnyLaneSet(group.damping_share > 0)) {
      speed = Dot(WeightedSum(group, Differences(group, v)), l) / divisor;
    }
    const Vec4 impulse =
        ElasticImpulse(group.mass, group.frequency_sq, group.damping_share, length - rest_length,
                       speed, duration, controls.h, controls.inverse_h);
    const Vec4 per_length = has_direction ? impulse / divisor : Vec4{};
    for (uint32_t lane = 0; lane < kVec4Size; ++lane) {
      *impulses++ = per_length[lane] * Vec4{l.x[lane], l.y[lane], l.z[lane], 0};
    }
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
