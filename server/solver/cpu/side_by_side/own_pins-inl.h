// The inverse masses and pins of a group whose cloths hold different particles, into the
// lanes (lanes.md). Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_OWN_PINS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_OWN_PINS_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_OWN_PINS_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_OWN_PINS_INL_H_
#endif

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/cpu/side_by_side/exchange-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

using ModelOfLane = std::array<const FloatModel*, kClothCount>;

// Lanes without a cloth are like the last one.
const StepContext& ContextOfLane(std::span<const GroupCloth> cloths, size_t lane) {
  return cloths[std::min(lane, cloths.size() - 1)].context;
}

ModelOfLane ModelsOf(std::span<const GroupCloth> cloths) {
  ModelOfLane models;
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    models[lane] = &ContextOfLane(cloths, lane).model;
  }
  return models;
}

// Before the context, which needs to know how many there are.
void ListPins(std::span<const GroupCloth> cloths, PinLists& lists) {
  if (HoldTheSame(cloths)) return;
  std::array<PinLists::Lane, kClothCount> lanes;
  for (size_t lane = 0; lane < kClothCount; ++lane) {
    const StepContext& cloth = ContextOfLane(cloths, lane);
    lanes[lane] = {&cloth.model, cloth.held.particles};
  }
  lists.Make(lanes, lanes[0].model->layout());
}

bool AreSame(const ModelOfLane& models) {
  return std::ranges::all_of(models, [&](const FloatModel* model) { return model == models[0]; });
}

// number(model) of each cloth.
template <class Number>
VecCloths NumberOfModels(const ModelOfLane& models, const Number& number) {
  alignas(64) float values[kClothCount];
  for (size_t lane = 0; lane < kClothCount; ++lane) values[lane] = number(*models[lane]);
  return LoadCloths(values);
}

void GatherInverseMasses(std::span<const GroupCloth> cloths, const FloatModel& layout,
                         const OwnPins& own_pins) {
  VecCloths* const w = own_pins.inverse_masses;
  for (uint32_t i = 0; i < layout.particle_count; ++i) {
    w[i] = SplatCloths(layout.inverse_masses[i]);
  }
  w[layout.spare_particle()] = SplatCloths(0);
  const auto gather = [&](uint32_t i) {
    alignas(64) float values[kClothCount];
    for (size_t lane = 0; lane < kClothCount; ++lane) {
      values[lane] = ContextOfLane(cloths, lane).held.inverse_masses[i];
    }
    w[i] = LoadCloths(values);
  };
  for (const PinHold& hold : own_pins.lists->holds) gather(hold.particle);
  for (const uint32_t i : own_pins.lists->released) gather(i);
}

// Which strips are spans of each cloth.
void GatherSpans(const ModelOfLane& models, const FloatModel& layout, const OwnPins& own_pins) {
  for (size_t pair = 0; pair < layout.strip_pairs.size(); ++pair) {
    const auto spans_of = [&](uint32_t constraint) {
      return NumberOfModels(models, [&](const FloatModel& model) {
        return model.IsSpanned(constraint) ? 1.0f : 0.0f;
      });
    };
    const auto& [low, high] = layout.strip_pairs[pair].constraints;
    own_pins.spans[pair] = {spans_of(low), spans_of(high)};
  }
}

// The states of pins and their targets. A cloth that has fewer pins than others has some that
// nothing reads.
void GatherPins(std::span<const GroupCloth> cloths, const GroupContext& context) {
  const Vec4 *places[kClothCount], *targets[kClothCount];
  for (uint32_t pin = 0; pin < context.own_pins.lists->pin_count; ++pin) {
    for (size_t lane = 0; lane < kClothCount; ++lane) {
      const GroupCloth& cloth = cloths[std::min(lane, cloths.size() - 1)];
      const HeldParticles& held = cloth.context.held;
      const bool has_pin = pin < held.particles.size();
      places[lane] = &cloth.state.positions[has_pin ? held.particles[pin] : 0];
      targets[lane] = has_pin ? &held.targets[pin] : places[lane];
    }
    const VectorsCloths p = LoadVectors(places, 0);
    context.own_pins.pins[pin] = {p, p};
    context.pin_targets[pin] = LoadVectors(targets, 0);
  }
}

void GatherOwnPins(std::span<const GroupCloth> cloths, const GroupContext& context) {
  if (!context.has_own_pins()) return;
  const ModelOfLane models = ModelsOf(cloths);
  GatherInverseMasses(cloths, context.model, context.own_pins);
  GatherSpans(models, context.model, context.own_pins);
  GatherPins(cloths, context);
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
