// Cloths that are not stepped while work of several commands is done on them.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/core/check.h"
#include "server/session/cloth_record.h"

namespace drape {

// Device thread. Released before it is destroyed; the commands of one owner come one after the
// other (RunAsOne), so no cloth is held twice.
class ClothHold {
 public:
  ClothHold() = default;
  ~ClothHold() { DRAPE_CHECK(held_.empty(), "what was held is released"); }
  ClothHold(const ClothHold&) = delete;
  ClothHold& operator=(const ClothHold&) = delete;

  void Take(const ClothRecord& cloth) {
    cloth.runtime->Hold();
    held_.push_back(cloth.runtime);
  }
  void Take(std::span<const std::shared_ptr<ClothRecord>> cloths) {
    held_.reserve(cloths.size());
    for (const auto& cloth : cloths) Take(*cloth);
  }
  void Release() {
    for (const auto& cloth : held_) cloth->Release();
    held_.clear();
  }

 private:
  std::vector<std::shared_ptr<ClothRuntime>> held_;
};

}  // namespace drape
