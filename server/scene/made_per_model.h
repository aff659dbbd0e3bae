// What is made of a model alone and shared by all cloths that have it.
#pragma once

#include <memory>
#include <mutex>
#include <unordered_map>

#include "server/scene/scene_model.h"

namespace drape {

// One Made(model) per model, for as long as somebody uses it. Thread-safe; who gets what is there
// does not wait for others who make another one.
template <class Made>
class MadePerModel {
 public:
  std::shared_ptr<const Made> Get(const std::shared_ptr<const SceneModel>& model) {
    if (auto found = Find(model.get())) return found;
    auto made = std::make_shared<const Made>(*model);
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [](const auto& entry) { return entry.second.model.expired(); });
    Entry& entry = entries_[model.get()];
    if (auto other = entry.made.lock()) return other;
    entry = {model, made};
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

  mutable std::mutex mutex_;
  std::unordered_map<const SceneModel*, Entry> entries_;
};

}  // namespace drape
