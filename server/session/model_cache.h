// Scene models of equal content are one object, and count for those who have them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/core/byte_budget.h"
#include "server/scene/scene_model.h"

namespace drape {

// What a model, or a description, takes in memory, but for what is small [bytes].
uint64_t SizeOf_bytes(const SceneModel& model);
uint64_t SizeOf_bytes(const ModelDescription& description);

// A model and its description count for their owner while the charge exists: each once, however
// many cloths hold it.
struct SharedModel {
  std::shared_ptr<const SceneModel> model;
  std::shared_ptr<const void> charge;
};

// Keeps no model alive. Thread-safe.
class ModelCache {
 public:
  // The models of all owners take at most so much memory, those of one at most half of it [bytes].
  explicit ModelCache(uint64_t max_bytes);

  // A live model of the same content if there is one; otherwise `model`, which is shared from now
  // on. `description`, of which it was built, counts too, if there is one, but is not shared:
  // others may make the same model. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) if it is too much for
  // `owner`.
  Result<SharedModel> Share(const std::string& owner, std::shared_ptr<const SceneModel> model,
                            std::shared_ptr<const ModelDescription> description = nullptr);
  // For what a cloth has of its own beside its model, as long as the result exists: rest lengths;
  // colliders. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED).
  Result<std::shared_ptr<const void>> ChargeLengths(const std::string& owner, uint32_t count);
  Result<std::shared_ptr<const void>> ChargeColliders(const std::string& owner, uint32_t count);
  // Live models.
  size_t size() const;

 private:
  std::shared_ptr<const SceneModel> Find(std::shared_ptr<const SceneModel> model);
  // For an object of the owner, once.
  Result<std::shared_ptr<const void>> Charge(const std::string& owner,
                                             std::shared_ptr<const void> object, uint64_t bytes);
  void DropDead();

  ByteBudget budget_;
  mutable std::mutex mutex_;
  uint64_t additions_ = 0;                                                     // to models_
  std::unordered_multimap<uint64_t, std::weak_ptr<const SceneModel>> models_;  // by content hash
  std::map<std::pair<std::string, const void*>, std::weak_ptr<const void>> charges_;
  // Dead entries are dropped when there are more of either than this.
  size_t next_sweep_size_ = 64;
};

}  // namespace drape
