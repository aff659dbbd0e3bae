#include "server/session/map_quota.h"

#include <string>
#include <utility>

#include "server/scene/distance_map.h"

namespace drape {

void Insert(std::span<const Collider> colliders, DistanceMapSet& maps) {
  for (const Collider& collider : colliders) {
    if (auto map = MapOf(collider)) maps.insert(std::move(map));
  }
}

MapCharge::MapCharge(std::shared_ptr<MapQuota> quota, std::shared_ptr<const DistanceMap> map)
    : quota_(std::move(quota)), map_(std::move(map)) {}

MapCharge::~MapCharge() {
  quota_->GiveBack(map_->size_bytes());
}

Result<MapCharges> MapQuota::Charge(const DistanceMapSet& maps) {
  // Destroyed after the lock is released: this may be the last owner of a charge.
  MapCharges charges;
  const std::lock_guard lock(mutex_);
  std::erase_if(charges_, [](const auto& entry) { return entry.second.expired(); });
  std::vector<std::shared_ptr<const DistanceMap>> missing;
  uint64_t wanted_bytes = 0;
  for (const auto& map : maps) {
    const auto known = charges_.find(map.get());
    auto charge = known == charges_.end() ? nullptr : known->second.lock();
    if (charge != nullptr) {
      charges.push_back(std::move(charge));
    } else {
      missing.push_back(map);
      wanted_bytes += map->size_bytes();
    }
  }
  if (wanted_bytes > max_bytes_ - used_bytes_) {
    return Status(StatusCode::kResourceExhausted, "QUOTA_EXCEEDED",
                  "max_mesh_collider_bytes_per_session is " + std::to_string(max_bytes_) + ": " +
                      std::to_string(used_bytes_) + " in use, " + std::to_string(wanted_bytes) +
                      " more wanted");
  }
  used_bytes_ += wanted_bytes;
  for (auto& map : missing) {
    const DistanceMap* const key = map.get();
    charges.push_back(std::make_shared<const MapCharge>(shared_from_this(), std::move(map)));
    charges_[key] = charges.back();
  }
  return charges;
}

void MapQuota::GiveBack(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  used_bytes_ -= bytes;
}

uint64_t MapQuota::used_bytes() const {
  const std::lock_guard lock(mutex_);
  return used_bytes_;
}

}  // namespace drape
