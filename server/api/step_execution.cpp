#include "server/api/step_execution.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/api/known_answer.h"
#include "server/api/mapping.h"
#include "server/api/request_validation.h"
#include "server/api/state_chunks.h"
#include "server/api/step_restart.h"
#include "server/api/view_validation.h"
#include "server/core/memory_reserve.h"
#include "server/core/trace.h"
#include "server/session/driven_lengths.h"

namespace drape::api {
namespace {

using StepDone = std::function<void(Result<StepAnswer>)>;

// One step request, from its arrival to its answer.
struct StepCall {
  StepDone done;
  SessionLease session;
  std::string request_id;  // set while the session remembers the request
  ClothList cloths;
  std::vector<ChunkCloth> chunk_cloths;  // of the states in the answer; none: without states
  ViewSpec view;
  AnswerForm form = AnswerForm::kMessage;

  // Exactly once.
  void End(Result<StepAnswer> answer) {
    if (!request_id.empty()) Remember(answer);
    session = {};
    done(std::move(answer));
  }
  // The same where all steps were made, but there is no answer.
  void EndWithoutAnswer(const Status& status) {
    session->request_memory().CompleteWithoutAnswer(request_id);
    session = {};
    done(Status(status.code(), status.reason(), status.message() + "; the steps were made"));
  }

