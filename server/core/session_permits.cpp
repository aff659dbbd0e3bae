#include "server/core/session_permits.h"

#include <algorithm>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace drape {

struct SessionPermits::Counts {
  std::mutex mutex;
  std::unordered_map<std::string, uint32_t> by_session;  // sessions without permits have no entry
  std::unordered_map<std::string, uint32_t> by_owner;    // nor owners
  uint32_t in_all = 0;

  void Release(const std::string& session, const std::string& tenant) {
    const std::lock_guard lock(mutex);
    --in_all;
    if (const auto entry = by_owner.find(tenant.empty() ? session : tenant);
        entry != by_owner.end()) {
      if (--entry->second == 0) by_owner.erase(entry);
    }
    const auto entry = by_session.find(session);
    if (--entry->second == 0) by_session.erase(entry);
  }
};

SessionPermits::SessionPermits(std::string reason, PermitLimit per_session,
                               std::optional<PermitLimit> in_all,
                               std::optional<int64_t> retry_after_ms)
    : reason_(std::move(reason)),
      per_session_(std::move(per_session)),
      in_all_(std::move(in_all)),
      retry_after_ms_(retry_after_ms),
      counts_(std::make_shared<Counts>()) {}

Result<std::shared_ptr<void>> SessionPermits::Take(const std::string& session,
                                                   const std::string& tenant) {
  {
    const std::lock_guard lock(counts_->mutex);
    if (in_all_ && counts_->in_all >= in_all_->value) return Refusal(*in_all_);
    const auto entry = counts_->by_session.find(session);
    const uint32_t taken = entry == counts_->by_session.end() ? 0 : entry->second;
    if (!session.empty() && taken >= per_session_.value) return Refusal(per_session_);
    const std::string& owner = tenant.empty() ? session : tenant;
    if (in_all_ && !owner.empty()) {
      // Dynamic thresholds, as for the places of requests (scheduler_core.cpp).
      const PermitLimit free{"what one owner leaves free of " + in_all_->name,
                             in_all_->value - counts_->in_all};
      const auto of_owner = counts_->by_owner.find(owner);
      if (of_owner != counts_->by_owner.end() && of_owner->second >= free.value) {
        return Refusal(free);
      }
      ++counts_->by_owner[owner];
    }
    ++counts_->by_session[session];
    ++counts_->in_all;
  }
  return std::shared_ptr<void>(counts_.get(), [counts = counts_, session, tenant](void*) {
    counts->Release(session, tenant);
  });
}

Status SessionPermits::Refusal(const PermitLimit& limit) const {
  Status status(StatusCode::kResourceExhausted, reason_,
                "the limit is reached: " + limit.name + " is " + std::to_string(limit.value));
  if (retry_after_ms_.has_value()) status.RetryAfterMs(*retry_after_ms_);
  return status;
}

}  // namespace drape
