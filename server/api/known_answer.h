// Requests with an id happen once: the answers in RequestMemory as messages.
#pragma once

#include <any>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "server/api/simulation_service.h"
#include "server/api/unary_call.h"
#include "server/core/memory_reserve.h"

namespace drape::api {

// The remembered answer. None: the request has no id, or it is new and under way from now on.
// Errors as RequestMemory::Begin, and INVALID_ARGUMENT naming "request_id" if another method used
// the id. `content`: what belongs to the request beside its message.
template <class Response, class Request>
Result<std::optional<Response>> BeginRequest(RequestMemory& memory, const std::string& request_id,
                                             const Request& request,
                                             std::string_view content = {}) {
  if (request_id.empty()) return std::optional<Response>();
  const Result<std::any> known =
      WithinMemory([&] { return memory.Begin(request_id, Fingerprint(request, content)); });
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

// `done`, after EndRequest.
template <class Response>
std::function<void(Result<Response>)> Remembering(std::shared_ptr<Session> session,
                                                  std::string request_id,
                                                  std::function<void(Result<Response>)> done) {
  if (request_id.empty()) return done;
  return [session = std::move(session), request_id = std::move(request_id),
          done = std::move(done)](Result<Response> answer) {
    EndRequest(session->request_memory(), request_id, answer);
    done(std::move(answer));
  };
}

// What ends the call and remembers its answer. Null: the call, which has its lease, has ended with
// the answer that is known already, or with an error.
template <class Response, class Request>
std::function<void(Result<Response>)> BeginOnce(UnaryCall* call, const Request& request,
                                                Response* response) {
  Result<std::optional<Response>> known =
      BeginRequest<Response>(call->lease->request_memory(), request.request_id(), request);
  const bool is_new = known.ok() && !known->has_value();
  if (!is_new) {
    if (known.ok()) *response = std::move(**known);
    call->End(known.status());
    return nullptr;
  }
  return Remembering<Response>(
      call->lease.session(), request.request_id(),
      EndWith<Response>(call, [response](Response& answer) { *response = std::move(answer); }));
}

// The same for what has nothing to answer.
template <class Response>
std::function<void(Status)> WithoutValue(std::function<void(Result<Response>)> end) {
  return [end = std::move(end)](const Status& status) {
    if (status.ok()) {
      end(Response());
    } else {
      end(status);
    }
  };
}

// Does what the request asks of its session, once: `act`(session, end) does, unless the answer is
// known already, and calls `end` with the answer.
template <class Response, class Request, class Act>
UnaryCall* DoOnce(const ServiceContext& context, const Caller& caller, const RequestTag& tag,
                  const Request& request, Response* response, Act act) {
  UnaryCall* call = UnaryCall::New(tag);
  Result<SessionLease> session = context.FindSession(caller, request.session());
  if (!session.ok()) {
    call->End(session.status());
    return call;
  }
  call->lease = std::move(session).value();
  if (const auto end = BeginOnce(call, request, response)) {
    const Status status = WithinMemory([&] {
      act(*call->lease, end);
      return Status::Ok();
    });
    if (!status.ok()) end(status);
  }
  return call;
}

// The same for cloths of the session: `act`(session, cloths, end). They are looked for only if the
// answer is not known: a repetition gets it also if they are gone meanwhile.
template <class Response, class Request, class Act>
UnaryCall* DoOnce(const ServiceContext& context, const Caller& caller, const RequestTag& tag,
                  const Request& request, Response* response, std::span<const ClothId> ids,
                  Act act) {
  return DoOnce(context, caller, tag, request, response,
                [ids, act = std::move(act)](Session& session, const auto& end) mutable {
                  Result<ClothList> cloths = session.FindCloths(ids);
                  if (!cloths.ok()) return end(cloths.status());
                  act(session, std::move(cloths).value(), end);
                });
}

}  // namespace drape::api
