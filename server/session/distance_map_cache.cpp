#include "server/session/distance_map_cache.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

namespace drape {
namespace {

// Time between two checks for cancellation while another thread builds the map.
constexpr std::chrono::milliseconds kPatience{50};

}  // namespace

std::shared_ptr<const DistanceMap> DistanceMapCache::FindLive(uint64_t hash,
                                                              const TriangleMesh& mesh) const {
  const auto [begin, end] = maps_.equal_range(hash);
  for (auto entry = begin; entry != end; ++entry) {
    std::shared_ptr<const DistanceMap> map = entry->second.lock();
    if (map != nullptr && SameContent(map->mesh(), mesh)) return map;
  }
  return nullptr;
}

// Without memory a build throws: those who wait for its map go on then, too.
class DistanceMapCache::EndOfBuild {
 public:
  EndOfBuild(DistanceMapCache& cache, uint64_t hash) : cache_(cache), hash_(hash) {}
  EndOfBuild(const EndOfBuild&) = delete;
  EndOfBuild& operator=(const EndOfBuild&) = delete;
  ~EndOfBuild() {
    {
      const std::lock_guard lock(cache_.mutex_);
      cache_.building_.erase(hash_);
    }
    cache_.is_built_.notify_all();
  }

 private:
  DistanceMapCache& cache_;
  const uint64_t hash_;
};

Result<std::shared_ptr<const DistanceMap>> DistanceMapCache::Get(const TriangleMesh& mesh,
                                                                 const ClosedMeshLimits& limits,
                                                                 Interruption* interruption) {
  const uint64_t hash = DistanceMapHash(mesh, {});
  {
    std::unique_lock lock(mutex_);
    while (building_.contains(hash)) {
      is_built_.wait_for(lock, kPatience);
      Ask(interruption);
    }
    if (std::shared_ptr<const DistanceMap> map = FindLive(hash, mesh)) return map;
    building_.insert(hash);
  }
  const EndOfBuild end(*this, hash);
  Result<std::shared_ptr<const DistanceMap>> map =
      DistanceMap::Build(mesh, {}, limits, interruption);
  const std::lock_guard lock(mutex_);
  std::erase_if(maps_, [](const auto& entry) { return entry.second.expired(); });
  if (map.ok()) maps_.emplace(hash, *map);
  return map;
}

size_t DistanceMapCache::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<size_t>(std::count_if(
      maps_.begin(), maps_.end(), [](const auto& entry) { return !entry.second.expired(); }));
}

std::shared_ptr<DistanceMapCache> DistanceMapCaches::Of(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  std::erase_if(caches_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<DistanceMapCache>& entry = caches_[tenant];
  std::shared_ptr<DistanceMapCache> cache = entry.lock();
  if (cache == nullptr) entry = cache = std::make_shared<DistanceMapCache>();
  return cache;
}

}  // namespace drape
