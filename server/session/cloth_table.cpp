#include "server/session/cloth_table.h"

#include <limits>

namespace drape {

void ClothTable::Add(std::span<const std::shared_ptr<ClothRecord>> records,
                     const std::string& session_name) {
  const std::lock_guard lock(mutex_);
  for (const auto& record : records) {
    uint32_t slot = 0;
    if (free_slots_.empty()) {
      slot = static_cast<uint32_t>(slots_.size());
      slots_.emplace_back();
    } else {
      slot = free_slots_.back();
      free_slots_.pop_back();
    }
    record->id = {origin_.slot + slot, origin_.generation + ++slots_[slot].generation};
    record->session_name = session_name;
    record->creation_number = next_creation_number_++;
    slots_[slot].record = record;
  }
  size_ += records.size();
}

std::shared_ptr<ClothRecord> ClothTable::Find(ClothId id, const std::string& session_name) const {
  const std::lock_guard lock(mutex_);
  if (SlotOf(id) >= slots_.size()) return nullptr;
  const Slot& slot = slots_[SlotOf(id)];
  if (slot.generation != id.generation - origin_.generation || slot.record == nullptr ||
      slot.record->session_name != session_name) {
    return nullptr;
  }
  return slot.record;
}

void ClothTable::Remove(std::span<const std::shared_ptr<ClothRecord>> records) {
  const std::lock_guard lock(mutex_);
  for (const auto& record : records) {
    if (SlotOf(record->id) >= slots_.size()) continue;
    Slot& slot = slots_[SlotOf(record->id)];
    if (slot.record != record) continue;
    slot.record = nullptr;
    if (slot.generation < std::numeric_limits<uint32_t>::max()) {
      free_slots_.push_back(SlotOf(record->id));
    }
    --size_;
  }
}

size_t ClothTable::size() const {
  const std::lock_guard lock(mutex_);
  return size_;
}

}  // namespace drape
