// The quotas of sessions and their owners for the distance maps of colliders.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/byte_budget.h"
#include "server/core/status.h"
#include "server/scene/colliders.h"

namespace drape {

// By address: equal maps are one object (DistanceMapCache).
using DistanceMapSet = std::set<std::shared_ptr<const DistanceMap>>;

// Adds the maps of the colliders.
void Insert(std::span<const Collider> colliders, DistanceMapSet& maps);

// The maps of all sessions: one counts for its owner (a tenant, or a session without one) while a
// permit exists, once, in however many sessions. Thread-safe.
class MapPool {
 public:
  // An owner may have half, and no more than it leaves free.
  explicit MapPool(uint64_t max_bytes);

  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED).
  Result<std::shared_ptr<const void>> Take(const std::string& owner,
                                           const std::shared_ptr<const DistanceMap>& map);
  uint64_t used_bytes(const std::string& owner) const { return budget_.used_bytes(owner); }

 private:
  ByteBudget budget_;
  std::mutex mutex_;
  std::map<std::pair<std::string, const DistanceMap*>, std::weak_ptr<const void>> permits_;
  size_t next_sweep_size_ = 64;  // dead entries are dropped when there are more
};

class MapQuota;

// A map counts against the quota while its charge exists: once per session, however many cloths
// hold the charge.
class MapCharge {
 public:
  // `permit`: of the pool.
  MapCharge(std::shared_ptr<MapQuota> quota, std::shared_ptr<const DistanceMap> map,
            std::shared_ptr<const void> permit);
  ~MapCharge();
  MapCharge(const MapCharge&) = delete;
  MapCharge& operator=(const MapCharge&) = delete;

  const DistanceMap* map() const { return map_.get(); }

 private:
  const std::shared_ptr<MapQuota> quota_;
  const std::shared_ptr<const DistanceMap> map_;
  const std::shared_ptr<const void> permit_;
};

// The charges that a cloth holds for its colliders.
using MapCharges = std::vector<std::shared_ptr<const MapCharge>>;

// Thread-safe. Held by shared_ptr, because charges may outlive their session briefly.
class MapQuota : public std::enable_shared_from_this<MapQuota> {
 public:
  MapQuota(uint64_t max_bytes, std::shared_ptr<MapPool> pool, std::string owner)
      : max_bytes_(max_bytes), pool_(std::move(pool)), owner_(std::move(owner)) {}

  // The existing charge of each map, or a new one. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) if the new
  // ones are too large together, for the session or its owner; nothing is charged then.
  Result<MapCharges> Charge(const DistanceMapSet& maps);
  uint64_t used_bytes() const;

 private:
  friend class MapCharge;
  void GiveBack(uint64_t bytes);

  const uint64_t max_bytes_;
  const std::shared_ptr<MapPool> pool_;
  const std::string owner_;
  mutable std::mutex mutex_;
  uint64_t used_bytes_ = 0;
  std::map<const DistanceMap*, std::weak_ptr<const MapCharge>> charges_;
  size_t next_sweep_size_ = 64;  // as MapPool's
};

}  // namespace drape
