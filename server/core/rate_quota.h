// How much work each tenant may have done per second, and how much it has.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/core/clock.h"

namespace drape {

// Work is in any unit: that of steps is particles * substeps (sleeping and faulted cloths cost
// nothing), that of builders their seconds.
struct RateLimits {
  // [work/s]; 0: no limit.
  double per_tenant = 0;
  // Of tenants that have one of their own; 0: no limit.
  std::unordered_map<std::string, double> of_tenant{};
  // Shares of a full device, of tenants that have others than 1; >= 1.
  std::unordered_map<std::string, uint32_t> weights{};
};

// What one tenant has had done.
struct RateUse {
  std::string tenant;
  double work = 0;         // since the start
  double work_per_s = 0;   // mean of the last seconds, older ones count less
  double limit_per_s = 0;  // 0: none
  int64_t wait_us = 0;     // until its next work may begin
};

// A token bucket per tenant. It is filled at the tenant's rate, up to some seconds of it; work (a
// batch, a build) takes what it was, and may leave a debt, since it can be larger than any bucket.
// A tenant with a debt waits until it is paid, so over any time it has had at most the rate times
// that time, one bucket, and the work in which it ran empty. The empty tenant, of servers
// without tokens, has no limit. Thread-safe.
class RateQuota {
 public:
  // What an idle tenant may save up, by default [s].
  static constexpr double kBucket_s = 1;
  // Over what time a mean rate is taken [s].
  static constexpr double kMean_s = 5;

  // `clock` outlives this.
  explicit RateQuota(const Clock& clock, double bucket_s = kBucket_s)
      : clock_(clock), bucket_s_(bucket_s) {}

  // From now on. Debts stay.
  void Set(RateLimits limits);
  // False: WaitUntil_us never has to be asked.
  bool has_limits() const { return has_limits_.load(std::memory_order_relaxed); }
  double LimitOf(const std::string& tenant) const;
  uint32_t WeightOf(const std::string& tenant) const;

  // So much was done for the tenant.
  void Charge(const std::string& tenant, double work);
  // By the clock, when the debt of the tenant is paid; not after now: it need not wait.
  int64_t WaitUntil_us(const std::string& tenant) const;
  // Of those for whom something was done, by name.
  std::vector<RateUse> Uses() const;

 private:
  struct Bucket {
    double content = 0;  // negative: a debt
    double total = 0;
    double per_s = 0;  // mean
    int64_t at_us = 0;
  };

  // --- With mutex_ held.
  double Limit(const std::string& tenant) const;
  // The bucket as it is now.
  Bucket Now(const Bucket& bucket, double limit_per_s, int64_t now_us) const;
  int64_t DebtPaid_us(const Bucket& bucket, double limit_per_s, int64_t now_us) const;

  const Clock& clock_;
  const double bucket_s_;
  std::atomic<bool> has_limits_{false};
  std::atomic<bool> has_weights_{false};
  mutable std::mutex mutex_;
  RateLimits limits_;
  std::unordered_map<std::string, Bucket> buckets_;
};

}  // namespace drape
