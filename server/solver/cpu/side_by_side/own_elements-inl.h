// The numbers of elastic elements that follow from the pins, of a group whose cloths hold different
// particles (lanes.md). Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_OWN_ELEMENTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_OWN_ELEMENTS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_OWN_ELEMENTS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_OWN_ELEMENTS_INL_H_
#endif

#include <algorithm>
#include <span>
#include <vector>

#include "server/solver/cpu/side_by_side/own_pins-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// The elements that are not the same in all models.
void ListUnlikeElements(const ModelOfLane& models, std::vector<uint32_t>& unlike) {
  unlike.clear();
  for (uint32_t g = 0; g < models[0]->elastic_groups.size(); ++g) {
    const ElasticGroup& first = models[0]->elastic_groups[g];
    Mask4 differs{};
    for (size_t lane = 1; lane < kClothCount; ++lane) {
      const ElasticGroup& other = models[lane]->elastic_groups[g];
      differs |= (other.mass != first.mass) | (other.frequency_sq != first.frequency_sq);
    }
    for (uint32_t k = 0; k < kVec4Size; ++k) {
      if (differs[k] != 0) unlike.push_back(g * kVec4Size + k);
    }
  }
}

void GatherElements(const ModelOfLane& models, const FloatControls& controls, GroupScratch& scratch,
                    OwnPins& own_pins) {
  std::vector<uint32_t>& unlike = scratch.unlike_elements;
  ListUnlikeElements(models, unlike);
  scratch.own_elements.assign(models[0]->elastic_groups.size() * kVec4Size, 0);
  own_pins.elements = scratch.element_numbers.Reserve<OwnElement>(unlike.size() + 1);
  own_pins.element_places = scratch.own_elements.data();
  for (size_t k = 0; k < unlike.size(); ++k) {
    const uint32_t g = unlike[k] / kVec4Size, lane = unlike[k] % kVec4Size;
    scratch.own_elements[unlike[k]] = static_cast<uint32_t>(k + 1);
    const auto strength = [&](const FloatModel& m) {
      const ElasticGroup& group = m.elastic_groups[g];
      return ElementStrength(group.mass[lane], group.frequency_sq[lane], group.damping_share[lane],
                             controls.h, controls.inverse_h, controls.max_elastic_frequency_sq);
    };
    own_pins.elements[k + 1] = {
        NumberOfModels(models, [&](const FloatModel& m) { return m.elastic_groups[g].mass[lane]; }),
        NumberOfModels(models,
                       [&](const FloatModel& m) { return m.elastic_groups[g].frequency_sq[lane]; }),
        NumberOfModels(models, [&](const FloatModel& m) { return strength(m).stiffness; }),
        NumberOfModels(models, [&](const FloatModel& m) { return strength(m).damping; })};
  }
}

// The packed places of the lines of each cloth.
using PlacesOfLane = std::array<const PairPlace*, kClothCount>;

// One number of a place: broadcast where it is the same in all cloths, else of each cloth, in
// memory from `next` on.
OwnNumbers OwnNumbersAt(const PlacesOfLane& places, size_t k, NumberPair PairPlace::*number,
                        VecPair*& next) {
  const NumberPair first = places[0][k].*number;
  alignas(64) float low[kClothCount], high[kClothCount];
  bool differs = false;
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const NumberPair own = places[lane][k].*number;
    low[lane] = own.low;
    high[lane] = own.high;
    differs |= own.low != first.low || own.high != first.high;
  }
  if (!differs) return {first, nullptr};
  *next = {LoadCloths(low), LoadCloths(high)};
  return {first, next++};
}

bool AreSame(const PlacesOfLane& places, size_t k) {
  const PairPlace& first = places[0][k];
  return std::ranges::all_of(places, [&](const PairPlace* of_lane) {
    const PairPlace& own = of_lane[k];
    return own.inverse_mass == first.inverse_mass && own.elasticity == first.elasticity &&
           own.inverse_pivot == first.inverse_pivot && own.to_next == first.to_next &&
           own.to_second_next == first.to_second_next;
  });
}

void GatherLines(std::span<const GroupCloth> cloths, GroupScratch& scratch, OwnPins& own_pins) {
  PlacesOfLane places;
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const GroupCloth& cloth = cloths[std::min(lane, cloths.size() - 1)];
    places[lane] = cloth.context.controls.elastic_entries->pairs.places.data();
  }
  const size_t count = cloths[0].context.controls.elastic_entries->pairs.places.size();
  constexpr size_t kNumbers = 5;  // of a place
  OwnPlace* const own = scratch.elastic_places.Reserve<OwnPlace>(count);
  VecPair* next = scratch.elastic_numbers.Reserve<VecPair>(kNumbers * count);
  for (size_t k = 0; k < count; ++k) {
    const PairPlace& first = places[0][k];
    if (AreSame(places, k)) {
      own[k] = {first.particles, {first.inverse_mass},   {first.elasticity}, {first.inverse_pivot},
                {first.to_next}, {first.to_second_next}, first.has_pins};
      continue;
    }
    const auto number = [&](NumberPair PairPlace::*of_place) {
      return OwnNumbersAt(places, k, of_place, next);
    };
    own[k] = {first.particles,
              number(&PairPlace::inverse_mass),
              number(&PairPlace::elasticity),
              number(&PairPlace::inverse_pivot),
              number(&PairPlace::to_next),
              number(&PairPlace::to_second_next),
              first.has_pins};
  }
  own_pins.elastic_places = own;
}

void GatherOwnElements(std::span<const GroupCloth> cloths, GroupScratch& scratch,
                       GroupContext& context) {
  if (!context.has_own_pins()) return;
  if (context.controls.Has(StepStage::kSolveElastic)) {
    GatherLines(cloths, scratch, context.own_pins);
  } else if (!context.elastic_groups.empty()) {
    GatherElements(ModelsOf(cloths), context.controls, scratch, context.own_pins);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
