#include "server/core/rate_quota.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace drape {

void RateQuota::Set(RateLimits limits) {
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  for (auto& [tenant, bucket] : buckets_) bucket = Now(bucket, Limit(tenant), now_us);
  limits_ = std::move(limits);
  for (auto& [tenant, bucket] : buckets_) {
    bucket.content = std::min(bucket.content, bucket_s_ * Limit(tenant));
  }
  has_weights_ = !limits_.weights.empty();
  has_limits_ =
      limits_.per_tenant > 0 || std::any_of(limits_.of_tenant.begin(), limits_.of_tenant.end(),
                                            [](const auto& entry) { return entry.second > 0; });
}

uint32_t RateQuota::WeightOf(const std::string& tenant) const {
  if (!has_weights_.load(std::memory_order_relaxed)) return 1;
  const std::lock_guard lock(mutex_);
  const auto own = limits_.weights.find(tenant);
  return own == limits_.weights.end() ? 1 : own->second;
}

double RateQuota::Limit(const std::string& tenant) const {
  if (tenant.empty()) return 0;
  const auto own = limits_.of_tenant.find(tenant);
  return own == limits_.of_tenant.end() ? limits_.per_tenant : own->second;
}

double RateQuota::LimitOf(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  return Limit(tenant);
}

RateQuota::Bucket RateQuota::Now(const Bucket& bucket, double limit_per_s, int64_t now_us) const {
  const double passed_s = static_cast<double>(now_us - bucket.at_us) / 1e6;
  Bucket now = bucket;
  now.content = std::min(bucket.content + limit_per_s * passed_s, bucket_s_ * limit_per_s);
  // Without a limit there is no debt, neither later, when it may have one.
  if (limit_per_s == 0) now.content = 0;
  now.per_s = bucket.per_s * std::exp(-passed_s / kMean_s);
  now.at_us = now_us;
  return now;
}

void RateQuota::Charge(const std::string& tenant, double work) {
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  const double limit_per_s = Limit(tenant);
  const auto [entry, is_new] = buckets_.try_emplace(tenant);
  if (is_new) entry->second = {bucket_s_ * limit_per_s, 0, 0, now_us};
  Bucket bucket = Now(entry->second, limit_per_s, now_us);
  if (limit_per_s > 0) bucket.content -= work;
  bucket.total += work;
  bucket.per_s += work / kMean_s;
  entry->second = bucket;
}

int64_t RateQuota::DebtPaid_us(const Bucket& bucket, double limit_per_s, int64_t now_us) const {
  const double debt = -Now(bucket, limit_per_s, now_us).content;
  if (limit_per_s == 0 || debt <= 0) return now_us;
  // Rounded up: at that time it is paid.
  return now_us + static_cast<int64_t>(std::ceil(std::min(debt / limit_per_s * 1e6, 1e15))) + 1;
}

int64_t RateQuota::WaitUntil_us(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  const auto bucket = buckets_.find(tenant);
  if (bucket == buckets_.end()) return now_us;
  return DebtPaid_us(bucket->second, Limit(tenant), now_us);
}

std::vector<RateUse> RateQuota::Uses() const {
  std::vector<RateUse> uses;
  const std::lock_guard lock(mutex_);
  const int64_t now_us = clock_.NowUs();
  for (const auto& [tenant, bucket] : buckets_) {
    const double limit_per_s = Limit(tenant);
    const Bucket now = Now(bucket, limit_per_s, now_us);
    uses.push_back({tenant, now.total, now.per_s, limit_per_s,
                    DebtPaid_us(bucket, limit_per_s, now_us) - now_us});
  }
  std::sort(uses.begin(), uses.end(),
            [](const RateUse& a, const RateUse& b) { return a.tenant < b.tenant; });
  return uses;
}

}  // namespace drape
