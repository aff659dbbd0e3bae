// What the distance maps of a session's colliders count against its quota.
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

// Adds those of the colliders.
void Insert(std::span<const Collider> colliders, DistanceMapSet& maps);

class MapQuota;

// While it lives, the map counts; once per session, however many cloths hold it.
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

// What a cloth holds for its colliders.
using MapCharges = std::vector<std::shared_ptr<const MapCharge>>;

// Thread-safe. Held by shared_ptr, because charges may outlive their session for a moment.
class MapQuota : public std::enable_shared_from_this<MapQuota> {
 public:
  explicit MapQuota(uint64_t max_bytes) : max_bytes_(max_bytes) {}

  // Of each map the charge that is there already or a new one; RESOURCE_EXHAUSTED (QUOTA_EXCEEDED)
  // if the new ones are too large together, and nothing is charged then.
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
