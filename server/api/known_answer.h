// Requests with an id happen once: the answers in RequestMemory as messages.
#pragma once

#include <any>
#include <optional>
#include <string>

#include "server/api/simulation_service.h"

namespace drape::api {

// The remembered answer. None: the request has no id, or it is new and under way from now on.
// Errors as RequestMemory::Begin, and INVALID_ARGUMENT naming "request_id" if another method used
// the id.
template <class Response, class Request>
Result<std::optional<Response>> BeginRequest(RequestMemory& memory, const std::string& request_id,
                                             const Request& request) {
  if (request_id.empty()) return std::optional<Response>();
  const Result<std::any> known = memory.Begin(request_id, Fingerprint(request));
  if (!known.ok()) return known.status();
  if (!known->has_value()) return std::optional<Response>();
  const auto* answer = std::any_cast<Response>(&*known);
  if (answer == nullptr) {
    return Status::InvalidField("request_id", "was used for a different request");
  }
  return std::optional<Response>(*answer);
}

// Remembers a good answer; after an error the id may be used again.
template <class Response>
void EndRequest(RequestMemory& memory, const std::string& request_id,
                const Result<Response>& answer) {
  if (request_id.empty()) return;
  if (answer.ok()) {
    memory.Complete(request_id, *answer, answer->ByteSizeLong());
  } else {
    memory.Abandon(request_id);
  }
}

}  // namespace drape::api
