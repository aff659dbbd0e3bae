#include "server/solver/cpu/refine_links.h"

#include "server/solver/cpu/constraint_math-inl.h"
#include "server/solver/cpu/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// The links of a strip that are far off, to `far_off`.
void TestStrip(const StepContext& context, uint32_t strip, std::vector<LinkEnds>& far_off) {
  const StripSet& strips = context.model.source->strips();
  const RefineLimits& limits = context.controls.refine_limits;
  const float interval = context.substep.interval;
  const Lanes* const p = context.scratch.state.positions.data();
  const Lanes* const u = context.scratch.state.velocities.data();
  uint32_t from = strips.particles[strips.strip_offsets[strip] + strip];
  Lanes start = p[from] + interval * u[from];
  for (uint32_t k = strips.strip_offsets[strip]; k < strips.strip_offsets[strip + 1]; ++k) {
    const uint32_t to = strips.particles[k + strip + 1];
    const Lanes end = p[to] + interval * u[to];
    const Lanes d = end - start;
    const float length_sq = Dot(d, d);
    const float rest_length_sq = context.model.strip_lengths_sq[k];
    if (length_sq < limits.min_sq * rest_length_sq || length_sq > limits.max_sq * rest_length_sq) {
      far_off.push_back({from, to});
    }
    from = to;
    start = end;
  }
}

// The strips of the last phase have just been solved.
void MarkLinksFarOff(const StepContext& context) {
  const StripSet& strips = context.model.source->strips();
  const uint32_t strip_count = strips.phase_offsets[strips.phase_count() - 1];
  std::vector<StripScratch>& members = context.scratch.strips;
  context.team.AnyOf(0, strip_count, kTestedStripGrain,
                     [&](size_t begin, size_t end, uint32_t member) {
                       for (size_t strip = begin; strip < end; ++strip) {
                         TestStrip(context, static_cast<uint32_t>(strip), members[member].far_off);
                       }
                       return false;
                     });
  context.scratch.refinement.Begin(context.model.particle_count);
  for (StripScratch& member : members) {
    for (const LinkEnds& ends : member.far_off) {
      context.scratch.refinement.Mark(ends.from, ends.to, 1);
    }
    member.far_off.clear();
  }
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

}  // namespace

void RefineLinks(const StepContext& context) {
  MarkLinksFarOff(context);
  const std::span<const RefinedLink> links = context.scratch.refinement.TakeLinks(context.model);
  for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
    for (const RefinedLink& link : links) SolveLink(context, link.place);
  }
}

}  // namespace drape::cpu
