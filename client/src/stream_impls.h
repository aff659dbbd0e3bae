// The implementations of the streams: one bidirectional gRPC call each.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "client/src/connection.h"
#include "drape/streams.h"

namespace drape {
inline namespace client {

// Keeps the highest step of an answer for errors that say what is lost.
void NoteSteps(const v1::StepResponse& response, std::atomic<uint64_t>& told_step);

// Joins the messages of an answer in chunks.
class StepParts {
 public:
  void Clear() { *this = {}; }
  void Add(v1::StepResponse part);
  // Throws Error (kInternal) if the states do not belong together.
  SteppedStates Take() { return {std::move(answer_), States(std::move(chunks_))}; }

 private:
  v1::StepResponse answer_;
  std::vector<v1::StateChunk> chunks_;
  bool has_begun_ = false;
};

// A bidirectional call. The reader asks for its status once, when nothing more comes.
template <class Request, class Response>
struct BidirectionalCall {
  using Stream = grpc::ClientReaderWriter<Request, Response>;

  BidirectionalCall(std::shared_ptr<Connection> shared_connection, const SessionRoute& route)
      : connection(std::move(shared_connection)) {
    connection->AddHeaders(&context, route);  // no deadline: streams last
  }
  BidirectionalCall(const BidirectionalCall&) = delete;
  BidirectionalCall& operator=(const BidirectionalCall&) = delete;
  ~BidirectionalCall() {
    if (is_finished) return;
    context.TryCancel();
    (void)stream->Finish();
  }

  // False when the stream has ended; the reader learns why.
  bool Write(const Request& request) {
    const std::lock_guard lock(write_mutex);
    return !has_finished_writing && stream->Write(request);
  }

  void FinishWriting() {
    const std::lock_guard lock(write_mutex);
    if (!has_finished_writing) stream->WritesDone();
    has_finished_writing = true;
  }

  // Reader's thread only.
  grpc::Status Finish() {
    if (!is_finished) status = stream->Finish();
    is_finished = true;
    return status;
  }

  const std::shared_ptr<Connection> connection;
  grpc::ClientContext context;
  std::unique_ptr<Stream> stream;
  std::mutex write_mutex;
  bool has_finished_writing = false;  // guarded by write_mutex
  bool is_finished = false;
  grpc::Status status;
};

struct StepStream::Impl : BidirectionalCall<v1::StepRequest, v1::StepResponse> {
  Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
       std::shared_ptr<std::atomic<uint64_t>> shared_told_step);

  const std::string session;
  const std::shared_ptr<std::atomic<uint64_t>> told_step;  // of the session
};

struct RunStream::Impl : BidirectionalCall<v1::RunRequest, v1::RunReport> {
  Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
       v1::RunRequest::Start start);
};

struct StateStream::Impl : BidirectionalCall<v1::StreamStatesRequest, v1::StateChunk> {
  Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
       v1::StreamStatesRequest::Subscribe subscribe);

  bool gives_credit = true;  // with delivery LATEST
};

}  // namespace client
}  // namespace drape
