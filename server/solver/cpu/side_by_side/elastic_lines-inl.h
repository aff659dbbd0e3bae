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

// Two lines of each cloth: what elastic_lines-inl.h works on. ItsPlace: PairPlace or OwnPlace.
template <class ItsPlace, bool kAsksForImpulses>
class LinePairs : public PathPairs {
 public:
  static constexpr bool kAsks = kAsksForImpulses;
  using Place = ItsPlace;

  explicit LinePairs(const GroupContext& context) : PathPairs(context) {}

  using PathPairs::Number;
  static VecPair Number(const OwnNumbers& numbers) {
    return numbers.own != nullptr ? *numbers.own : Number(numbers.same);
  }

  // Lines are solved as if nothing but pins were held: what grips hold stays.
  void Push(const Ends& particles, bool has_pins, const VectorsPair& change) const {
    if (!context().has_own_pins()) return PathPairs::Push(particles, has_pins, change);
    Push(particles[0], Low(change));
    Push(particles[1], High(change));
  }

  void SetCellImpulses(const Ends& cells, const VectorsPair& impulses) const {
    Assign(context().impulses[cells[0]], Low(impulses));
    Assign(context().impulses[cells[1]], High(impulses));
  }

 private:
  void Push(uint32_t i, const VectorsCloths& change) const {
    ClothParticle& particle = context().particles[i];
    const VectorsCloths pushed = particle.u + change;
    const bool is_free = i == context().model.spare_particle() || !context().IsHeldBySome(i);
    Assign(particle.u, is_free ? pushed : Select(context().FreeCloths(i), pushed, particle.u));
  }
};

void ApplyCellImpulses(const GroupContext& context) {
  const VecCloths zero = SplatCloths(0);
  for (uint32_t row = 0; row < context.model.source->grid_rows(); ++row) {
    ApplyCells(
        context.model, row, VectorsCloths{zero, zero, zero},
        [&](uint32_t i) -> const VectorsCloths& { return context.impulses[i]; },
        [&](uint32_t i, const VectorsCloths& impulse) {
          if (context.given != nullptr && context.given->IsHeld(i)) context.given->Pull(i, impulse);
          if (!context.IsFree(i)) return;
          context.particles[i].u = context.particles[i].u + context.InverseMass(i) * impulse;
        });
  }
}

// `places`: of all lines.
template <bool kAsks, class Place>
void SolveLines(const GroupContext& context, const Place* places) {
  const SceneModel& model = *context.model.source;
  const auto& groups = context.controls.elastic_entries->pairs;
  const LinePairs<Place, kAsks> lines(context);
  for (size_t f = 0; f < model.elastic_lines().families.size(); ++f) {
    const ElasticFamily& family = model.elastic_lines().families[f];
    for (uint32_t g = groups.family_offsets[f]; g < groups.family_offsets[f + 1]; ++g) {
      SolveElasticGroup(
          lines, model, family,
          std::span(places + groups.place_offsets[g], places + groups.place_offsets[g + 1]));
    }
    if (family.kind == ElasticKind::kCells) ApplyCellImpulses(context);
  }
}

void SolveElastic(GroupContext& context) {
  if (!context.controls.Has(StepStage::kSolveElastic)) return;
  Settle(context);
  const auto solve = [&](const auto* places) {
    return context.given != nullptr ? SolveLines<true>(context, places)
                                    : SolveLines<false>(context, places);
  };
  if (context.has_own_pins()) return solve(context.own_pins.elastic_places);
  solve(context.controls.elastic_entries->pairs.places.data());
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
