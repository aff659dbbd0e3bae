// Cloths on the device: creating and resetting them.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/scheduler/scheduler.h"
#include "server/session/cloth_record.h"
#include "server/solver/backend.h"

namespace drape {

// Makes the copies of one ClothCreation, in order. Device thread, except the constructor.
class ClothMaker {
 public:
  // `model` replaces creation.model: the shared one of equal content. `plan` is how the backend
  // steps it (BackendDescription::plan_of).
  ClothMaker(ClothCreation creation, std::shared_ptr<const SceneModel> model, std::string plan);

  const ClothCreation& creation() const { return creation_; }
  const std::shared_ptr<const SceneModel>& model() const { return model_; }
  const std::string& plan() const { return plan_; }
  // Creates copies [begin, end) on the backend. After an error, earlier copies remain.
  Status Make(Backend& backend, size_t begin, size_t end);
  const std::vector<std::shared_ptr<ClothRecord>>& made() const { return made_; }
  // For FreeInSlices, where they are not wanted. Nothing is made afterwards.
  std::vector<std::shared_ptr<ClothRecord>> TakeMade() { return std::exchange(made_, {}); }

 private:
  Status MakeOne(Backend& backend, const ClothCopy& copy);

  const ClothCreation creation_;
  const std::shared_ptr<const SceneModel> model_;
  std::vector<Pin> pins_;  // sorted by particle
  const std::string plan_;
  std::vector<std::shared_ptr<ClothRecord>> made_;
};

// Preparation of the copies. Not on the device thread.
void PrepareCloths(ClothCreation& creation, const BackendDescription& backend,
                   Interruption* interruption = nullptr);

// Ends the cloth and frees it on the backend; step requests that name it end with `reason` (without
// one: CLOTH_NOT_FOUND). No effect if it has ended already. Device thread.
void FreeCloth(Backend& backend, ClothRecord& cloth);
void FreeCloth(Backend& backend, ClothRecord& cloth, const Status& reason);

// The same for several.
void FreeCloths(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths);
// The same in slices, as RunAsOne does it, whatever waits; then `finish`, on the device thread.
// False after Drain, when there are no cloths any more: it calls nothing. Any thread.
[[nodiscard]] bool FreeInSlices(Scheduler& scheduler, const std::string& owner,
                                std::vector<std::shared_ptr<ClothRecord>> cloths,
                                std::function<void(Backend&)> finish);

// Writes the initial state, or that where `transform` places the rest shape; the cloth is alive.
// Device thread.
Status ResetCloth(Backend& backend, ClothRecord& cloth, const RigidTransform* transform = nullptr);

// CLOTH_NOT_FOUND.
Status ClothNotFound(ClothId id);

// The pins of a description by the particles of its model, sorted, as ClothDescription requires. Of
// those of one particle (merged vertices) the first counts.
std::vector<Pin> PinsOf(const SceneModel& model, std::vector<Pin> described);

}  // namespace drape
