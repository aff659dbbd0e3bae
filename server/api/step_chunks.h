// StepInChunks: one step request, whose answer comes in several messages.
#pragma once

#include <memory>

#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/step_answer.h"

namespace drape::api {

// Owns itself until gRPC is done with it.
class StepChunksReactor final : public grpc::ServerWriteReactor<v1::StepResponse> {
 public:
  static StepChunksReactor* Start(const ServiceContext& context, const Caller& caller,
                                  const v1::StepRequest& request);

 private:
  StepChunksReactor() = default;

  void OnWriteDone(bool ok) override;
  void OnCancel() override { cancel_.Cancel(); }
  void OnDone() override { delete this; }
  void WriteNext();
  void End(const Status& status);

  RequestTag tag_;
  CancelToken cancel_;          // the client has gone, or its deadline has passed
  std::shared_ptr<void> held_;  // until the answer has been sent
  StepAnswer answer_;
  v1::StepResponse message_;
};

}  // namespace drape::api
