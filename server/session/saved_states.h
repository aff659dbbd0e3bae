// States of cloths that are kept, to go back to or to branch from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/core/byte_budget.h"
#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/scheduler/cloth_runtime.h"
#include "server/session/cloth_record.h"
#include "server/solver/backend.h"

namespace drape {

// A cloth as it was between two steps: enough to go on with the same bits. Immutable.
struct SavedCloth {
  ClothId id;
  std::string world{};  // ClothRecord::world
  Placement placement{};
  RigidTransform transform{};
  std::shared_ptr<const ClearStart> start{};  // ClothRecord::described_start
  std::shared_ptr<const ClothDescription> description{};
  ClothCharges charges{};  // of the description
  // Of an import, for ClothRecord::held_lengths, where they are driven, and held_colliders.
  std::shared_ptr<const void> length_charge{};
  std::shared_ptr<const void> collider_charge{};
  RuntimeState runtime{};
  std::shared_ptr<const void> parts{};  // of HoldParts
  // Its particles are rows [first_row, first_row + particle_count), at the precision of the
  // backend.
  std::shared_ptr<const StateColumns> columns{};
  size_t first_row = 0;
};

// Cloths that were saved together.
struct SavedStates {
  std::vector<SavedCloth> cloths;
  uint64_t bytes = 0;
  std::vector<std::shared_ptr<void>> permits{};  // for the bytes
};

// A cloth, and what it is to become.
struct LoadPair {
  std::shared_ptr<ClothRecord> into;
  const SavedCloth* from;
};

// How many of the cloths one command takes: as many of their largest as fit (sliced_command.h).
size_t ClothsPerSlice(std::span<const std::shared_ptr<ClothRecord>> cloths);

// SliceCost (start_cost.h).
uint64_t SliceCostOf(const SavedCloth& from);

// Appends the cloths as they are now. NOT_FOUND if one was deleted; RESOURCE_EXHAUSTED when the
// budget of `owner` does not suffice. Device thread.
Status SaveOnDevice(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                    ByteBudget& budget, const std::string& owner, SavedStates& saved);

// Holds what the cloths, which live, share of the backend, so that nobody must make it anew for one
// that becomes a saved one when all others have changed. Device thread.
void HoldParts(const BackendDescription& backend, std::span<SavedCloth> saved);

// Whether `cloth` can become `from`: the same particles at the same place of its environment, and
// as many grips; in a world also the same settings, which all its cloths have. INVALID_ARGUMENT
// (`field`) tells why not. Any thread.
Status CheckLoads(const ClothRecord& cloth, const SavedCloth& from, const std::string& field);

// The cloth becomes `from`, which CheckLoads has accepted: particles, step, time, controls under
// way, grips, sleep, budget, fault, pins, model and parameters. RESOURCE_EXHAUSTED when the device
// has no room; nothing changes then. Device thread.
Status LoadOnDevice(Backend& backend, ClothRecord& cloth, const SavedCloth& from);

// The same for several cloths, one after the other, until one fails. Device thread.
Status LoadOnDevice(Backend& backend, std::span<const LoadPair> pairs);

// What may have changed since CheckLoads: NOT_FOUND, INVALID_ARGUMENT ("cloth_ids"). Afterwards
// LoadOnDevice fails only where the device has no room. Device thread.
Status CheckLoadsNow(std::span<const LoadPair> pairs);

// Its particles, in the cloth frame.
ParticleState ParticlesOf(const SavedCloth& from);

// SAVED_STATES_NOT_FOUND.
Status SavedStatesNotFound(const std::string& name);

}  // namespace drape
