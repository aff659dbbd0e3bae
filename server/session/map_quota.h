// The quota of a session for the distance maps of its colliders.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "server/core/status.h"
#include "server/scene/colliders.h"

namespace drape {

// By address: equal maps are one object (DistanceMapCache).
using DistanceMapSet = std::set<std::shared_ptr<const DistanceMap>>;

// Adds the maps of the colliders.
void Insert(std::span<const Collider> colliders, DistanceMapSet& maps);

class MapQuota;

// A map counts against the quota while its charge exists: once per session, however many cloths
// hold the charge.
class MapCharge {
 public:
  MapCharge(std::shared_ptr<MapQuota> quota, std::shared_ptr<const DistanceMap> map);
  ~MapCharge();
  MapCharge(const MapCharge&) = delete;
  MapCharge& operator=(const MapCharge&) = delete;

 private:
  const std::shared_ptr<MapQuota> quota_;
  const std::shared_ptr<const DistanceMap> map_;
};

// The charges that a cloth holds for its colliders.
using MapCharges = std::vector<std::shared_ptr<const MapCharge>>;

// Thread-safe. Held by shared_ptr, because charges may outlive their session briefly.
class MapQuota : public std::enable_shared_from_this<MapQuota> {
 public:
  explicit MapQuota(uint64_t max_bytes) : max_bytes_(max_bytes) {}

  // The existing charge of each map, or a new one. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) if the new
  // ones are too large together; nothing is charged then.
  Result<MapCharges> Charge(const DistanceMapSet& maps);
  uint64_t used_bytes() const;

 private:
  friend class MapCharge;
  void GiveBack(uint64_t bytes);

  const uint64_t max_bytes_;
  mutable std::mutex mutex_;
  uint64_t used_bytes_ = 0;
  std::map<const DistanceMap*, std::weak_ptr<const MapCharge>> charges_;
};

}  // namespace drape
