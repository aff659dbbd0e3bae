#include "server/solver/cpu/refine_links.h"

#include <algorithm>
#include <cstring>

#include "server/solver/cpu/constraint_math-inl.h"
#include "server/solver/cpu/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// Four numbers that need not be aligned.
Lanes Load(const float* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof(lanes));
  return lanes;
}

// The links of a strip that are far off, to `far_off`; four at once.
void TestStrip(const StepContext& context, uint32_t strip, std::vector<LinkEnds>& far_off) {
  const StripSet& strips = context.model.source->strips();
  const RefineLimits& limits = context.controls.refine_limits;
  const float interval = context.substep.interval;
  const Lanes* const p = context.scratch.state.positions.data();
  const Lanes* const u = context.scratch.state.velocities.data();
  const uint32_t begin = strips.strip_offsets[strip];
  const uint32_t link_count = strips.strip_offsets[strip + 1] - begin;
  const uint32_t* const particles = strips.particles.data() + begin + strip;
  const float* const rest_lengths_sq = context.model.strip_lengths_sq.data() + begin;
  const auto predicted = [&](uint32_t i) { return p[i] + interval * u[i]; };
  Lanes start = predicted(particles[0]);
  for (uint32_t k = 0; k < link_count; k += kLaneCount) {
    // Behind the last link there are links of length 0 from its end to itself.
    const uint32_t count = std::min(link_count - k, kLaneCount);
    Lanes rest_length_sq{};
    if (count == kLaneCount) {
      rest_length_sq = Load(rest_lengths_sq + k);
    } else {
      std::memcpy(&rest_length_sq, rest_lengths_sq + k, count * sizeof(float));
    }
    Lanes d[kLaneCount] = {};
    for (uint32_t lane = 0; lane < count; ++lane) {
      const Lanes end = predicted(particles[k + lane + 1]);
      d[lane] = end - start;
      start = end;
    }
    const LaneVectors t = Transpose(d[0], d[1], d[2], d[3]);
    const Lanes length_sq = Dot(t, t);
    const LaneMask is_far_off =
        (length_sq < limits.min_sq * rest_length_sq) | (length_sq > limits.max_sq * rest_length_sq);
    if (!IsAnyLaneSet(is_far_off)) continue;
    for (uint32_t lane = 0; lane < count; ++lane) {
      if (is_far_off[lane]) far_off.push_back({particles[k + lane], particles[k + lane + 1]});
    }
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
