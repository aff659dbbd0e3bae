// Distance maps of equal content of one tenant are one object.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "server/core/status.h"
#include "server/scene/distance_map.h"

namespace drape {

// Keeps no map alive. Thread-safe.
class DistanceMapCache {
 public:
  // A live map of the same mesh if there is one. Otherwise builds it (DistanceMap::Build, default
  // settings) on this thread, or waits if another thread is building it. `interruption`: as of
  // Build, also while waiting.
  Result<std::shared_ptr<const DistanceMap>> Get(const TriangleMesh& mesh,
                                                 const ClosedMeshLimits& limits,
                                                 Interruption* interruption);
  // Live maps.
  size_t size() const;

 private:
  class EndOfBuild;

  std::shared_ptr<const DistanceMap> FindLive(uint64_t hash, const TriangleMesh& mesh) const;

  mutable std::mutex mutex_;
  std::condition_variable is_built_;
  std::unordered_set<uint64_t> building_;                                     // hashes
  std::unordered_multimap<uint64_t, std::weak_ptr<const DistanceMap>> maps_;  // by content hash
};

// A cache for each tenant: how long a request takes must not tell that another tenant has its mesh.
// Thread-safe.
class DistanceMapCaches {
 public:
  // Lives as long as somebody holds it. `tenant`: empty for all sessions of a server without
  // tokens.
  std::shared_ptr<DistanceMapCache> Of(const std::string& tenant);

 private:
  std::mutex mutex_;
  std::unordered_map<std::string, std::weak_ptr<DistanceMapCache>> caches_;  // by tenant
};

}  // namespace drape
