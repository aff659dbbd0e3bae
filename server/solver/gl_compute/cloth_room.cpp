#include "server/solver/gl_compute/cloth_room.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/kernel_compiler.h"
#include "server/solver/gl_compute/layouts.h"
#include "server/solver/gl_compute/self_contact_words.h"
#include "server/solver/gl_compute/tiled_step.h"

namespace drape {

Status RoomMaker::TakeScratch(const PlannedCloth& cloth, GlScheme& scheme) {
  const KernelVariant& variant = scheme.kernels->variant;
  PackedLayout layout = LayOutScratch(cloth, variant.is_tiled() || variant.is_in_parts());
  if (cloth.plan.Has(StepStage::kFindSelfContacts)) {
    layout.size = LayOutSelfContacts(layout.size, cloth.model.particle_count(),
                                     scheme.contacts.capacity, scheme.contacts);
  }
  if (scheme.impulses.is_made()) {
    layout.size = LayOutImpulses(cloth, layout.size, scheme.impulses.record);
  }
  Result<ScratchRange> scratch = device_.arrays->scratch.Allocate(layout.size);
  if (!scratch.ok()) return scratch.status();
  scheme.scratch = std::move(scratch).value();
  scheme.scratch_layout = layout.layout;
  return Status::Ok();
}

Result<GlScheme> RoomMaker::MakeScheme(const PlannedCloth& cloth, const DeviceModel& model,
                                       uint32_t pair_capacity) {
  DRAPE_ASSIGN_OR_RETURN(const KernelChoice chosen,
                         ChooseKernels(cloth, device_.traits, [this](const KernelVariant& variant) {
                           return device_.kernels->ForVariant(variant);
                         }));
  GlScheme scheme{.plan = cloth.plan,
                  .kernels = chosen.kernels,
                  .part_count = chosen.choice.part_count,
                  .costs = chosen.choice.costs,
                  .contacts = model.contacts};
  scheme.contacts.capacity = pair_capacity;
  DRAPE_RETURN_IF_ERROR(TakeScratch(cloth, scheme));
  return scheme;
}

Status RoomMaker::TakeParameterWords(const PlannedCloth& cloth, size_t cloth_count,
                                     ClothRoom& room) {
  DeviceArrays& arrays = *device_.arrays;
  const PackedLayout layout = LayOutParameters(cloth);
  Result<WordRange> words = arrays.parameters.Allocate(layout.size);
  if (!words.ok()) return words.status();
  room.parameter_words = std::move(words).value();
  room.parameter_layout = layout.layout;
  if (cloth.plan.Has(StepStage::kFindSelfContacts)) {
    Result<WordRange> contacts =
        arrays.parameters.Allocate(kSelfContactRecordWords + cloth.model.particle_count());
    if (!contacts.ok()) return contacts.status();
    room.contact_words = std::move(contacts).value();
  }
  return arrays.ReserveBatch(cloth_count + 1, MostDispatchesOfSweep(cloth.model));
}

Result<ClothRoom> RoomMaker::Make(const std::shared_ptr<const SceneModel>& model,
                                  const ClothParameters& parameters, LengthSource lengths,
                                  size_t cloth_count) {
  const PlannedCloth cloth = PlanOnDevice(*model, parameters, lengths);
  const bool touches_itself = cloth.plan.Has(StepStage::kFindSelfContacts);
  Result<std::shared_ptr<const DeviceModel>> on_device = models_.Acquire(
      model, {.has_air_forces = cloth.plan.Has(StepStage::kApplyWind),
              .has_strip_rows = device_.traits.strip_solve != StripSolve::kElimination,
              .surface = touches_itself ? surfaces_.Get(model) : nullptr});
  if (!on_device.ok()) return on_device.status();
  const uint32_t pair_capacity =
      touches_itself ? device_.first_pairs_per_particle * model->particle_count() : 0;
  Result<GlScheme> scheme = MakeScheme(cloth, *on_device.value(), pair_capacity);
  if (!scheme.ok()) return scheme.status();
  ClothRoom room{.scheme = std::move(scheme).value()};
  room.pair_capacity = pair_capacity;
  room.model = std::move(on_device).value();
  DRAPE_RETURN_IF_ERROR(TakeParameterWords(cloth, cloth_count, room));
  for (const Collider& collider : parameters.colliders) {
    const std::shared_ptr<const DistanceMap> samples = MapOf(collider);
    if (samples == nullptr) continue;
    Result<std::shared_ptr<const DeviceMap>> map = maps_.Acquire(samples);
    if (!map.ok()) return map.status();
    room.maps.push_back(std::move(map).value());
  }
  return room;
}

namespace {

// The scheme of a cloth without its memory in Scratch and without impulses.
GlScheme Likewise(const GlCloth& cloth) {
  return {.plan = cloth.plan,
          .kernels = cloth.kernels,
          .part_count = cloth.part_count,
          .costs = cloth.costs,
          .contacts = cloth.contacts};
}

// The parameters of the scheme that a cloth has now.
ClothParameters ParametersOf(const GlCloth& cloth) {
  const bool is_calmer = cloth.gain_response == GainResponse::kNotWatched;
  return is_calmer ? WithCalmerScheme(cloth.parameters) : cloth.parameters;
}

PlannedCloth PlannedAs(const GlCloth& cloth, const ClothParameters& parameters) {
  return {*cloth.model->model, parameters,
          cloth.has_own_lengths() ? LengthSource::kOwn : LengthSource::kModel, cloth.plan};
}

}  // namespace

KernelVariant VariantThatTells(const GlCloth& cloth) {
  KernelVariant variant = cloth.kernels->variant;
  variant.traits.Add(Feature::kImpulses);
  return variant;
}

Status RoomMaker::MakeImpulses(GlCloth& cloth) {
  const ClothParameters parameters = ParametersOf(cloth);
  const PlannedCloth planned = PlannedAs(cloth, parameters);
  GlScheme larger = Likewise(cloth);
  ImpulseRoom& room = larger.impulses;
  DRAPE_ASSIGN_OR_RETURN(room.kernels, device_.kernels->ForVariant(VariantThatTells(cloth)));
  DRAPE_ASSIGN_OR_RETURN(room.lists, pull_lists_.Acquire(cloth.model->model));
  DRAPE_ASSIGN_OR_RETURN(room.words,
                         device_.arrays->parameters.Allocate(CountImpulseWords(planned)));
  DRAPE_RETURN_IF_ERROR(TakeScratch(planned, larger));
  cloth.scheme() = std::move(larger);
  return Status::Ok();
}

void RoomMaker::TakeMorePairs(GlCloth& cloth) {
  const uint32_t most = kMostPairsPerParticle * cloth.particle_count();
  const uint32_t wanted = std::exchange(cloth.pairs_wanted, 0);
  const uint32_t capacity = std::min(most, std::max(2 * cloth.contacts.capacity, wanted));
  GlScheme larger = Likewise(cloth);
  larger.contacts.capacity = capacity;
  larger.impulses = std::move(cloth.impulses);
  const ImpulseRecord impulse_record = larger.impulses.record;
  const ClothParameters parameters = ParametersOf(cloth);
  const PlannedCloth planned = PlannedAs(cloth, parameters);
  if (capacity > cloth.contacts.capacity && TakeScratch(planned, larger).ok()) {
    cloth.pair_capacity = capacity;
    cloth.scheme() = std::move(larger);
    return;
  }
  cloth.impulses = std::move(larger.impulses);
  cloth.impulses.record = impulse_record;
  cloth.may_take_more_pairs = false;
  spdlog::warn("self_contacts_without_room particles={} pairs={} room={}", cloth.particle_count(),
               wanted, cloth.contacts.capacity);
}

}  // namespace drape
