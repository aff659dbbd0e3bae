// What the sessions of each tenant have together.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/core/status.h"

namespace drape {

// 0: no limit.
struct TenantLimits {
  uint32_t max_sessions = 0;
  uint64_t max_cloths = 0;
  uint64_t max_particles = 0;
};

// Thread-safe. The empty tenant, of servers without tokens, has no limits.
class TenantQuota {
 public:
  struct Amount {
    uint64_t sessions = 0;
    uint64_t cloths = 0;
    uint64_t particles = 0;
  };

  explicit TenantQuota(const TenantLimits& limits) : limits_(limits) {}

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) names the limit; nothing is taken then.
  Status Take(const std::string& tenant, const Amount& amount);
  void GiveBack(const std::string& tenant, const Amount& amount);
  Amount UsedBy(const std::string& tenant) const;

 private:
  const TenantLimits limits_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Amount> used_;  // tenants that have nothing have no entry
};

}  // namespace drape
