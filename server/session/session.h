// One session: the cloths of one client and what it may do with them.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/scheduler.h"
#include "server/session/cloth_record.h"
#include "server/session/cloth_table.h"
#include "server/session/distance_map_cache.h"
#include "server/session/map_quota.h"
#include "server/session/model_cache.h"
#include "server/session/model_change.h"
#include "server/session/request_memory.h"
#include "server/session/session_limits.h"

namespace drape {

// What all sessions of a server share. The scheduler outlives every session.
struct SessionCommons {
  SessionCommons(Scheduler& the_scheduler, const SessionLimits& the_limits)
      : scheduler(the_scheduler), limits(the_limits) {}
  Scheduler& scheduler;
  const SessionLimits limits;
  ClothTable cloths;
  ModelCache models;
  DistanceMapCache maps;
};

struct CreatedCloths {
  std::vector<ClothId> ids;  // one per copy, same order
  std::shared_ptr<const SceneModel> model;
  std::string plan;                         // BackendDescription::plan_of
  std::shared_ptr<const ClearStart> start;  // ClothCopy::start of one, a cleared one first
};

// The shape of the first cloth after an update.
struct UpdatedCloths {
  std::shared_ptr<const SceneModel> model;
  std::string plan;
  std::shared_ptr<const ClearStart> start;  // ClothRecord::start
};

struct ClothPage {
  std::vector<std::shared_ptr<ClothRecord>> cloths;
  std::string next_page_token;  // empty: the last page
};

using ClothList = std::vector<std::shared_ptr<ClothRecord>>;

// Thread-safe; nothing waits for the device. Every `done` runs exactly once: on the completion
// thread of the scheduler, or, when the error is known before any device work, on the caller's
// thread before the method returns. It must not block.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(std::shared_ptr<SessionCommons> commons, std::string name, std::string display_name,
          double ttl_s);

  const std::string& name() const { return name_; }
  const std::string& display_name() const { return display_name_; }
  double ttl_s() const { return ttl_s_; }
  uint32_t cloth_count() const;     // quota in use
  uint64_t particle_count() const;  // quota in use
  uint64_t map_bytes() const { return map_quota_->used_bytes(); }
  RequestMemory& request_memory() { return request_memory_; }
  // Of the whole server.
  DistanceMapCache& maps() { return commons_->maps; }

  // Creates all the copies or none. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) names the limit;
  // RESOURCE_EXHAUSTED of the backend when the device is full.
  void CreateCloths(ClothCreation creation, std::function<void(Result<CreatedCloths>)> done);
  // For validate_only: checks the quota as CreateCloths does and creates nothing. `done` runs
  // before this returns.
  void CheckCloths(ClothCreation creation, std::function<void(Result<CreatedCloths>)> done);

  // In the order of `ids`; no ids: every cloth in order of creation. NOT_FOUND (CLOTH_NOT_FOUND)
  // names the first id that is no cloth of this session; INVALID_ARGUMENT a repeated one
  // ("cloth_ids[3]").
  Result<ClothList> FindCloths(std::span<const ClothId> ids) const;
  // In order of creation. `page_size` 0 = kDefaultPageSize, above kMaxPageSize = kMaxPageSize. A
  // token that this server did not make is INVALID_ARGUMENT ("page_token").
  Result<ClothPage> ListCloths(uint32_t page_size, const std::string& page_token) const;

  // Changes all the cloths (at least one) or none. INVALID_ARGUMENT for what the cloths' own values
  // make illegal, with fields as in UpdateClothsRequest ("spec.pins[2].particle");
  // RESOURCE_EXHAUSTED when the device has no room. Takes effect between two steps of what is
  // running. `rules` for what needs another model. Cloths that the device has no room to bring back
  // to what they were when another one failed are deleted; the message says so.
  void UpdateCloths(ClothList cloths, ClothChange change,
                    std::function<void(Result<UpdatedCloths>)> done, const ModelRules& rules = {});
  // Ids are invalid on return; `done` when the device memory is free. Step requests under way on
  // one of the cloths end with NOT_FOUND (CLOTH_NOT_FOUND).
  void DeleteCloths(ClothList cloths, std::function<void(Status)> done);
  // State, step, time, warnings and pins of creation (pins as of the last update of pins);
  // parameters stay. A step request under way goes on from there for the steps it has left.
  void ResetCloths(ClothList cloths, std::function<void(Status)> done);

  // Ends the session: deletes its cloths; from now on nothing can be created. For the registry.
  void Close(std::function<void(Status)> done);

 private:
  // Takes the quota or tells which limit is in the way.
  Status ReserveQuota(uint64_t cloths, uint64_t particles);
  void ReleaseQuota(uint64_t cloths, uint64_t particles);
  Status CheckQuota(uint64_t cloths, uint64_t particles) const;  // mutex_ held
  // Makes the records visible, unless the session was closed meanwhile.
  bool Publish(const ClothList& records);
  // Removes them from this session and the table. Those that are already gone are left out of the
  // result.
  ClothList Unpublish(const ClothList& cloths);
  // Deletes those that have ended on the device. Device thread.
  void DropEnded(const ClothList& cloths);
  // Posts what frees the cloths on the device and returns the quota.
  void FreeOnDevice(ClothList cloths, std::function<void(Status)> done);

  const std::shared_ptr<SessionCommons> commons_;
  const std::string name_;
  const std::string display_name_;
  const double ttl_s_;
  RequestMemory request_memory_;
  const std::shared_ptr<MapQuota> map_quota_;

  mutable std::mutex mutex_;
  std::map<uint64_t, std::shared_ptr<ClothRecord>> cloths_;  // by creation number
  uint64_t cloth_quota_used_ = 0;
  uint64_t particle_quota_used_ = 0;
  bool is_closed_ = false;
};

}  // namespace drape
