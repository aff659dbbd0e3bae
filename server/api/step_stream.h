// StepStream: several requests under way, answers in order.
#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "server/api/ending_stream.h"
#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/step_answer.h"

namespace drape::api {

// Reads while fewer than max_pipelined_steps requests are under way. The first request that fails
// ends the stream with its status, after the answers before it; later ones are cancelled. When the
// client has no more requests the stream ends after the last answer. Alive until gRPC and every
// request under way have let go of it.
class StepStreamReactor final : public EndingStream<Unparsed<v1::StepRequest>, grpc::ByteBuffer>,
                                public std::enable_shared_from_this<StepStreamReactor> {
 public:
  static StepStreamReactor* Start(const ServiceContext& context, Caller caller);

 private:
  // A request that was read and not answered yet.
  struct Slot {
    CancelToken cancel;
    RequestTag tag;
    std::optional<Result<StepAnswer>> answer;
    std::shared_ptr<void> held;  // until the answer has been written
  };

  StepStreamReactor(const ServiceContext& context, Caller caller)
      : EndingStream(context, std::move(caller)) {}

  void OnRequest(bool ok) override;
  void OnWritten(bool ok) override;
  void OnCancel() override;

  void OnAnswer(Slot& slot, Result<StepAnswer> answer);
  // With mutex_ held.
  void ReadNext();
  void WriteNext();
  void CancelAll();
  void Close(const Status& status);

  std::shared_ptr<void> place_;              // ServiceContext::OpenStream
  Unparsed<v1::StepRequest> request_;        // being read
  grpc::ByteBuffer response_;                // being written
  std::shared_ptr<void> held_;               // for it, if it is the last message of its answer
  std::deque<std::shared_ptr<Slot>> slots_;  // oldest first
  bool is_reading_ = false;                  // a request is being read or submitted
  bool is_read_over_ = false;                // the client sends no more
  bool is_writing_ = false;
  bool is_broken_ = false;  // the client has gone
  bool is_ended_ = false;   // End was called
};

}  // namespace drape::api
