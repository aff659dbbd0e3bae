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

// Thread-safe. The empty tenant, of servers without tokens, has no limits but that of all states.
class TenantQuota {
 public:
  struct Amount {
    uint64_t sessions = 0;
    uint64_t cloths = 0;
    uint64_t particles = 0;
    uint64_t world_particles = 0;  // those of `particles` whose cloths are in worlds

    void AddParticles(uint64_t count, bool are_in_world) {
      particles += count;
      if (are_in_world) world_particles += count;
    }
  };

  // `max_state_bytes`: of the states of all tenants (SessionLimits).
  explicit TenantQuota(const TenantLimits& limits, uint64_t max_state_bytes = 0)
      : limits_(limits), max_state_bytes_(max_state_bytes) {}

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) names the limit; nothing is taken then. Of what all states
  // may have, a tenant that has some gets no more than it leaves free, so that others find room
  // (byte_budget.h has the same rule).
  Status Take(const std::string& tenant, const Amount& amount);
  void GiveBack(const std::string& tenant, const Amount& amount);
  Amount UsedBy(const std::string& tenant) const;

 private:
  Status CheckStates(bool is_tenant, uint64_t held_bytes, uint64_t wanted_bytes) const;

  const TenantLimits limits_;
  const uint64_t max_state_bytes_;
  mutable std::mutex mutex_;
  std::unordered_map<std::string, Amount> used_;  // tenants that have nothing have no entry
  uint64_t state_bytes_ = 0;                      // of all
};

// What cloths take of the memory of the process on backends that keep them there, whatever they are
// like: measured for sheets of 4 to 262 144 particles, and rounded up (docker/operating.md).
uint64_t StateBytes(const TenantQuota::Amount& amount);

}  // namespace drape
