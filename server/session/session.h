// One session: the cloths of one client, and the operations on them.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/scheduler.h"
#include "server/session/cloth_record.h"
#include "server/session/cloth_reset.h"
#include "server/session/cloth_table.h"
#include "server/session/distance_map_cache.h"
#include "server/session/held_charge.h"
#include "server/session/map_quota.h"
#include "server/session/model_cache.h"
#include "server/session/model_change.h"
#include "server/session/request_memory.h"
#include "server/session/saved_states.h"
#include "server/session/session_limits.h"
#include "server/solver/elastic_limit.h"

namespace drape {

class ClothMaker;

// Shared by all sessions of a server. The scheduler outlives every session.
struct SessionCommons {
  SessionCommons(Scheduler& the_scheduler, const SessionLimits& the_limits, const Clock& the_clock)
      : scheduler(the_scheduler), limits(the_limits), clock(the_clock) {}
  Scheduler& scheduler;
  const SessionLimits limits;
  const Clock& clock;
  // The answers that RequestMemory keeps; a session may have a quarter.
  const std::shared_ptr<ByteBudget> remembered = std::make_shared<ByteBudget>(
      "TOO_MANY_ANSWERS",
      ByteBudget::Limit{"max_remembered_bytes_per_session", limits.max_remembered_bytes / 4},
      ByteBudget::Limit{"max_remembered_bytes", limits.max_remembered_bytes}, 0);
  // The request ids that it knows; an owner may have half.
  const std::shared_ptr<ByteBudget> request_ids = std::make_shared<ByteBudget>(
      "TOO_MANY_REQUEST_IDS",
      ByteBudget::Limit{"half of max_request_id_bytes", limits.max_request_id_bytes / 2},
      ByteBudget::Limit{"max_request_id_bytes", limits.max_request_id_bytes}, kRetryWhenFull_ms);
  // The states that sessions keep by name; an owner may have a quarter, or one snapshot of half.
  const std::shared_ptr<ByteBudget> saved = std::make_shared<ByteBudget>(
      "TOO_MANY_SAVED_STATES",
      ByteBudget::Limit{"max_saved_bytes_per_owner", limits.max_saved_bytes / 4},
      ByteBudget::Limit{"max_saved_bytes", limits.max_saved_bytes}, 0, limits.max_saved_bytes / 2);
  TenantQuota tenants{limits.per_tenant, limits.max_state_bytes};
  std::atomic<uint64_t> worlds{0};  // made so far
  ModelCache models{limits.max_model_bytes};
  const std::shared_ptr<MapPool> map_pool =
      std::make_shared<MapPool>(limits.max_mesh_collider_bytes);
  DistanceMapCaches maps;
};

struct CreatedCloths {
  std::vector<ClothId> ids;  // one per copy, same order
  std::shared_ptr<const SceneModel> model;
  std::string plan;                         // BackendDescription::plan_of
  std::shared_ptr<const ClearStart> start;  // ClothCopy::start of one, a cleared one first
  std::optional<ElasticLimit> elastic_limit{};
};

// The shape of the first cloth after an update.
struct UpdatedCloths {
  std::shared_ptr<const SceneModel> model;
  std::string plan;
  std::shared_ptr<const ClearStart> start;  // ClothRecord::start
  std::optional<ElasticLimit> elastic_limit{};
};

struct ClothPage {
  std::vector<std::shared_ptr<ClothRecord>> cloths;
  std::string next_page_token;  // empty: the last page
};

using ClothList = std::vector<std::shared_ptr<ClothRecord>>;

// Of Session::SaveStates.
struct SavedSummary {
  size_t cloths = 0;
  uint64_t bytes = 0;
};

// Cloths that are to become saved ones.
struct StateLoads {
  std::shared_ptr<const SavedStates> saved;  // where LoadPair::from points to
  std::vector<LoadPair> pairs;
};

// Names under which a session keeps states.
inline constexpr size_t kMaxSavedNames = 4096;

// Thread-safe; nothing waits for the device. Every `done` runs exactly once: on the completion
// thread of the scheduler, or, when the error is known before any device work, on the caller's
// thread before the method returns. It must not block.
class Session : public std::enable_shared_from_this<Session> {
 public:
  // `tenant`: empty on a server without tokens.
  Session(std::shared_ptr<SessionCommons> commons, std::string name, std::string display_name,
          double ttl_s, std::string tenant = {});
  // A session that was, and comes back as it was then: it never issues one of these ids again.
  Session(std::shared_ptr<SessionCommons> commons, std::string name, std::string display_name,
          double ttl_s, std::string tenant, IssuedIds issued, double checkpoint_unix_s);

