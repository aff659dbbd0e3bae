// The reactor of unary calls that end later, on another thread.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <utility>

#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/status_mapping.h"
#include "server/core/memory_reserve.h"
#include "server/scheduler/step_work.h"
#include "server/session/session_registry.h"

namespace drape::api {

// Owns itself until gRPC is done with it. Until End the request and the response stay valid; the
// holder must call End exactly once, on any thread.
class UnaryCall final : public grpc::ServerUnaryReactor {
 public:
  static UnaryCall* New(RequestTag tag = {}) { return new UnaryCall(std::move(tag)); }

  // Keeps the session alive while the request is under way.
  SessionLease lease;
  // Dropped when the answer has been sent.
  std::shared_ptr<void> until_sent;
  Hold hold() {
    return [this](std::shared_ptr<void> held) { until_sent = std::move(held); };
  }
  // Set when the client has gone or its deadline has passed.
  CancelToken cancel;

  void End(const Status& status) {
    lease = {};
    tag_.Log(status);
    Finish(ToGrpcStatus(status));
  }

 private:
  explicit UnaryCall(RequestTag tag) : tag_(std::move(tag)) {}
  void OnCancel() override { cancel.Cancel(); }
  void OnDone() override { delete this; }
  // Neither reaction blocks or calls gRPC, so gRPC may call them on the thread that has news of the
  // call, instead of waking one of its own for each. gRPC names this as not for users: without it
  // everything works, for more (tests/bench/notes/service.md).
  bool InternalInlineable() override { return true; }

  const RequestTag tag_;
};

// Ends a call whose status is known at once.
inline grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, const Status& status,
                                        const RequestTag& tag = {}) {
  tag.Log(status);
  auto* reactor = context->DefaultReactor();
  reactor->Finish(ToGrpcStatus(status));
  return reactor;
}

// The same for a call without a valid token.
inline grpc::ServerUnaryReactor* Refuse(grpc::CallbackServerContext* context) {
  auto* reactor = context->DefaultReactor();
  reactor->Finish(Unauthenticated());
  return reactor;
}

// The same for an answer, which counts until it has been sent: its bytes, and the message, which
// stays until then and takes several times as much where it has many parts.
inline grpc::ServerUnaryReactor* AnswerCounted(ByteBudget& unread, const std::string& owner,
                                               const google::protobuf::Message& answer,
                                               const RequestTag& tag) {
  UnaryCall* call = UnaryCall::New(tag);
  Result<std::shared_ptr<void>> held =
      unread.Take(owner, answer.ByteSizeLong() + answer.SpaceUsedLong());
  if (held.ok()) call->until_sent = std::move(held).value();
  call->End(held.status());
  return call;
}

// Ends the call with the result's status, after `map` has put its value into the response.
template <class T, class Map>
std::function<void(Result<T>)> EndWith(UnaryCall* call, Map map) {
  return [call, map](Result<T> result) {
    Status status = result.status();
    if (result.ok()) {
      status = WithinMemory([&] {
        map(*result);
        return Status::Ok();
      });
    }
    call->End(status);
  };
}

}  // namespace drape::api
