// The reactor of calls with one request whose answer comes in several messages.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <string>
#include <utility>

#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/status_mapping.h"
#include "server/core/memory_reserve.h"
#include "server/scheduler/step_work.h"
#include "server/session/session_registry.h"

namespace drape::api {

// Owns itself until gRPC is done with it. A derived class calls WriteNext once its answer is there,
// or End, exactly one of the two and once, on any thread.
template <class Message>
class ChunkedCall : public grpc::ServerWriteReactor<Message> {
 public:
  // Begins a call of `method`, for which Call::Begin finds, submits and returns at once; an error:
  // neither WriteNext nor End will be called.
  template <class Call, class Request>
  static Call* Start(const char* method, const ServiceContext& context, const Caller& caller,
                     const Request& request) {
    auto* call = new Call();
    if (caller.is_refused) {
      call->Finish(Unauthenticated());
      return call;
    }
    call->tag_ = RequestTag(method, caller, request);
    const Status status = WithinMemory([&] { return call->Begin(context, caller, request); });
    if (!status.ok()) call->End(status);
    return call;
  }

 protected:
  void WriteNext() {
    const Result<bool> has_next = WithinMemory([&]() -> Result<bool> { return Next(&message_); });
    if (!has_next.ok() || !*has_next) return End(has_next.status());
    this->StartWrite(&message_);
  }

  void End(const Status& status) {
    DropAnswer();
    message_.Clear();
    held_ = nullptr;
    session_ = {};
    tag_.Log(status);
    this->Finish(ToGrpcStatus(status));
  }

  CancelToken cancel_;  // the client has gone, or its deadline has passed
  SessionLease session_;
  std::shared_ptr<void> held_;  // until the answer has been sent

 private:
  // Overwrites `message` with the next one of the answer. False: all have left.
  virtual bool Next(Message* message) = 0;
  // Gives back what the answer takes, before the client can ask again.
  virtual void DropAnswer() = 0;

  void OnWriteDone(bool ok) final {
    if (!ok) return End(ClientHasGone());
    WriteNext();
  }
  void OnCancel() final { cancel_.Cancel(); }
  void OnDone() final { delete this; }

  RequestTag tag_;
  Message message_;
};

}  // namespace drape::api