  const std::string& name() const { return name_; }
  const std::string& display_name() const { return display_name_; }
  const std::string& tenant() const { return tenant_; }
  // In whose name pools are shared: the tenant, or else the session.
  const std::string& owner() const { return OwnerOf(name_, tenant_); }
  double ttl_s() const { return ttl_s_; }
  // When it was as it came back into this run of the server; 0: it was created here.
  double checkpoint_unix_s() const { return checkpoint_unix_s_; }
  // Quota in use. Wait for nobody: the registry asks with its lock held.
  uint32_t cloth_count() const { return static_cast<uint32_t>(cloth_quota_used_); }
  uint64_t particle_count() const { return particle_quota_used_; }
  uint64_t map_bytes() const { return map_quota_->used_bytes(); }
  RequestMemory& request_memory() { return request_memory_; }
  // Shared by the sessions of its tenant.
  DistanceMapCache& maps() { return *maps_; }
  // The model, the maps and so many colliders of a cloth count for the session while the charges
  // live, also before a cloth has them. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED).
  Result<SharedModel> ShareModel(std::shared_ptr<const SceneModel> model,
                                 std::shared_ptr<const ModelDescription> description) {
    return commons_->models.Share(owner(), std::move(model), std::move(description));
  }
  Result<MapCharges> ChargeMaps(const DistanceMapSet& maps) { return map_quota_->Charge(maps); }
  Result<std::shared_ptr<const void>> ChargeColliders(size_t count) const {
    return commons_->models.ChargeColliders(owner(), static_cast<uint32_t>(count));
  }

  // Creates all the copies or none. RESOURCE_EXHAUSTED (QUOTA_EXCEEDED) names the limit;
  // RESOURCE_EXHAUSTED of the backend when the device is full. INVALID_ARGUMENT for cloths that
  // cannot be in their world.
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

  // Changes all the cloths (at least one) or none, between two steps of running requests.
  // INVALID_ARGUMENT for values that are illegal together with the cloths' own, with fields as in
  // UpdateClothsRequest ("spec.pins[2].particle"); RESOURCE_EXHAUSTED when the device has no room.
  // If one cloth fails, the others are changed back; a cloth for which the device has no room then
  // is deleted, and the message says so. ABORTED (UPDATE_CONFLICT) if another update gave a cloth
  // another model while this one built its own: nothing has changed, and the call may be repeated.
  // `rules.limits` apply to changes that need another model. Cloths of several slices are not
  // stepped meanwhile. `stop_reason` is asked before each slice on the device: after an error of it
  // everything is taken back. `interruption` is asked while models are built, before this returns;
  // null: nobody is.
  void UpdateCloths(ClothList cloths, ClothChange change,
                    std::function<void(Result<UpdatedCloths>)> done, const ModelRules& rules = {},
                    std::function<Status()> stop_reason = {}, Interruption* interruption = nullptr);
  // The ids are invalid on return; `done` runs when the device memory is free. Running step
  // requests on one of the cloths end with NOT_FOUND (CLOTH_NOT_FOUND). UNAVAILABLE (DRAINING):
  // they may be in the last checkpoint, and come back.
  void DeleteCloths(ClothList cloths, std::function<void(Status)> done);
  // Back to the state, step, time, warnings and pins of creation (or of the last update of pins);
  // parameters stay. A running step request continues from there for its remaining steps.
  void ResetCloths(ClothList cloths, std::function<void(Status)> done) {
    ResetCloths(std::move(cloths), {}, std::move(done));
  }
  // The same from other starts: overrides of all the cloths or of none, then resets.
  void ResetCloths(ClothList cloths, ClothStarts starts, std::function<void(Status)> done);

