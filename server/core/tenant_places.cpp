#include "server/core/tenant_places.h"

#include <mutex>
#include <unordered_map>
#include <utility>

namespace drape {

struct TenantPlaces::Counts {
  std::mutex mutex;
  std::unordered_map<std::string, uint32_t> by_tenant;  // none at zero
  uint32_t in_all = 0;

  void Release(const std::string& tenant) {
    const std::lock_guard lock(mutex);
    --in_all;
    const auto entry = by_tenant.find(tenant);
    if (--entry->second == 0) by_tenant.erase(entry);
  }
};

TenantPlaces::TenantPlaces(std::string reason, PlaceLimit per_tenant,
                           std::optional<PlaceLimit> in_all, std::optional<int64_t> retry_after_ms)
    : reason_(std::move(reason)),
      per_tenant_(std::move(per_tenant)),
      in_all_(std::move(in_all)),
      retry_after_ms_(retry_after_ms),
      counts_(std::make_shared<Counts>()) {}

Result<std::shared_ptr<void>> TenantPlaces::Take(const std::string& tenant) {
  {
    const std::lock_guard lock(counts_->mutex);
    if (in_all_ && counts_->in_all >= in_all_->value) return Refusal(*in_all_);
    const auto entry = counts_->by_tenant.find(tenant);
    const uint32_t taken = entry == counts_->by_tenant.end() ? 0 : entry->second;
    if (!tenant.empty() && taken >= per_tenant_.value) return Refusal(per_tenant_);
    ++counts_->by_tenant[tenant];
    ++counts_->in_all;
  }
  return std::shared_ptr<void>(counts_.get(),
                               [counts = counts_, tenant](void*) { counts->Release(tenant); });
}

Status TenantPlaces::Refusal(const PlaceLimit& limit) const {
  Status status(StatusCode::kResourceExhausted, reason_,
                "no place is free: " + limit.name + " is " + std::to_string(limit.value));
  if (retry_after_ms_.has_value()) status.RetryAfterMs(*retry_after_ms_);
  return status;
}

}  // namespace drape
