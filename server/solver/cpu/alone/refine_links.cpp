#include "server/solver/cpu/alone/refine_links.h"

#include "server/solver/cpu/alone/contacts.h"
#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/formulas/constraint_math.h"

namespace drape::cpu {
namespace {

using namespace HWY_NAMESPACE;  // constraint_math-inl.h; nothing here depends on what it is

// Set for those of four links that exceed the limits (server/solver/method.md, equation 32).
Mask4 AreStretched(const StepContext& context, const DistanceGroup& group) {
  const RefineLimits& limits = context.controls.refine_limits;
  const float interval = context.substep.interval;
  const Vec4* const p = context.scratch.state.positions.data();
  const Vec4* const u = context.scratch.state.velocities.data();
  const auto predicted = [&](uint32_t i) { return p[i] + interval * u[i]; };
  const auto difference = [&](uint32_t lane) {
    return predicted(group.j[lane]) - predicted(group.i[lane]);
  };
  const Vectors4 d = Transpose(difference(0), difference(1), difference(2), difference(3));
  const Vec4 length_sq = Dot(d, d);
  const Vec4 rest_length_sq = group.rest_length * group.rest_length;
  return (length_sq < limits.min_sq * rest_length_sq) |
         (length_sq > limits.max_sq * rest_length_sq);
}

void MarkStretchedLinks(const StepContext& context) {
  const std::vector<DistanceGroup>& groups = context.model.groups;
  std::vector<StripScratch>& members = context.scratch.strips;
  context.team.AnyOf(0, groups.size(), kGroupGrain, [&](size_t begin, size_t end, uint32_t member) {
    for (size_t g = begin; g < end; ++g) {
      const Mask4 are_stretched = AreStretched(context, groups[g]);
      if (!IsAnyLaneSet(are_stretched)) continue;
      for (uint32_t lane = 0; lane < kVec4Size; ++lane) {
        if (!are_stretched[lane]) continue;
        if (context.held.AreHeld(groups[g].i[lane], groups[g].j[lane])) continue;
        members[member].stretched_links.push_back(static_cast<uint32_t>(g) * kVec4Size + lane);
      }
    }
    return false;
  });
  for (StripScratch& member : members) {
    for (const uint32_t place : member.stretched_links) context.scratch.refinement.Mark(place, 1);
    member.stretched_links.clear();
  }
}

// Moves the ends of a link so that it has its length at the end of the substep.
void MoveEnds(const StepContext& context, uint32_t place) {
  const DistanceGroup& group = context.model.groups[place / kVec4Size];
  const uint32_t lane = place % kVec4Size;
  const uint32_t i = group.i[lane], j = group.j[lane];
  if (context.held.AreHeld(i, j)) return;
  Vec4* const p = context.scratch.state.positions.data();
  const Vec4* const u = context.scratch.state.velocities.data();
  const Vec4 d = PredictedDifference(p[i], p[j], u[i], u[j], context.substep.interval);
  const float length = Length(d);
  const Vec4 n = length < kMinDirectionLength ? Vec4{1, 0, 0, 0} : (1 / length) * d;
  const float w_i = context.held.inverse_masses[i], w_j = context.held.inverse_masses[j];
  const float move = (length - group.rest_length[lane]) / (w_i + w_j);
  p[i] += (w_i * move) * n;
  p[j] -= (w_j * move) * n;
}

}  // namespace

void RefineLinks(const StepContext& context) {
  if (!context.controls.Has(StepStage::kRefine)) return;
  Refinement& refinement = context.scratch.refinement;
  refinement.Begin(context.model);
  MarkStretchedLinks(context);
  const auto move = [&](std::span<const RefinedLink> links) {
    for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
      for (const RefinedLink& link : links) MoveEnds(context, link.place);
    }
  };
  const auto stretched_in = [&](uint32_t place) -> uint32_t {
    const DistanceGroup& group = context.model.groups[place / kVec4Size];
    const uint32_t lane = place % kVec4Size;
    if (context.held.AreHeld(group.i[lane], group.j[lane])) return 0;
    return AreStretched(context, group)[lane] ? 1 : 0;
  };
  const bool has_moved = refinement.Run(context.controls.plan.solver, move, stretched_in);
  if (has_moved) FindContactFloors(context);
}

}  // namespace drape::cpu
