// Stage `solve_elastic` of a group of cloths. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_ELASTIC_LINES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_ELASTIC_LINES_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_ELASTIC_LINES_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_ELASTIC_LINES_INL_H_
#endif

#include "server/solver/cpu/side_by_side/advance-inl.h"
#include "server/solver/cpu/side_by_side/path_pairs-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"
#include "server/solver/cpu/step/elastic_lines-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// Two lines of each cloth: what elastic_lines-inl.h works on.
class LinePairs : public PathPairs {
 public:
  using Place = ElasticPlace<Ends, NumberPair>;

  explicit LinePairs(const GroupContext& context) : PathPairs(context) {}

  void SetCellImpulses(const Ends& cells, const VectorsPair& impulses) const {
    Assign(context().impulses[cells[0]], Low(impulses));
    Assign(context().impulses[cells[1]], High(impulses));
  }
};

void ApplyCellImpulses(const GroupContext& context) {
  const VecCloths zero = SplatCloths(0);
  for (uint32_t row = 0; row < context.model.source->grid_rows(); ++row) {
    ApplyCells(
        context.model, row, VectorsCloths{zero, zero, zero},
        [&](uint32_t i) -> const VectorsCloths& { return context.impulses[i]; },
        [&](uint32_t i, const VectorsCloths& change) {
          context.particles[i].u = context.particles[i].u + change;
        });
  }
}

void SolveElastic(GroupContext& context) {
  if (!context.controls.Has(StepStage::kSolveElastic)) return;
  Settle(context);
  const SceneModel& model = *context.model.source;
  const auto& groups = context.controls.elastic_entries->pairs;
  const LinePairs lines(context);
  for (size_t f = 0; f < model.elastic_lines().families.size(); ++f) {
    const ElasticFamily& family = model.elastic_lines().families[f];
    for (uint32_t g = groups.family_offsets[f]; g < groups.family_offsets[f + 1]; ++g) {
      SolveElasticGroup(lines, model, family, groups.PlacesOf(g));
    }
    if (family.kind == ElasticKind::kCells) ApplyCellImpulses(context);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
