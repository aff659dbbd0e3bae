#include "server/session/saved_states.h"

#include <algorithm>
#include <map>
#include <utility>
#include <variant>

#include "server/session/cloth_creation.h"
#include "server/session/preparation.h"
#include "server/session/sliced_command.h"
#include "server/session/start_cost.h"

namespace drape {
namespace {

// What a cloth takes beside its arrays.
constexpr uint64_t kBytesPerCloth = sizeof(SavedCloth) + 256;

// The cloth may get another one, and leave this to the saved states. The model has its charge.
uint64_t BytesOf(const ClothDescription& description) {
  const ClothParameters& parameters = description.parameters;
  return sizeof(description) + std::span(description.pins).size_bytes() +
         std::span(parameters.colliders).size_bytes() +
         std::span(parameters.collider_motions).size_bytes();
}

uint64_t BytesOf(const ScalarColumn& column) {
  return std::visit([](const auto& values) { return values.size() * sizeof(values[0]); }, column);
}

bool HaveSameParticles(const SceneModel& a, const SceneModel& b) {
  if (&a == &b) return true;
  return a.described_particle_count() == b.described_particle_count() &&
         std::ranges::equal(a.rest_positions_m(), b.rest_positions_m()) &&
         std::ranges::equal(a.triangles(), b.triangles());
}

// Of cloths in no world any will do.
bool HasSettingsOf(const ClothRecord& cloth, const SavedCloth& from) {
  return cloth.world.empty() ||
         cloth.description()->parameters.settings == from.description->parameters.settings;
}

// What the backend must be told beside the particles.
ClothUpdate UpdateTo(const SavedCloth& from, const ClothRecord& cloth) {
  const ClothDescription& description = *from.description;
  const RuntimeState& saved = from.runtime;
  const double now_s = saved.progress.time_s;
  const ClothControls& controls = cloth.runtime->controls();
  ClothUpdate update;
  update.state = ParticlesOf(from);
  update.fault = saved.progress.fault;
  update.may_cross_itself = saved.may_cross_itself;
  update.pin_targets_m = saved.pins.At(now_s);
  const auto present = cloth.description();
  if (present->model != description.model) update.model = description.model;
  if (present != from.description) {
    update.parameters = OnDevice(*description.model, description.parameters, cloth.placement);
  }
  if (saved.lengths.is_driven() || controls.lengths().is_driven()) {
    update.rest_lengths_m = saved.lengths.LengthsAt(now_s);
  }
  if (saved.colliders.is_moving() || controls.colliders().is_moving()) {
    update.collider_motions = saved.colliders.At(now_s);
  }
  return update;
}

// What may have changed since CheckLoads.
Status CheckLoadNow(const ClothRecord& cloth, const SavedCloth& from) {
  if (!cloth.runtime->is_alive()) return ClothNotFound(cloth.id);
  if (HasSettingsOf(cloth, from)) return Status::Ok();
  return Status::InvalidField("cloth_ids", "cloth " + std::to_string(cloth.id.Packed()) +
                                               " of a world has got other settings meanwhile");
}

}  // namespace

ParticleState ParticlesOf(const SavedCloth& from) {
  const uint32_t count = from.description->model->particle_count();
  ParticleState state;
  state.positions_m.reserve(count);
  state.velocities_m_per_s.reserve(count);
  for (size_t row = from.first_row; row < from.first_row + count; ++row) {
    state.positions_m.push_back(VectorAt(from.columns->positions_m, row));
    state.velocities_m_per_s.push_back(VectorAt(from.columns->velocities_m_per_s, row));
  }
  return state;
}

Status SavedStatesNotFound(const std::string& name) {
  return {StatusCode::kNotFound, "SAVED_STATES_NOT_FOUND",
          "nothing is saved as '" + name + "' in this session"};
}

size_t ClothsPerSlice(std::span<const std::shared_ptr<ClothRecord>> cloths) {
  uint64_t largest = 1;
  for (const auto& cloth : cloths) {
    const auto description = cloth->description();
    largest = std::max(largest, SliceCost(*description->model, description->parameters,
                                          cloth->held_lengths.count()));
  }
  return ClothsPerSlice(largest);
}

uint64_t SliceCostOf(const SavedCloth& from) {
  return SliceCost(*from.description->model, from.description->parameters,
                   static_cast<uint32_t>(from.runtime.lengths.track().size()));
}

Status SaveOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                    ByteBudget& budget, const std::string& owner, SavedStates& saved) {
  std::vector<ClothHandle> handles;
  for (const auto& cloth : cloths) {
    if (!cloth->runtime->is_alive()) return ClothNotFound(cloth->id);
    handles.push_back(cloth->runtime->handle());
  }
  const auto columns = std::make_shared<const StateColumns>(backend.Read({handles, true, true}));
  uint64_t bytes = BytesOf(columns->positions_m) + BytesOf(columns->velocities_m_per_s);
  size_t row = 0;
  for (const auto& cloth : cloths) {
    SavedCloth& entry = saved.cloths.emplace_back();
    entry = {.id = cloth->id,
             .world = cloth->world,
             .placement = cloth->placement,
             .transform = cloth->transform,
             .start = cloth->described_start(),
             .description = cloth->description(),
             .charges = cloth->charges(),
             .runtime = cloth->runtime->Save(),
             .columns = columns,
             .first_row = row};
    entry.runtime.may_cross_itself = backend.MayCrossItself(cloth->runtime->handle());
    bytes += kBytesPerCloth + BytesOf(*entry.description) + entry.runtime.held_bytes();
    row += cloth->runtime->particle_count();
  }
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit, budget.Take(owner, bytes));
  saved.permits.push_back(std::move(permit));
  saved.bytes += bytes;
  return Status::Ok();
}

