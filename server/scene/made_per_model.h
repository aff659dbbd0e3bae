// What is made of a model alone and shared by all cloths that have it.
#pragma once

#include <memory>
#include <unordered_map>

#include "server/scene/scene_model.h"

namespace drape {

// One Made(model) per model, for as long as somebody uses it. One thread.
template <class Made>
class MadePerModel {
 public:
  std::shared_ptr<const Made> Get(const std::shared_ptr<const SceneModel>& model) {
    std::erase_if(entries_, [](const auto& entry) { return entry.second.model.expired(); });
    Entry& entry = entries_[model.get()];
    std::shared_ptr<const Made> made = entry.made.lock();
    if (made == nullptr) {
      made = std::make_shared<const Made>(*model);
      entry = {model, made};
    }
    return made;
  }

 private:
  struct Entry {
    std::weak_ptr<const SceneModel> model;
    std::weak_ptr<const Made> made;
  };
  std::unordered_map<const SceneModel*, Entry> entries_;
};

}  // namespace drape
