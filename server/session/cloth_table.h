// All cloths of the server by id.
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

// One table for all sessions, so that an id is never valid in two of them. A slot is reused with
// the next generation, and never again after the last one. Thread-safe.
class ClothTable {
 public:
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
    uint32_t generation = 0;  // of the current or last occupant
    std::shared_ptr<ClothRecord> record;
  };

  mutable std::mutex mutex_;
  std::vector<Slot> slots_;
  std::vector<uint32_t> free_slots_;
  uint64_t next_creation_number_ = 1;
  size_t size_ = 0;
};

}  // namespace drape
