#include "server/session/model_cache.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace drape {

std::shared_ptr<const SceneModel> ModelCache::Share(std::shared_ptr<const SceneModel> model) {
  // Released after the lock: this may be the last owner of a large model.
  std::vector<std::shared_ptr<const SceneModel>> looked_at;
  const std::lock_guard lock(mutex_);
  const auto [begin, end] = models_.equal_range(model->content_hash());
  for (auto entry = begin; entry != end; ++entry) {
    looked_at.push_back(entry->second.lock());
    if (looked_at.back() != nullptr && looked_at.back()->SameContent(*model)) {
      return looked_at.back();
    }
  }
  models_.emplace(model->content_hash(), model);
  if (models_.size() > next_sweep_size_) DropDead();
  return model;
}

void ModelCache::DropDead() {
  std::erase_if(models_, [](const auto& entry) { return entry.second.expired(); });
  next_sweep_size_ = std::max<size_t>(64, 2 * models_.size());
}

size_t ModelCache::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(std::count_if(
      models_.begin(), models_.end(), [](const auto& entry) { return !entry.second.expired(); }));
}

}  // namespace drape