  // Replaces the states of the cloths, [cloth_count] in their own frames, between two steps of
  // running requests; clears faults.
  void WriteStates(ClothList cloths, std::vector<ParticleState> states,
                   std::function<void(Status)> done);

  // Keeps the cloths as they are at one moment between two steps, in memory until the session ends,
  // or DropStates. Replaces what `name` had. RESOURCE_EXHAUSTED (TOO_MANY_SAVED_STATES), NOT_FOUND
  // (CLOTH_NOT_FOUND) for one that was deleted: nothing is kept then.
  void SaveStates(ClothList cloths, std::string name,
                  std::function<void(Result<SavedSummary>)> done);
  // Cloth into[k] becomes the saved cloth from[k] (SavedCloth), between two steps of running
  // requests, with the bits that it would have had; all at one moment. No `into`: every saved
  // cloth; no `from`: each itself. NOT_FOUND (SAVED_STATES_NOT_FOUND, CLOTH_NOT_FOUND),
  // INVALID_ARGUMENT ("cloth_ids[k]", CheckLoads): nothing changes then. RESOURCE_EXHAUSTED when
  // the device has no room: the cloths from there on are as they were.
  void LoadStates(const std::string& name, std::span<const ClothId> into,
                  std::span<const ClothId> from, std::function<void(Status)> done);
  // The pairs of LoadStates, with its errors, for LoadOnDevice.
  Result<StateLoads> FindLoads(const std::string& name, std::span<const ClothId> into,
                               std::span<const ClothId> from) const;
  // So many rest lengths of the cloths' own (DrivenBy) count among the models, until they end.
  // RESOURCE_EXHAUSTED (QUOTA_EXCEEDED): none counts more than before.
  Status ChargeDriven(std::span<const CountedCloth> driven) const;
  // The same for all that cloths will have once they have become saved ones.
  Status ChargeLoads(std::span<const LoadPair> pairs) const;
  // SAVED_STATES_NOT_FOUND.
  Status DropStates(const std::string& name);
  // What SaveStates has kept; null: nothing.
  std::shared_ptr<const SavedStates> FindSaved(const std::string& name) const;
  // Creates cloths that go on from what was saved, all or none. Everything has been checked against
  // the models; plans, charges of maps and shared models are set here. Errors as of CreateCloths.
  // `interruption`: asked before this returns; null: nobody is.
  void ImportCloths(std::vector<SavedCloth> cloths,
                    std::function<void(Result<std::vector<ClothId>>)> done,
                    Interruption* interruption = nullptr) {
    Import(std::move(cloths), false, std::move(done), interruption);
  }
  // The same of cloths that had their ids in this session, and get them back. INVALID_ARGUMENT if
  // it has not issued one of them.
  void ReturnCloths(std::vector<SavedCloth> cloths,
                    std::function<void(Result<std::vector<ClothId>>)> done) {
    Import(std::move(cloths), true, std::move(done), nullptr);
  }
  IssuedIds issued_ids() const { return table_.issued(); }
  // Where bytes of snapshots count.
  ByteBudget& saved_budget() { return *commons_->saved; }

  // Ends the session: deletes its cloths and refuses new ones. For the registry.
  void Close(std::function<void(Status)> done);

