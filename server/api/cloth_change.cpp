#include "server/api/cloth_change.h"

#include <memory>
#include <utility>

#include "server/api/build_queue.h"
#include "server/api/collider_maps.h"
#include "server/api/known_answer.h"
#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/api/step_cost.h"
#include "server/core/memory_reserve.h"
#include "server/session/cloth_update.h"
#include "server/session/preparation.h"

namespace drape::api {
namespace {

// How often an update is made for the cloths as they are before it is refused, because others were
// faster each time. More than a session can have waiting for the builders.
constexpr uint32_t kMaxAttempts = 32;

using UpdateDone = std::function<void(Result<v1::UpdateClothsResponse>)>;

// One update under way. Each function that continues it holds it.
struct Update {
  SessionLease session;
  ClothList cloths;
  ClothChange change;
  std::vector<ColliderMesh> meshes;  // among its colliders
  UpdateDone done;
  uint32_t attempts = 0;

  void End(Result<v1::UpdateClothsResponse> answer) {
    session = {};
    done(std::move(answer));
  }
};

Result<v1::UpdateClothsResponse> ToAnswer(const Result<UpdatedCloths>& updated) {
  if (!updated.ok()) return updated.status();
  v1::UpdateClothsResponse answer;
  *answer.mutable_shape() =
      ToProto(*updated->model, updated->plan, updated->start.get(), updated->elastic_limit);
  return answer;
}

Status CheckStepCosts(const ClothList& cloths, const ClothChange& change) {
  // The costs of a new model are checked once it is built.
  if (change.needs_model() || (!change.settings && !change.colliders)) return Status::Ok();
  for (const auto& cloth : cloths) {
    DRAPE_RETURN_IF_ERROR(CheckStepCost(*cloth->description(), change));
  }
  return Status::Ok();
}

Status BuildMaps(Update& update, const RequestLimits& limits, Interruption* interruption) {
  DRAPE_ASSIGN_OR_RETURN(
      const std::vector<ColliderMap> maps,
      BuildColliderMaps("spec.environment.colliders", update.meshes, limits.collider_mesh,
                        interruption, update.session->maps()));
  if (update.change.colliders) {
    SetMaps(maps, *update.change.colliders, update.change.collider_motions);
  }
  update.meshes.clear();
  return Status::Ok();
}

// Builds on a builder thread, where another model or distance maps are needed, and updates.
void BuildAndUpdate(const ServiceContext& context, const Waiter& waiter,
                    const std::shared_ptr<Update>& update);

void UpdateNow(const ServiceContext& context, const Waiter& waiter,
               const std::shared_ptr<Update>& update, Interruption* interruption = nullptr) {
  const ModelRules rules{
      .limits = context.limits.model,
      .accept = [update](const ClothDescription& before, const SceneModel& after) {
        return CheckStepCost(before, after, update->change);
      }};
  update->session->UpdateCloths(
      update->cloths, update->change,
      [context, waiter, update](const Result<UpdatedCloths>& updated) {
        const bool is_late = !updated.ok() && updated.status().reason() == kUpdateConflict;
        // Each time another update was faster; a session has few at once.
        if (is_late && ++update->attempts < kMaxAttempts) {
          return BuildAndUpdate(context, waiter, update);
        }
        update->End(ToAnswer(updated));
      },
      rules, ClientStopReason(context.clock, waiter), interruption);
}

void BuildAndUpdate(const ServiceContext& context, const Waiter& waiter,
                    const std::shared_ptr<Update>& update) {
  const Status posted = PostBuild(context, *update->session.session(), waiter,
                                  [=](const Status& status, Interruption* interruption) {
                                    if (!status.ok()) return update->End(status);
                                    const Status maps =
                                        BuildMaps(*update, context.limits, interruption);
                                    if (!maps.ok()) return update->End(maps);
                                    UpdateNow(context, waiter, update, interruption);
                                  });
  if (!posted.ok()) update->End(posted);
}

}  // namespace

void StartUpdate(const ServiceContext& context, const Caller& caller,
                 const v1::UpdateClothsRequest& request, const CancelToken& cancel,
                 const Hold& hold, UpdateDone done) {
  Result<ClothChange> change =
      WithinMemory([&] { return CheckUpdateCloths(request, context.limits); });
  if (!change.ok()) return done(change.status());
  Result<SessionLease> session = context.FindSession(caller, request.session());
  if (!session.ok()) return done(session.status());
  Result<std::optional<v1::UpdateClothsResponse>> known = BeginRequest<v1::UpdateClothsResponse>(
      (*session)->request_memory(), request.request_id(), request);
  if (!known.ok()) return done(known.status());
  if (known->has_value()) return done(std::move(**known));
  done = Remembering(session->session(), request.request_id(), std::move(done));
  Result<ClothList> cloths = (*session)->FindCloths(ToClothIds(request.cloth_ids()));
  if (!cloths.ok()) return done(cloths.status());
  Result<std::shared_ptr<void>> held =
      context.unread->Take((*session)->owner(), request.ByteSizeLong());
  if (!held.ok()) return done(held.status());
  hold(std::move(held).value());
  const Status cost = CheckStepCosts(*cloths, *change);
  if (!cost.ok()) return done(cost);
  auto meshes = WithinMemory([&]() -> Result<std::vector<ColliderMesh>> {
    if (!change->colliders) return std::vector<ColliderMesh>();
    return ReadColliderMeshes(request.spec().environment().colliders());
  });
  if (!meshes.ok()) return done(meshes.status());
  const auto update =
      std::make_shared<Update>(Update{std::move(*session), std::move(*cloths), std::move(*change),
                                      std::move(*meshes), std::move(done)});
  const Waiter waiter{cancel, caller.deadline_us};
  // New pins and connections need a new model, mesh colliders need distance maps, a GPU may need
  // other programs, and what touches other things than before is sorted for that. Every other
  // change is made at once.
  const BackendDescription& backend = context.scheduler.description();
  const bool takes_long =
      update->change.needs_model() || !update->meshes.empty() ||
      (backend.prepare && update->change.may_need_programs()) ||
      (backend.make_shared_parts && MayNeedParts(update->cloths, update->change));
  if (takes_long) return BuildAndUpdate(context, waiter, update);
  const Status posted = WithinMemory([&] {
    UpdateNow(context, waiter, update);
    return Status::Ok();
  });
  if (!posted.ok()) update->End(posted);
}

}  // namespace drape::api
