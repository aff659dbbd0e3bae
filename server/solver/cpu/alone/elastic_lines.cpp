#include "server/solver/cpu/alone/elastic_lines.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/solver/cpu/alone/elastic_lines.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "server/solver/cpu/alone/eight_paths-inl.h"
#include "server/solver/cpu/step/elastic_lines-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Eight lines of a family: what elastic_lines-inl.h works on.
template <bool kAsksForImpulses>
class EightLines : public EightPaths {
 public:
  static constexpr bool kAsks = kAsksForImpulses;
  using Place = ElasticPlace<Ends, Numbers8>;

  // By a member of the team.
  EightLines(const StepContext& context, uint32_t member)
      : EightPaths(context), scratch_(context.scratch.strips[member]) {}

  StripLinkSolution<Scalars, Vectors>* solution() const {
    return scratch_.links.Reserve<StripLinkSolution<Scalars, Vectors>>(
        context().model.longest_elastic_line);
  }
  Vectors* right_sides() const {
    return scratch_.end_directions.Reserve<Vectors>(context().model.longest_elastic_line);
  }
  void SetCellImpulses(const Ends& cells, const Vectors8& impulses) const {
    const VectorPairs pairs = Transpose(impulses);
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      const auto [low, high] = SplitVectors(pairs[k]);
      context().scratch.elastic_impulses[cells[k]] = low;
      context().scratch.elastic_impulses[cells[k + kVec4Size]] = high;
    }
  }

 private:
  StripScratch& scratch_;
};

// Groups [begin, end) of a family.
template <bool kAsks>
void SolveGroupsOf(const StepContext& context, const ElasticFamily& family, size_t begin,
                   size_t end, uint32_t member) {
  const EightLines<kAsks> lines(context, member);
  for (size_t g = begin; g < end; ++g) {
    SolveElasticGroup(lines, *context.model.source, family,
                      context.controls.elastic_entries->eights.PlacesOf(g));
  }
}

void SolveGroups(const StepContext& context, const ElasticFamily& family, size_t begin, size_t end,
                 uint32_t member) {
  if (context.impulses() != nullptr) {
    SolveGroupsOf<true>(context, family, begin, end, member);
  } else {
    SolveGroupsOf<false>(context, family, begin, end, member);
  }
}

void ApplyRows(const StepContext& context, size_t begin, size_t end) {
  const Vec4* const impulses = context.scratch.elastic_impulses.data();
  Vec4* const u = context.scratch.state.velocities.data();
  for (auto row = static_cast<uint32_t>(begin); row < end; ++row) {
    ApplyCells(
        context.model, row, Vec4{}, [&](uint32_t i) { return impulses[i]; },
        [&](uint32_t i, const Vec4& impulse) {
          const float w = context.held.inverse_masses[i];
          if (w != 0) u[i] += impulse * w;
          if (w == 0 && context.impulses() != nullptr) context.impulses()->Pull(i, impulse);
        });
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace drape::cpu {

HWY_EXPORT(SolveGroups);
HWY_EXPORT(ApplyRows);

void SolveElastic(const StepContext& context) {
  if (!context.controls.Has(StepStage::kSolveElastic)) return;
  const SceneModel& model = *context.model.source;
  const std::vector<uint32_t>& offsets = context.controls.elastic_entries->eights.family_offsets;
  for (size_t f = 0; f < model.elastic_lines().families.size(); ++f) {
    const ElasticFamily& family = model.elastic_lines().families[f];
    context.team.AnyOf(offsets[f], offsets[f + 1], kStripGrain,
                       [&](size_t begin, size_t end, uint32_t member) {
                         HWY_DYNAMIC_DISPATCH(SolveGroups)(context, family, begin, end, member);
                         return false;
                       });
    if (family.kind != ElasticKind::kCells) continue;
    context.ForRanges(model.grid_rows(), kRowGrain, [&](size_t begin, size_t end) {
      HWY_DYNAMIC_DISPATCH(ApplyRows)(context, begin, end);
    });
  }
}

}  // namespace drape::cpu
#endif  // HWY_ONCE
