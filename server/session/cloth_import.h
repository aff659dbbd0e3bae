// Cloths that were saved, made anew.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "server/session/cloth_record.h"
#include "server/session/saved_states.h"
#include "server/solver/backend.h"

namespace drape {

// Makes cloths that go on from what was saved, in order. Device thread, except the constructor.
class ImportMaker {
 public:
  explicit ImportMaker(std::vector<SavedCloth> cloths) : cloths_(std::move(cloths)) {}

  size_t cloth_count() const { return cloths_.size(); }
  // Creates cloths [begin, end) on the backend. After an error, earlier cloths remain.
  Status Make(Backend& backend, size_t begin, size_t end);
  const std::vector<std::shared_ptr<ClothRecord>>& made() const { return made_; }
  // For FreeInSlices, where they are not wanted. Nothing is made, or charged, afterwards.
  std::vector<std::shared_ptr<ClothRecord>> TakeMade() {
    cloths_.clear();
    return std::exchange(made_, {});
  }

 private:
  Status MakeOne(Backend& backend, const SavedCloth& from);

  std::vector<SavedCloth> cloths_;
  std::vector<std::shared_ptr<ClothRecord>> made_;
};

// Preparation of them. Not on the device thread.
SharedParts PrepareImport(std::span<const SavedCloth> cloths, const BackendDescription& backend,
                          Interruption* interruption = nullptr);

}  // namespace drape