 private:
  Result<ClothList> FindAll(std::span<const ClothId> ids) const;
  // Takes the quota, or names the limit that forbids it.
  Status ReserveQuota(const TenantQuota::Amount& amount);
  void ReleaseQuota(const TenantQuota::Amount& amount);
  Status CheckQuota(uint64_t cloths, uint64_t particles) const;  // mutex_ held
  // Makes the records visible; false if the session has been closed. With `keeps_ids` they have
  // theirs.
  bool Publish(const ClothList& records, bool keeps_ids = false);
  void Import(std::vector<SavedCloth> cloths, bool keeps_ids,
              std::function<void(Result<std::vector<ClothId>>)> done, Interruption* interruption);
  // Whether the cloths can be in their worlds; the names of those. Others may enter one meanwhile:
  // CheckNewWorlds.
  Result<std::vector<std::string>> CheckImportedWorlds(const std::vector<SavedCloth>& cloths) const;
  // Whether no cloth is in one of these worlds.
  Status CheckNewWorlds(const std::vector<std::string>& worlds) const;
  // Whether every cloth can have its id back.
  Status CheckReturn(const std::vector<SavedCloth>& cloths) const;
  // Whether cloths of this model, with these settings, can be in the world. Linear in them.
  Status CheckWorld(const std::string& world, const SceneModel& model,
                    std::span<const StepSettings* const> settings) const;
  // mutex_ held.
  void EnterWorld(const ClothRecord& cloth);
  void LeaveWorld(const ClothRecord& cloth);
  // The cloths, which are published, enter their worlds. Device thread.
  void JoinWorlds(const ClothList& cloths);
  // Fills in the charges of the copies.
  Status ShareModels(ClothCreation& creation);
  // As ChargeDriven, for their colliders.
  Status HoldColliders(std::span<const CountedCloth> cloths) const;
  // Publishes the cloths of a creation that ended with `status`.
  Result<CreatedCloths> PublishMade(const ClothMaker& maker, const Status& status);
  // Removes the cloths from this session and the table. Returns those that were still there.
  ClothList Unpublish(const ClothList& cloths);
  // Deletes the cloths that have ended on the device. Device thread.
  void DropEnded(const ClothList& cloths);
  Status Keep(const std::string& name, std::shared_ptr<const SavedStates> saved);
  Status Adopt(std::vector<SavedCloth>& cloths);
  Result<std::vector<LoadPair>> PairsOf(const SavedStates& saved, std::span<const ClothId> into,
                                        std::span<const ClothId> from) const;
  // Frees the cloths on the device, then this much of the quota, then calls `answer` on the
  // completion thread. False after Drain: it calls nothing.
  [[nodiscard]] bool Free(ClothList cloths, const TenantQuota::Amount& amount,
                          std::function<void()> answer);
  // The same for cloths that count, with the outcome.
  void FreeOnDevice(ClothList cloths, std::function<void(Status)> done);

  const std::shared_ptr<SessionCommons> commons_;
  const std::shared_ptr<DistanceMapCache> maps_;
  const std::string name_;
  const std::string display_name_;
  const double ttl_s_;
  const std::string tenant_;
  const double checkpoint_unix_s_ = 0;
  RequestMemory request_memory_;
  const std::shared_ptr<MapQuota> map_quota_;

  ClothTable table_;  // by id
  mutable std::mutex mutex_;
  std::map<uint64_t, std::shared_ptr<ClothRecord>> cloths_;          // by creation number
  std::map<std::string, std::shared_ptr<const SavedStates>> saved_;  // by name
  struct NamedWorld {
    std::set<uint64_t> cloths;  // of cloths_, at least one
    std::weak_ptr<ClothWorld> world;
  };
  std::map<std::string, NamedWorld> worlds_;
  // Change with mutex_ held.
  std::atomic<uint64_t> cloth_quota_used_{0};
  std::atomic<uint64_t> particle_quota_used_{0};
  bool is_closed_ = false;
};

}  // namespace drape
