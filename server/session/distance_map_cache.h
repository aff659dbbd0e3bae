// Distance maps of equal content are one object.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <unordered_set>

#include "server/core/status.h"
#include "server/scene/distance_map.h"

namespace drape {

// Keeps no map alive. Thread-safe.
class DistanceMapCache {
 public:
  // A live map of the same mesh if there is one. Otherwise builds it (DistanceMap::Build, default
  // settings) on this thread, or waits if another thread is building it. CANCELLED as Build, also
  // while waiting.
  Result<std::shared_ptr<const DistanceMap>> Get(const TriangleMesh& mesh,
                                                 const ClosedMeshLimits& limits,
                                                 const std::function<bool()>& is_cancelled);
  // Live maps.
  size_t size() const;

 private:
  std::shared_ptr<const DistanceMap> FindLive(uint64_t hash, const TriangleMesh& mesh) const;

  mutable std::mutex mutex_;
  std::condition_variable is_built_;
  std::unordered_set<uint64_t> building_;                                     // hashes
  std::unordered_multimap<uint64_t, std::weak_ptr<const DistanceMap>> maps_;  // by content hash
};

}  // namespace drape
