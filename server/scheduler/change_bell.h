// Which of the cloths that somebody watches have changed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace drape {

// Rung by the cloths themselves (ClothRuntime::Watch), so that nobody looks at those that rest.
// Device thread only.
class ChangeBell {
 public:
  explicit ChangeBell(size_t cloths) : has_rung_(cloths, false) {}

  void Ring(uint32_t cloth) {
    if (has_rung_[cloth]) return;
    has_rung_[cloth] = true;
    changed_.push_back(cloth);
  }
  // Those that have rung since the last call, in order.
  std::vector<uint32_t> Take() {
    for (const uint32_t cloth : changed_) has_rung_[cloth] = false;
    std::sort(changed_.begin(), changed_.end());
    return std::exchange(changed_, {});
  }

 private:
  std::vector<bool> has_rung_;
  std::vector<uint32_t> changed_;
};

}  // namespace drape