void HoldParts(const BackendDescription& backend, std::span<SavedCloth> saved) {
  if (!backend.make_shared_parts) return;
  std::map<PartsKind, std::shared_ptr<const void>> of_kinds;
  for (SavedCloth& cloth : saved) {
    const auto& model = cloth.description->model;
    const ClothParameters& parameters = cloth.description->parameters;
    auto& parts = of_kinds[KindOf(*model, parameters)];
    if (parts == nullptr) {
      parts =
          backend.make_shared_parts(model, OnDevice(*model, parameters, cloth.placement), nullptr);
    }
    cloth.parts = parts;
  }
}

Status CheckLoads(const ClothRecord& cloth, const SavedCloth& from, const std::string& field) {
  const auto present = cloth.description();
  const auto refuse = [&](const std::string& why) {
    return Status::InvalidField(field, "cloth " + std::to_string(cloth.id.Packed()) +
                                           " cannot become the saved cloth " +
                                           std::to_string(from.id.Packed()) + ": " + why);
  };
  if (!HaveSameParticles(*present->model, *from.description->model)) {
    return refuse("it is made of other particles");
  }
  if (cloth.placement.origin_in_environment_m != from.placement.origin_in_environment_m) {
    return refuse("it was created at another place of its environment");
  }
  if (present->parameters.max_grips != from.description->parameters.max_grips) {
    return refuse("it has another max_grips");
  }
  if (!HasSettingsOf(cloth, from)) {
    return refuse("it had other settings, and all cloths of a world have the same");
  }
  return Status::Ok();
}

Status LoadOnDevice(Backend& backend, ClothRecord& cloth, const SavedCloth& from) {
  DRAPE_RETURN_IF_ERROR(CheckLoadNow(cloth, from));
  ClothRuntime& runtime = *cloth.runtime;
  RuntimeState state = from.runtime;  // before anything is changed: there may be no memory for it
  DRAPE_RETURN_IF_ERROR(backend.Write(runtime.handle(), UpdateTo(from, cloth)));
  const ClothDescription& description = *from.description;
  runtime.SetModel(description.model);
  runtime.SetShift(ShiftOf(*description.model, description.parameters, cloth.placement));
  runtime.Restore(std::move(state));
  cloth.ReplaceDescription(from.description, from.charges);
  return Status::Ok();
}

Status LoadOnDevice(Backend& backend, std::span<const LoadPair> pairs) {
  for (const LoadPair& pair : pairs) {
    DRAPE_RETURN_IF_ERROR(LoadOnDevice(backend, *pair.into, *pair.from));
  }
  return Status::Ok();
}

Status CheckLoadsNow(std::span<const LoadPair> pairs) {
  for (const LoadPair& pair : pairs) DRAPE_RETURN_IF_ERROR(CheckLoadNow(*pair.into, *pair.from));
  return Status::Ok();
}

}  // namespace drape
