// StreamStates: frames against credits, always the latest state.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/api/request_log.h"
#include "server/api/simulation_service.h"
#include "server/api/state_chunks.h"

namespace drape::api {

// One subscription. Ends with OK when the client sends no more messages (what is being written is
// finished first), else with the status that ended it. Alive until gRPC and the scheduler's
// observer have let go of it; the subscription keeps its session alive.
class StateStreamReactor final
    : public grpc::ServerBidiReactor<v1::StreamStatesRequest, v1::StateChunk>,
      public std::enable_shared_from_this<StateStreamReactor> {
 public:
  static StateStreamReactor* Start(const ServiceContext& context, Caller caller);

 private:
  // A frame that is cut into chunks; `in_flight` frees its place when it has left.
  struct Frame {
    StateChunker chunker;
    uint64_t number = 0;
    uint64_t frames_dropped = 0;
    std::shared_ptr<void> in_flight;
  };

  StateStreamReactor(const ServiceContext& context, Caller caller)
      : context_(context), caller_(std::move(caller)) {}

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void OnFrame(ObservedFrame observed);
  // With mutex_ held.
  Status Take(const v1::StreamStatesRequest& request);
  Status Subscribe(const v1::StreamStatesRequest::Subscribe& request);
  void Close(const Status& status);
  void LoseClient();
  void WriteNext();

  const ServiceContext& context_;
  const Caller caller_;
  std::shared_ptr<StateStreamReactor> self_;  // until OnDone

  std::mutex mutex_;
  v1::StreamStatesRequest request_;  // being read
  v1::StateChunk chunk_;             // being written
  RequestTag tag_;
  SessionLease session_;
  std::vector<ChunkCloth> cloths_;  // of the subscription
  ViewSpec view_;
  std::shared_ptr<void> held_;  // for its frames
  std::shared_ptr<Observer> observer_;
  std::deque<Frame> frames_;      // to be written, oldest first
  std::optional<Status> ending_;  // set once: no more frames are taken
  bool is_writing_ = false;
  bool is_broken_ = false;  // the client has gone: nothing more can be written
  bool is_ended_ = false;   // Finish was called
};

}  // namespace drape::api
