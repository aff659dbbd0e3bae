#include "server/core/byte_budget.h"

#include <algorithm>
#include <mutex>
#include <unordered_map>
#include <utility>

#include "server/core/memory_reserve.h"

namespace drape {

struct ByteBudget::Counts {
  mutable std::mutex mutex;
  std::unordered_map<std::string, uint64_t> by_owner;  // owners that hold nothing have no entry
  uint64_t in_all = 0;

  void Release(const std::string& owner, uint64_t bytes) {
    const std::lock_guard lock(mutex);
    in_all -= bytes;
    const auto entry = by_owner.find(owner);
    entry->second -= bytes;
    if (entry->second == 0) by_owner.erase(entry);
  }
};

ByteBudget::ByteBudget(std::string reason, Limit per_owner, Limit in_all, int64_t retry_after_ms,
                       uint64_t most_at_once)
    : reason_(std::move(reason)),
      per_owner_(std::move(per_owner)),
      in_all_(std::move(in_all)),
      retry_after_ms_(retry_after_ms),
      most_at_once_(std::max(most_at_once, per_owner_.bytes)),
      counts_(std::make_shared<Counts>()) {}

Result<std::shared_ptr<void>> ByteBudget::Take(const std::string& owner, uint64_t bytes) {
  if (bytes == 0) return std::shared_ptr<void>();
  if (!MemoryReserve::IsThere()) return OutOfMemory().RetryAfterMs(retry_after_ms_);
  {
    const std::lock_guard lock(counts_->mutex);
    if (bytes > in_all_.bytes || counts_->in_all > in_all_.bytes - bytes) {
      return Refusal(in_all_, counts_->in_all, bytes);
    }
    const auto entry = counts_->by_owner.find(owner);
    const uint64_t held = entry == counts_->by_owner.end() ? 0 : entry->second;
    if (held > 0 && (held >= per_owner_.bytes || bytes > per_owner_.bytes - held)) {
      return Refusal(per_owner_, held, bytes);
    }
    if (bytes > most_at_once_) {
      return Refusal({"what one may take of " + in_all_.name + " at once", most_at_once_}, held,
                     bytes);
    }
    // Dynamic thresholds, as for the places of requests (scheduler_core.cpp).
    const uint64_t free = in_all_.bytes - counts_->in_all;
    if (held > 0 && (held >= free || bytes > free - held)) {
      return Refusal({"what one owner leaves free of " + in_all_.name, free}, held, bytes);
    }
    counts_->by_owner[owner] += bytes;
    counts_->in_all += bytes;
  }
  return std::shared_ptr<void>(
      counts_.get(), [counts = counts_, owner, bytes](void*) { counts->Release(owner, bytes); });
}

uint64_t ByteBudget::used_bytes() const {
  const std::lock_guard lock(counts_->mutex);
  return counts_->in_all;
}

uint64_t ByteBudget::used_bytes(const std::string& owner) const {
  const std::lock_guard lock(counts_->mutex);
  const auto entry = counts_->by_owner.find(owner);
  return entry == counts_->by_owner.end() ? 0 : entry->second;
}

Status ByteBudget::Refusal(const Limit& limit, uint64_t used, uint64_t wanted) const {
  Status status(StatusCode::kResourceExhausted, reason_,
                limit.name + " is " + std::to_string(limit.bytes) + ": " + std::to_string(used) +
                    " bytes are held, " + std::to_string(wanted) + " more wanted");
  // Waiting does not help where it is too much by itself.
  if (wanted <= std::min(per_owner_.bytes, in_all_.bytes) ||
      wanted <= std::min(limit.bytes, most_at_once_)) {
    status.RetryAfterMs(retry_after_ms_);
  }
  return status;
}

}  // namespace drape
