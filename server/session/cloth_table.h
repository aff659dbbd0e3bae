// The cloths of a session by id.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/session/cloth_record.h"

namespace drape {

// Which ids a session has issued: as much of its table as keeps them from being issued again.
struct IssuedIds {
  ClothId origin;
  std::vector<uint32_t> generations;  // of the slots, from that of the origin on
  // How many runs of the server may have issued ids that are not among the generations, since they
  // went back to an earlier time.
  uint32_t returns = 0;
};

// A slot is reused with the next generation, and never again after the last one. Thread-safe.
class ClothTable {
 public:
  // Slots and generations of ids count from those of `origin` on: with a random one they tell
  // nothing about other sessions, and an id of theirs is as good as never valid here.
  explicit ClothTable(ClothId origin = {}) : origin_(origin), returns_(0) {}

  // A table that has issued these ids; they are of cloths no longer.
  explicit ClothTable(IssuedIds issued);

  IssuedIds issued() const;
  // Whether this table has issued `id`, and no later one of its slot, and no cloth has it.
  bool CanReturn(ClothId id) const;
  // Each of the records has an id that CanReturn; no two the same. Sets the rest.
  void Return(std::span<const std::shared_ptr<ClothRecord>> records,
              const std::string& session_name);
  // Sets id, session_name and creation_number of each record, in order.
  void Add(std::span<const std::shared_ptr<ClothRecord>> records, const std::string& session_name);
  // The record of `id` if it belongs to the session. Null for another session's id, a stale id and
  // an unknown id.
  std::shared_ptr<ClothRecord> Find(ClothId id, const std::string& session_name) const;
  // Unknown ids are ignored.
  void Remove(std::span<const std::shared_ptr<ClothRecord>> records);
  size_t size() const;

 private:
  struct Slot {
    uint32_t generation = 0;  // of the current or last occupant, from that of origin_ on
    std::shared_ptr<ClothRecord> record;
  };

  // mutex_ held.
  void Occupy(const std::shared_ptr<ClothRecord>& record, const std::string& session_name);
  uint32_t SlotOf(ClothId id) const { return id.slot - origin_.slot; }

  // After each return generations begin higher than those that were issued meanwhile, unless a slot
  // was taken that often in one interval of checkpoints. 2^31 leaves room for those of the origin.
  static constexpr uint32_t kGenerationsPerReturn = 1u << 20;
  static constexpr uint32_t kMostReturns = 2047;

  const ClothId origin_;
  const uint32_t returns_;
  mutable std::mutex mutex_;
  std::vector<Slot> slots_;
  std::vector<uint32_t> free_slots_;
  uint64_t next_creation_number_ = 1;
  size_t size_ = 0;
};

}  // namespace drape
