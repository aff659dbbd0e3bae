#include "server/session/cloth_table.h"

#include <algorithm>
#include <limits>

namespace drape {

ClothTable::ClothTable(IssuedIds issued)
    : origin_(issued.origin), returns_(std::min(issued.returns, kMostReturns)) {
  for (const uint32_t generation : issued.generations) slots_.push_back({generation, nullptr});
  for (uint32_t slot = 0; slot < slots_.size(); ++slot) {
    if (slots_[slot].generation < std::numeric_limits<uint32_t>::max()) free_slots_.push_back(slot);
  }
}

IssuedIds ClothTable::issued() const {
  const std::lock_guard lock(mutex_);
  IssuedIds issued{.origin = origin_, .generations = {}, .returns = returns_};
  for (const Slot& slot : slots_) issued.generations.push_back(slot.generation);
  return issued;
}

bool ClothTable::CanReturn(ClothId id) const {
  const std::lock_guard lock(mutex_);
  if (SlotOf(id) >= slots_.size()) return false;
  const Slot& slot = slots_[SlotOf(id)];
  return slot.record == nullptr && slot.generation > 0 &&
         slot.generation == id.generation - origin_.generation;
}

void ClothTable::Return(std::span<const std::shared_ptr<ClothRecord>> records,
                        const std::string& session_name) {
  const std::lock_guard lock(mutex_);
  for (const auto& record : records) Occupy(record, session_name);
  std::erase_if(free_slots_, [&](uint32_t slot) { return slots_[slot].record != nullptr; });
  size_ += records.size();
}

void ClothTable::Occupy(const std::shared_ptr<ClothRecord>& record,
                        const std::string& session_name) {
  record->session_name = session_name;
  record->creation_number = next_creation_number_++;
  slots_[SlotOf(record->id)].record = record;
}

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
    uint32_t& generation = slots_[slot].generation;
    generation = std::max(generation, returns_ * kGenerationsPerReturn) + 1;
    record->id = {origin_.slot + slot, origin_.generation + generation};
    Occupy(record, session_name);
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
