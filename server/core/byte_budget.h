// Limits how many bytes are held for clients at a time, per owner and in all.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/core/status.h"

namespace drape {

// Thread-safe.
class ByteBudget {
 public:
  // The names are those of the settings, for messages.
  struct Limit {
    std::string name;
    uint64_t bytes = 0;
  };

  // Refusals are RESOURCE_EXHAUSTED with `reason`, or DEVICE_MEMORY where the process has no
  // reserve of memory (memory_reserve.h), and retry_after.
  // `most_at_once`: of one Take of one that holds nothing.
  ByteBudget(std::string reason, Limit per_owner, Limit in_all, int64_t retry_after_ms,
             uint64_t most_at_once = UINT64_MAX);

  // Counts until the last copy of the pointer is gone, which may outlive this. An owner that holds
  // something may have its limit, and no more than it leaves free: one alone half of all, each of N
  // its share of N + 1, so that whoever comes next finds room. One that holds nothing may take more
  // at once, since less would never do, up to `most_at_once`; the limit in all holds for everybody.
  Result<std::shared_ptr<void>> Take(const std::string& owner, uint64_t bytes);
  uint64_t used_bytes() const;
  uint64_t used_bytes(const std::string& owner) const;

 private:
  struct Counts;

  Status Refusal(const Limit& limit, uint64_t used, uint64_t wanted) const;

  const std::string reason_;
  const Limit per_owner_;
  const Limit in_all_;
  const int64_t retry_after_ms_;
  const uint64_t most_at_once_;
  const std::shared_ptr<Counts> counts_;
};

}  // namespace drape
