// What is made of a model alone and shared by all cloths that have it.
#pragma once

#include <algorithm>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "server/core/interruption.h"
#include "server/scene/scene_model.h"

namespace drape {

// One Made(model, interruption) per model, for as long as somebody uses it. Thread-safe; who gets
// what is there does not wait for others who make another one.
template <class Made>
class MadePerModel {
 public:
  // `interruption`: of the making; null: nobody is asked.
  std::shared_ptr<const Made> Get(const std::shared_ptr<const SceneModel>& model,
                                  Interruption* interruption = nullptr) {
    if (auto found = Find(model.get())) return found;
    auto made = std::make_shared<const Made>(*model, interruption);
    const std::lock_guard lock(mutex_);
    Entry& entry = entries_[model.get()];
    auto other = entry.model.expired() ? nullptr : entry.made.lock();
    if (other) return other;
    entry = {model, made};
    if (entries_.size() > next_sweep_size_) DropDead();
    return made;
  }

 private:
  struct Entry {
    std::weak_ptr<const SceneModel> model;
    std::weak_ptr<const Made> made;
  };
  // Null: it is not there.
  std::shared_ptr<const Made> Find(const SceneModel* model) const {
    const std::lock_guard lock(mutex_);
    const auto entry = entries_.find(model);
    // Another model may have had this address.
    const bool is_there = entry != entries_.end() && !entry->second.model.expired();
    return is_there ? entry->second.made.lock() : nullptr;
  }

  // Seldom: a look at all entries with each new one would be the square of them in all.
  void DropDead() {
    std::erase_if(entries_, [](const auto& entry) { return entry.second.model.expired(); });
    next_sweep_size_ = std::max<size_t>(64, 2 * entries_.size());
  }

  mutable std::mutex mutex_;
  std::unordered_map<const SceneModel*, Entry> entries_;  // guarded by mutex_, as what follows
  size_t next_sweep_size_ = 64;
};

}  // namespace drape
