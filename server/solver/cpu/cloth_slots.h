// Places of cloths, with generations, so that a stale handle is noticed.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "server/core/ids.h"

namespace drape::cpu {

// Freed slots are reused, last freed first. One thread.
template <class Cloth>
class ClothSlots {
 public:
  ClothHandle Add(Cloth cloth) {
    if (free_.empty()) {
      free_.push_back(static_cast<uint32_t>(slots_.size()));
      slots_.emplace_back();
    }
    Slot& slot = slots_[free_.back()];
    slot.cloth = std::move(cloth);
    slot.is_used = true;
    ++slot.generation;
    const ClothHandle handle{free_.back(), slot.generation};
    free_.pop_back();
    return handle;
  }

  void Remove(ClothHandle handle) {
    At(handle) = Cloth{};
    slots_[handle.slot].is_used = false;
    free_.push_back(handle.slot);
  }

  Cloth& At(ClothHandle handle) {
    DRAPE_CHECK(handle.slot < slots_.size() && slots_[handle.slot].is_used &&
                    slots_[handle.slot].generation == handle.generation,
                "no cloth has this handle");
    return slots_[handle.slot].cloth;
  }

 private:
  struct Slot {
    Cloth cloth;
    uint32_t generation = 0;
    bool is_used = false;
  };
  std::deque<Slot> slots_;  // they stay in place: a long step keeps pointers
  std::vector<uint32_t> free_;
};

}  // namespace drape::cpu
