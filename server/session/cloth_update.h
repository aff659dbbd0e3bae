// Changing live cloths: all of them or none.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/model_change.h"
#include "server/solver/backend.h"

namespace drape {

struct PlannedUpdate;

// A change of several cloths, of all or of none: Begin, Write of consecutive ranges that cover all,
// Commit of the same; after an error instead TakeBack of what was written, and Error. No step of
// them, and no other change, comes between. Device thread, except the constructor.
class ClothUpdater {
 public:
  // `models`: [cloth_count] if change.needs_model(), otherwise empty.
  ClothUpdater(std::vector<std::shared_ptr<ClothRecord>> cloths, ClothChange change,
               std::vector<ChangedModel> models = {}, ModelRules rules = {});
  ~ClothUpdater();

  const std::vector<std::shared_ptr<ClothRecord>>& cloths() const { return cloths_; }
  // NOT_FOUND if one of them was deleted. INVALID_ARGUMENT if only a part of a world would change.
  Status Begin() const;
  // Plans the changes of the range and gives them to the device. ABORTED (UPDATE_CONFLICT) if a
  // model was made for a description that another update has replaced since: build it again.
  // INVALID_ARGUMENT for values that are illegal together; the errors of `rules.accept`, and of the
  // device.
  Status Write(Backend& backend, size_t begin, size_t end);
  // From now on the cloths of the range are what was written.
  void Commit(size_t begin, size_t end);
  // Cloths that the device has got; afterwards those that TakeBack has left.
  size_t written() const { return written_; }
  // Takes back the last `count` of them, the last one first, so that the device frees its room in
  // reverse order. A cloth for which it has no room then ends and is freed (step requests that name
  // it end with RESOURCE_EXHAUSTED, DEVICE_MEMORY).
  void TakeBack(Backend& backend, size_t count);
  // `status`, and how many cloths had to end.
  Status Error(const Status& status) const;

 private:
  const std::vector<std::shared_ptr<ClothRecord>> cloths_;
  const ClothChange change_;
  const std::vector<ChangedModel> models_;
  const ModelRules rules_;
  std::vector<std::unique_ptr<PlannedUpdate>> plans_;  // of the cloths so far, until Commit
  size_t written_ = 0;
  size_t ended_ = 0;
};

// The same at once, of few cloths.
Status UpdateOnDevice(Backend& backend, std::vector<std::shared_ptr<ClothRecord>> cloths,
                      const ClothChange& change);

// Preparation of the cloths as they will be.
SharedParts PrepareUpdate(std::span<const std::shared_ptr<ClothRecord>> cloths,
                          const ClothChange& change, std::span<const ChangedModel> models,
                          const BackendDescription& backend, Interruption* interruption = nullptr);

// The reason of the error of an update that came too late.
inline constexpr char kUpdateConflict[] = "UPDATE_CONFLICT";

}  // namespace drape
