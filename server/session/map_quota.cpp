#include "server/session/map_quota.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/scene/distance_map.h"

namespace drape {

void Insert(std::span<const Collider> colliders, DistanceMapSet& maps) {
  for (const Collider& collider : colliders) {
    if (auto map = MapOf(collider)) maps.insert(std::move(map));
  }
}

namespace {

// Seldom: with each call, all would wait for a look at the maps of everybody.
template <class Entries>
void DropDead(Entries& entries, size_t& next_sweep_size) {
  if (entries.size() <= next_sweep_size) return;
  std::erase_if(entries, [](const auto& entry) { return entry.second.expired(); });
  next_sweep_size = std::max<size_t>(64, 2 * entries.size());
}

// Keeps what it counts alive, so that no other map gets its address.
struct MapPermit {
  std::shared_ptr<const DistanceMap> map;
  std::shared_ptr<void> bytes;
};

}  // namespace

MapPool::MapPool(uint64_t max_bytes)
    : budget_("QUOTA_EXCEEDED", ByteBudget::Limit{"half of max_mesh_collider_bytes", max_bytes / 2},
              ByteBudget::Limit{"max_mesh_collider_bytes", max_bytes}, 0) {}

Result<std::shared_ptr<const void>> MapPool::Take(const std::string& owner,
                                                  const std::shared_ptr<const DistanceMap>& map) {
  const std::lock_guard lock(mutex_);
  DropDead(permits_, next_sweep_size_);
  std::weak_ptr<const void>& entry = permits_[{owner, map.get()}];
  if (auto known = entry.lock()) return known;
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> bytes, budget_.Take(owner, map->size_bytes()));
  const std::shared_ptr<const void> permit =
      std::make_shared<const MapPermit>(map, std::move(bytes));
  entry = permit;
  return permit;
}

MapCharge::MapCharge(std::shared_ptr<MapQuota> quota, std::shared_ptr<const DistanceMap> map,
                     std::shared_ptr<const void> permit)
    : quota_(std::move(quota)), map_(std::move(map)), permit_(std::move(permit)) {}

MapCharge::~MapCharge() {
  quota_->GiveBack(map_->size_bytes());
}

Result<MapCharges> MapQuota::Charge(const DistanceMapSet& maps) {
  // Destroyed after the lock is released: this may be the last owner of a charge.
  MapCharges charges;
  const std::lock_guard lock(mutex_);
  DropDead(charges_, next_sweep_size_);
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
  std::vector<std::shared_ptr<const void>> permits;
  for (const auto& map : missing) {
    DRAPE_ASSIGN_OR_RETURN(permits.emplace_back(), pool_->Take(owner_, map));
  }
  used_bytes_ += wanted_bytes;
  for (size_t k = 0; k < missing.size(); ++k) {
    const DistanceMap* const key = missing[k].get();
    charges.push_back(std::make_shared<const MapCharge>(shared_from_this(), std::move(missing[k]),
                                                        std::move(permits[k])));
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
