// Scene models of equal content are one object.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "server/scene/scene_model.h"

namespace drape {

// Keeps no model alive. Thread-safe.
class ModelCache {
 public:
  // A live model of the same content if there is one; otherwise `model`, which is shared from now
  // on.
  std::shared_ptr<const SceneModel> Share(std::shared_ptr<const SceneModel> model);
  // Live models.
  size_t size() const;

 private:
  void DropDead();

  mutable std::mutex mutex_;
  std::unordered_multimap<uint64_t, std::weak_ptr<const SceneModel>> models_;  // by content hash
  size_t next_sweep_size_ = 64;  // dead entries are dropped when there are more entries than this
};

}  // namespace drape