 private:
  // An answer in chunks may be larger than anything that is kept: no others go for it.
  void Remember(const Result<StepAnswer>& answer) {
    RequestMemory& memory = session->request_memory();
    if (answer.ok() && answer.value().is_in_chunks() &&
        !memory.Keeps(answer.value().ByteSizeLong())) {
      memory.CompleteWithoutAnswer(request_id);
    } else {
      EndRequest(memory, request_id, answer);
    }
  }
};

// Makes the chunks of the states, each of at most so many bytes.
std::optional<StateChunker> ChunkerOf(StepCall& call, StepOutcome& outcome, uint64_t max_bytes) {
  if (!outcome.states) return std::nullopt;
  ClothStates states;
  for (const ClothOutcome& cloth : outcome.cloths) states.cloths.push_back(cloth.stamp);
  states.columns = std::move(*outcome.states);
  return StateChunker(std::move(call.chunk_cloths), std::move(states), max_bytes, call.view);
}

Result<StepAnswer> ToAnswer(StepCall& call, StepOutcome outcome, const ServiceContext& context) {
  if (!outcome.status.ok()) return outcome.status;
  if (!outcome.states_status.ok()) return outcome.states_status;
  const trace::Span span("encode_answer");
  v1::StepResponse answer = ToProto(call.cloths, outcome);
  const bool is_in_chunks = call.form == AnswerForm::kChunks;
  const uint64_t state_bytes =
      BytesSent(call.chunk_cloths, context.scheduler.description().scalar, call.view);
  std::optional<StateChunker> chunker =
      ChunkerOf(call, outcome, is_in_chunks ? context.limits.max_chunk_bytes : UINT64_MAX);
  MessageSlices states;
  if (chunker && !is_in_chunks) states = chunker->Next();
  answer.mutable_timing()->set_encode_us(
      static_cast<uint64_t>(context.clock.NowUs() - outcome.device_done_us));
  if (!is_in_chunks) return StepAnswer(std::move(answer), std::move(states));
  std::optional<SharedChunks> chunks;
  if (chunker) chunks.emplace(std::move(*chunker));
  return StepAnswer(std::move(answer), std::move(chunks), state_bytes);
}

// Of a row of ContactImpulses, at most.
constexpr uint64_t kContactBytes = 48;

// Of the contacts of all cloths, at most: everything touches everything.
uint64_t MostContactBytes(const ClothList& cloths) {
  uint64_t contacts = 0;
  for (const auto& cloth : cloths) {
    const auto description = cloth->description();
    const ClothParameters& parameters = description->parameters;
    const bool touches_cloth = parameters.self_collision.has_value() || parameters.is_in_world;
    contacts += uint64_t{description->model->particle_count()} *
                (parameters.colliders.size() + (touches_cloth ? 1 : 0));
  }
  return contacts * kContactBytes;
}

Status CheckContactBytes(const ClothList& cloths, uint64_t max_bytes) {
  const uint64_t bytes = MostContactBytes(cloths);
  if (bytes <= max_bytes) return Status::Ok();
  return Status::InvalidField(
      "contact_impulses", "may bring " + std::to_string(bytes) +
                              " bytes, if everything touches, at most " +
                              std::to_string(max_bytes) +
                              " fit into one message: use StepInChunks, or ask for fewer cloths");
}

Status CheckStateBytes(const std::vector<ChunkCloth>& cloths, const ViewSpec& view,
                       ScalarType scalar, uint64_t max_bytes) {
  uint64_t rows = 0;
  for (const ChunkCloth& cloth : cloths) rows += cloth.row_count;
  const uint64_t bytes = BytesSent(cloths, scalar, view);
  if (bytes <= max_bytes) return Status::Ok();
  return Status::InvalidField("view", "asks for " + std::to_string(bytes) + " bytes of states of " +
                                          std::to_string(rows) + " particles, at most " +
                                          std::to_string(max_bytes) +
                                          " fit into one message: use StepInChunks");
}

// The cloths whose states the answer will hold; none if `view` asks for no states.
Result<std::vector<ChunkCloth>> CheckStates(const ServiceContext& context, const ViewSpec& view,
                                            const ClothList& cloths, AnswerForm form) {
  if (!view.any()) return std::vector<ChunkCloth>();
  DRAPE_RETURN_IF_ERROR(CheckViewFits(FieldPath("view"), view, cloths));
  std::vector<ChunkCloth> chunk_cloths = ChunkClothsOf(cloths, view);
  if (form == AnswerForm::kChunks) return chunk_cloths;
  DRAPE_RETURN_IF_ERROR(CheckStateBytes(chunk_cloths, view, context.scheduler.description().scalar,
                                        context.limits.max_step_state_bytes));
  return chunk_cloths;
}

// About what an answer takes [bytes], known before it is made.
uint64_t AnswerBytes(const CheckedStep& checked, const StepCall& call, ScalarType scalar) {
  constexpr uint64_t kPerCloth = 64;
  constexpr uint64_t kPerReport = 256;
  constexpr uint64_t kPerImpulse = 64;
  uint64_t impulses = 0;
  for (const auto& cloth : call.cloths) {
    if (!checked.impulses) break;
    impulses += cloth->description()->model->pin_count() +
                cloth->description()->parameters.colliders.size();
  }
  return call.cloths.size() * (kPerCloth + (checked.report ? kPerReport : 0)) +
         impulses * kPerImpulse + (checked.contact_impulses ? MostContactBytes(call.cloths) : 0) +
         BytesRead(call.chunk_cloths, scalar, checked.view);
}

Result<StepWork> ToWork(const CheckedStep& checked, const Session& session,
                        const ClothList& cloths) {
  StepWork work;
  DRAPE_ASSIGN_OR_RETURN(const Descriptions becoming, AddRestarts(checked, session, cloths, work));
  DRAPE_ASSIGN_OR_RETURN(work.controls, ResolveControls(checked.controls, cloths, becoming));
  DRAPE_RETURN_IF_ERROR(session.ChargeDriven(DrivenBy(work.controls, cloths, becoming)));
  work.session = session.name();
  work.tenant = session.tenant();
  for (const auto& cloth : cloths) work.cloths.push_back(cloth->runtime);
  work.steps = checked.steps;
  work.until_step = checked.until_step;
  work.expected_step = checked.expected_step;
  work.report = checked.report;
  work.grip_states = checked.grip_states;
  work.impulses = checked.impulses;
  work.contacts = checked.contact_impulses;
  work.view = checked.view.FieldsRead();
  return work;
}

// Submits the request, or ends `call` with the answer that is known already. An error: the call has
// not ended.
Status Start(const ServiceContext& context, const Caller& caller, const v1::StepRequest& request,
             const CancelToken& cancel, const Hold& hold, const std::shared_ptr<StepCall>& call) {
  DRAPE_ASSIGN_OR_RETURN(const CheckedStep checked,
                         CheckStep(request, context.scheduler.limits().max_steps_per_request));
  DRAPE_ASSIGN_OR_RETURN(call->session, context.FindSession(caller, request.session()));
  DRAPE_ASSIGN_OR_RETURN(
      std::optional<StepAnswer> known,
      BeginRequest<StepAnswer>(call->session->request_memory(), request.request_id(), request,
                               call->form == AnswerForm::kChunks ? "in chunks" : ""));
  const std::string owner = call->session->owner();
  if (known.has_value()) {
    DRAPE_ASSIGN_OR_RETURN(auto held, context.unread->Take(owner, known->ByteSizeLong()));
    hold(std::move(held));
    call->End(std::move(*known));
    return Status::Ok();
  }
  call->request_id = request.request_id();
  DRAPE_ASSIGN_OR_RETURN(call->cloths, call->session->FindCloths(checked.cloths));
  if (call->cloths.empty()) {
    call->End(StepAnswer(v1::StepResponse()));
    return Status::Ok();
  }
  DRAPE_ASSIGN_OR_RETURN(StepWork work, ToWork(checked, *call->session, call->cloths));
  DRAPE_ASSIGN_OR_RETURN(call->chunk_cloths,
                         CheckStates(context, checked.view, call->cloths, call->form));
  if (checked.contact_impulses && call->form != AnswerForm::kChunks) {
    DRAPE_RETURN_IF_ERROR(CheckContactBytes(call->cloths, context.limits.max_step_state_bytes));
  }
  DRAPE_ASSIGN_OR_RETURN(
      auto held,
      context.unread->Take(
          owner, request.ByteSizeLong() +
                     AnswerBytes(checked, *call, context.scheduler.description().scalar)));
  call->view = checked.view;
  hold(std::move(held));
  // A request with an id is completed even if its client has gone: the repetition asks for the
  // answer.
  if (call->request_id.empty()) work.cancel = cancel;
  work.deadline_us = caller.deadline_us;
  work.done = [call, &context](StepOutcome outcome) {
    const bool are_steps_made = outcome.status.ok();
    Result<StepAnswer> answer =
        WithinMemory([&] { return ToAnswer(*call, std::move(outcome), context); });
    if (are_steps_made && !answer.ok()) return call->EndWithoutAnswer(answer.status());
    call->End(std::move(answer));
  };
  return context.scheduler.Submit(std::move(work));
}

}  // namespace

void StartStep(const ServiceContext& context, const Caller& caller, const v1::StepRequest& request,
               AnswerForm form, const CancelToken& cancel, const Hold& hold, StepDone done) {
  const auto call = std::make_shared<StepCall>();
  call->done = std::move(done);
  call->form = form;
  const Status status =
      WithinMemory([&] { return Start(context, caller, request, cancel, hold, call); });
  if (!status.ok()) call->End(status);
}

}  // namespace drape::api
