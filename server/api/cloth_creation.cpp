#include "server/api/cloth_creation.h"

#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "server/api/build_queue.h"
#include "server/api/collider_maps.h"
#include "server/api/known_answer.h"
#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/api/step_cost.h"
#include "server/core/memory_reserve.h"
#include "server/session/clear_starts.h"
#include "server/session/cloth_creation.h"

namespace drape::api {
namespace {

using CreateDone = std::function<void(Result<v1::CreateClothsResponse>)>;

// One creation under way. Each function that continues it holds it.
struct Creation {
  SessionLease session;
  std::string request_id;  // empty: not remembered
  bool validate_only = false;
  CheckedCreation checked;
  std::vector<ColliderMesh> meshes;  // among the colliders of every copy
  CreateDone done;

  void End(Result<v1::CreateClothsResponse> answer) {
    EndRequest(session->request_memory(), request_id, answer);
    session = {};
    done(std::move(answer));
  }
};

Result<v1::CreateClothsResponse> ToAnswer(const Result<CreatedCloths>& created) {
  if (!created.ok()) return created.status();
  v1::CreateClothsResponse answer;
  for (const ClothId id : created->ids) answer.add_cloth_ids(id.Packed());
  *answer.mutable_shape() =
      ToProto(*created->model, created->plan, created->start.get(), created->elastic_limit);
  return answer;
}

// The ids, as the numbers of 64 bits that they are at most, and the shape. Counted before there is
// an answer, and for a repetition, too: a few bytes of a request may ask for 65 536 ids.
uint64_t MostAnswerBytes(const CheckedCreation& checked) {
  constexpr uint64_t kIdBytes = 10, kShapeBytes = 1024;
  return checked.copies.size() * kIdBytes + kShapeBytes;
}

// The copies, each with colliders of its own: the same few bytes ask for 65 536 of them, or for a
// million colliders.
uint64_t BytesOf(const std::vector<ClothCopy>& copies) {
  uint64_t bytes = std::span(copies).size_bytes();
  for (const ClothCopy& copy : copies) {
    bytes += std::span(copy.parameters.colliders).size_bytes() +
             std::span(copy.parameters.collider_motions).size_bytes();
  }
  return bytes;
}

// An override without settings of its own has those of the spec.
Status CheckStepCosts(const SceneModel& model, const CheckedCreation& checked) {
  for (size_t k = 0; k < checked.copies.size(); ++k) {
    const ClothParameters& parameters = checked.copies[k].parameters;
    const std::string field = parameters.settings == checked.settings
                                  ? "spec.settings"
                                  : "overrides[" + std::to_string(k) + "].settings";
    DRAPE_RETURN_IF_ERROR(
        CheckStepCost(field, model, parameters.settings, parameters.colliders.size()));
  }
  return Status::Ok();
}

Status BuildMaps(Creation& creation, const RequestLimits& limits, Interruption* interruption) {
  DRAPE_ASSIGN_OR_RETURN(
      const std::vector<ColliderMap> maps,
      BuildColliderMaps("spec.environment.colliders", creation.meshes, limits.collider_mesh,
                        interruption, creation.session->maps()));
  for (ClothCopy& copy : creation.checked.copies) {
    SetMaps(maps, copy.parameters.colliders, copy.parameters.collider_motions);
  }
  creation.meshes.clear();
  return Status::Ok();
}

void BuildAndCreate(const std::shared_ptr<Creation>& creation, const RequestLimits& limits,
                    const BackendDescription& backend, Interruption* interruption) {
  auto model = SceneModel::Build(*creation->checked.description, limits.model, interruption);
  if (!model.ok()) return creation->End(Below("spec", model.status()));
  const Status cost = CheckStepCosts(**model, creation->checked);
  if (!cost.ok()) return creation->End(cost);
  const Status maps = BuildMaps(*creation, limits, interruption);
  if (!maps.ok()) return creation->End(maps);
  ClothCreation cloths{std::move(creation->checked.description), std::move(*model),
                       std::move(creation->checked.pins), std::move(creation->checked.copies),
                       std::move(creation->checked.world)};
  const Status starts = FindClearStarts(cloths, interruption);
  if (!starts.ok()) return creation->End(starts);
  // A client that has gone would not learn the ids.
  Ask(interruption);
  const auto end = [creation](const Result<CreatedCloths>& created) {
    creation->End(ToAnswer(created));
  };
  if (creation->validate_only) {
    creation->session->CheckCloths(std::move(cloths), end);
  } else {
    PrepareCloths(cloths, backend, interruption);
    creation->session->CreateCloths(std::move(cloths), end);
  }
}

}  // namespace

void StartCreation(const ServiceContext& context, const Caller& caller,
                   const v1::CreateClothsRequest& request, const CancelToken& cancel,
                   const Hold& hold, CreateDone done) {
  Result<CheckedCreation> checked =
      WithinMemory([&] { return CheckCreateCloths(request, context.limits); });
  if (!checked.ok()) return done(checked.status());
  Result<SessionLease> session = context.FindSession(caller, request.session());
  if (!session.ok()) return done(session.status());

  Result<std::shared_ptr<void>> held =
      context.unread->Take((*session)->owner(), request.ByteSizeLong() + BytesOf(checked->copies) +
                                                    MostAnswerBytes(*checked));
  if (!held.ok()) return done(held.status());
  hold(std::move(held).value());
  auto meshes = WithinMemory([&]() -> Result<std::vector<ColliderMesh>> {
    return ReadColliderMeshes(request.spec().environment().colliders());
  });
  if (!meshes.ok()) return done(meshes.status());
  const std::string& request_id = request.validate_only() ? std::string() : request.request_id();
  Result<std::optional<v1::CreateClothsResponse>> known =
      BeginRequest<v1::CreateClothsResponse>((*session)->request_memory(), request_id, request);
  if (!known.ok()) return done(known.status());
  if (known->has_value()) return done(std::move(**known));

  const auto creation = std::make_shared<Creation>(
      Creation{std::move(*session), request_id, request.validate_only(), std::move(*checked),
               std::move(*meshes), std::move(done)});
  const Waiter waiter{cancel, caller.deadline_us};
  const Status posted =
      PostBuild(context, *creation->session.session(), waiter,
                [creation, limits = context.limits, backend = context.scheduler.description()](
                    const Status& status, Interruption* interruption) {
                  if (!status.ok()) return creation->End(status);
                  BuildAndCreate(creation, limits, backend, interruption);
                });
  if (!posted.ok()) creation->End(posted);
}

}  // namespace drape::api
