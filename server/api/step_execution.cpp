#include "server/api/step_execution.h"

#include <memory>
#include <optional>
#include <utility>

#include "server/api/known_answer.h"
#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/api/state_chunks.h"
#include "server/api/view_validation.h"

namespace drape::api {
namespace {

using StepDone = std::function<void(Result<v1::StepResponse>)>;

// One step request under way.
struct StepCall {
  SessionLease session;
  std::string request_id;  // empty: not remembered
  ClothList cloths;
  std::vector<ChunkCloth> chunk_cloths;  // of the states in the answer; none: without states
  StepDone done;

  void End(Result<v1::StepResponse> answer) {
    EndRequest(session->request_memory(), request_id, answer);
    session = {};
    done(std::move(answer));
  }
};

void AddStates(std::vector<ChunkCloth> chunk_cloths, StepOutcome& outcome,
               v1::StepResponse& answer) {
  if (!outcome.states) return;
  ClothStates states;
  for (const ClothOutcome& cloth : outcome.cloths) states.cloths.push_back(cloth.stamp);
  states.columns = std::move(*outcome.states);
  StateChunker(std::move(chunk_cloths), std::move(states), UINT64_MAX)
      .Next(answer.mutable_states());
}

// `clock`: that of the scheduler.
Result<v1::StepResponse> ToAnswer(StepCall& call, StepOutcome outcome, const Clock& clock) {
  if (!outcome.status.ok()) return outcome.status;
  v1::StepResponse answer = ToProto(call.cloths, outcome);
  AddStates(std::move(call.chunk_cloths), outcome, answer);
  answer.mutable_timing()->set_encode_us(
      static_cast<uint64_t>(clock.NowUs() - outcome.device_done_us));
  return answer;
}

Status CheckStateBytes(const std::vector<ChunkCloth>& cloths, const StateFields& view,
                       ScalarType scalar, uint64_t max_bytes) {
  uint64_t rows = 0;
  for (const ChunkCloth& cloth : cloths) rows += cloth.row_count;
  const uint64_t bytes = rows * BytesPerRow(scalar, view);
  if (bytes <= max_bytes) return Status::Ok();
  return Status::InvalidField("view", "asks for " + std::to_string(bytes) + " bytes of states of " +
                                          std::to_string(rows) + " particles, at most " +
                                          std::to_string(max_bytes) +
                                          " fit into a Step answer: use ReadStates");
}

// What the answer will say of the states, if `view` asks for any.
Result<std::vector<ChunkCloth>> CheckStates(const ServiceContext& context, const StateFields& view,
                                            const ClothList& cloths) {
  if (!view.any()) return std::vector<ChunkCloth>();
  DRAPE_RETURN_IF_ERROR(CheckClothsHaveParticles(FieldPath("view"), view, cloths));
  std::vector<ChunkCloth> chunk_cloths = ChunkClothsOf(cloths, view);
  DRAPE_RETURN_IF_ERROR(CheckStateBytes(chunk_cloths, view, context.scheduler.description().scalar,
                                        context.limits.max_step_state_bytes));
  return chunk_cloths;
}

Result<StepWork> ToWork(const CheckedStep& checked, const std::string& session_name,
                        const ClothList& cloths) {
  Result<std::vector<PinControl>> pin_controls = MapPinControls(checked.pin_controls, cloths);
  if (!pin_controls.ok()) return pin_controls.status();
  Result<std::vector<ColliderControl>> colliders =
      MapColliderControls(checked.collider_controls, cloths);
  if (!colliders.ok()) return colliders.status();
  Result<std::vector<LengthControl>> lengths = MapLengthControls(checked.length_controls, cloths);
  if (!lengths.ok()) return lengths.status();
  Result<std::vector<LengthScale>> scales = MapLengthScales(checked.length_scales, cloths);
  if (!scales.ok()) return scales.status();
  StepWork work;
  work.tenant = session_name;
  for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
  work.steps = checked.steps;
  work.until_step = checked.until_step;
  work.expected_step = checked.expected_step;
  work.pin_controls = std::move(*pin_controls);
  work.collider_controls = std::move(*colliders);
  work.length_controls = std::move(*lengths);
  work.length_scales = std::move(*scales);
  work.report = checked.report;
  work.view = checked.view;
  return work;
}

}  // namespace

void StartStep(const ServiceContext& context, const v1::StepRequest& request,
               const CancelToken& cancel, StepDone done) {
  const Result<CheckedStep> checked =
      CheckStep(request, context.scheduler.limits().max_steps_per_request);
  if (!checked.ok()) return done(checked.status());
  Result<SessionLease> session = context.sessions.Find(request.session());
  if (!session.ok()) return done(session.status());
  Result<std::optional<v1::StepResponse>> known =
      BeginRequest<v1::StepResponse>((*session)->request_memory(), request.request_id(), request);
  if (!known.ok()) return done(known.status());
  if (known->has_value()) return done(std::move(**known));

  const auto call = std::make_shared<StepCall>(
      StepCall{std::move(*session), request.request_id(), {}, {}, std::move(done)});
  Result<ClothList> cloths = call->session->FindCloths(checked->cloths);
  if (!cloths.ok()) return call->End(cloths.status());
  call->cloths = std::move(*cloths);
  if (call->cloths.empty()) return call->End(v1::StepResponse());

  Result<StepWork> work = ToWork(*checked, call->session->name(), call->cloths);
  if (!work.ok()) return call->End(work.status());
  Result<std::vector<ChunkCloth>> chunk_cloths = CheckStates(context, checked->view, call->cloths);
  if (!chunk_cloths.ok()) return call->End(chunk_cloths.status());
  call->chunk_cloths = std::move(*chunk_cloths);
  // One with an id is completed whoever has gone: its repetition asks for the answer.
  if (call->request_id.empty()) work->cancel = cancel;
  work->done = [call, &clock = context.clock](StepOutcome outcome) {
    call->End(ToAnswer(*call, std::move(outcome), clock));
  };
  const Status submitted = context.scheduler.Submit(std::move(*work));
  if (!submitted.ok()) call->End(submitted);
}

}  // namespace drape::api
