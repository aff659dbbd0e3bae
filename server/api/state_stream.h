// StreamStates: the latest state against credits, or every frame.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "server/api/ending_stream.h"
#include "server/api/request_log.h"
#include "server/api/shared_chunks.h"
#include "server/api/simulation_service.h"
#include "server/api/stream_validation.h"

namespace drape::api {

// One subscription. One that falls behind with every frame ends with what it has got: the frame
// that was begun is completed, the others that wait are dropped. Ends with OK when the client sends
// no more messages (what is being written is finished first), else with the status that ended it.
// Alive until gRPC and the scheduler's observer have let go of it; the subscription keeps its
// session alive.
class StateStreamReactor final
    : public EndingStream<Unparsed<v1::StreamStatesRequest>, grpc::ByteBuffer>,
      public std::enable_shared_from_this<StateStreamReactor> {
 public:
  static StateStreamReactor* Start(const ServiceContext& context, Caller caller);

 private:
  // A frame that is cut into chunks; `in_flight` frees its place when it has left.
  struct Frame {
    SharedChunks chunks;
    uint64_t number = 0;
    uint64_t frames_dropped = 0;
    uint64_t step = 0;
    std::shared_ptr<void> in_flight;
  };

  StateStreamReactor(const ServiceContext& context, Caller caller)
      : EndingStream(context, std::move(caller)) {}

  void OnRequest(bool ok) override;
  void OnWritten(bool ok) override;
  void OnCancel() override;

  void OnFrame(ObservedFrame observed);
  // What is sent of it, made by the first stream that gets it.
  struct EncodedFrame {
    SharedChunks chunks;
    uint64_t step = 0;  // the lowest of its cloths
  };
  const EncodedFrame& Encoded(FrameContent& content) const;
  // With mutex_ held.
  Status Take(const v1::StreamStatesRequest& request);
  Status Subscribe(const v1::StreamStatesRequest::Subscribe& request);
  // Makes room for the frames that wait, in `spec` and among the bytes that its owner may hold.
  Status ReserveFrames(const CheckedSubscription& checked, const std::string& owner,
                       uint64_t request_bytes, ObserverSpec& spec);
  void Close(const Status& status);
  void LoseClient();
  void FinishReading();
  void WriteNext();
  // What End tells, with the last frame that was sent.
  grpc::Status EndStatus() const;

  std::shared_ptr<void> place_;                // ServiceContext::OpenStream
  Unparsed<v1::StreamStatesRequest> request_;  // being read
  grpc::ByteBuffer chunk_;                     // being written
  RequestTag tag_;
  SessionLease session_;
  std::vector<ChunkCloth> cloths_;  // of the subscription
  ViewSpec view_;
  std::shared_ptr<void> held_;  // for its frames
  std::shared_ptr<Observer> observer_;
  bool has_every_frame_ = false;
  bool is_finishing_ = false;     // the client wants no more than what has been stepped
  std::deque<Frame> frames_;      // to be written, oldest first
  uint64_t last_frame_ = 0;       // that was written
  uint64_t last_step_ = 0;        // in it
  std::optional<Status> ending_;  // set once: no more frames are taken
  bool is_writing_ = false;
  bool is_broken_ = false;  // the client has gone: nothing more can be written
  bool is_ended_ = false;   // End was called
};

}  // namespace drape::api
