// Step behind its handlers: check, find, submit, map, remember. Shared by Step, StepInChunks and
// StepStream.
#pragma once

#include <functional>

#include "drape/v1/step.pb.h"
#include "server/api/simulation_service.h"
#include "server/api/step_answer.h"

namespace drape::api {

enum class AnswerForm {
  kMessage,  // one, with all states
  kChunks,   // as many as it takes, of about RequestLimits::max_chunk_bytes each
};

// `hold` at most once, before `done`; `done` exactly once, on any thread, possibly before this
// returns. `request` is not used afterwards. `cancel` counts only for requests without a
// request_id.
void StartStep(const ServiceContext& context, const Caller& caller, const v1::StepRequest& request,
               AnswerForm form, const CancelToken& cancel, const Hold& hold,
               std::function<void(Result<StepAnswer>)> done);

}  // namespace drape::api
