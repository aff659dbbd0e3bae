// The cloths of the backend by handle. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/core/check.h"
#include "server/core/ids.h"
#include "server/solver/gl_compute/gl_cloth.h"

namespace drape {

// A slot is used again under the next generation; stale handles are programmer errors.
class GlClothTable {
 public:
  ClothHandle Add(GlCloth cloth) {
    if (free_slots_.empty()) {
      free_slots_.push_back(static_cast<uint32_t>(slots_.size()));
      slots_.emplace_back();
    }
    const uint32_t slot = free_slots_.back();
    free_slots_.pop_back();
    slots_[slot].cloth = std::move(cloth);
    return {slot, ++slots_[slot].generation};
  }

  void Remove(ClothHandle handle) {
    Find(handle);
    slots_[handle.slot].cloth.reset();
    free_slots_.push_back(handle.slot);
  }

  GlCloth& Find(ClothHandle handle) {
    DRAPE_CHECK(handle.slot < slots_.size() && slots_[handle.slot].cloth &&
                    slots_[handle.slot].generation == handle.generation,
                "no such cloth");
    return *slots_[handle.slot].cloth;
  }

  GlCloth& AtSlot(uint32_t slot) { return *slots_[slot].cloth; }
  size_t count() const { return slots_.size() - free_slots_.size(); }
  // The next new cloth's slot is at most this.
  size_t slot_count() const { return slots_.size(); }

 private:
  struct Slot {
    std::optional<GlCloth> cloth;
    uint32_t generation = 0;
  };
  std::vector<Slot> slots_;
  std::vector<uint32_t> free_slots_;
};

}  // namespace drape
