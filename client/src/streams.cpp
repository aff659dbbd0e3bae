#include "drape/streams.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/src/errors.h"
#include "client/src/stream_impls.h"

namespace drape {
inline namespace client {
namespace {

// Frames in flight while the reader works on one: enough to hide the round trip, few enough that
// arriving frames are fresh.
constexpr uint32_t kInitialCredit = 2;

}  // namespace

void NoteSteps(const v1::StepResponse& response, std::atomic<uint64_t>& told_step) {
  if (response.steps().empty()) return;
  told_step = *std::ranges::max_element(response.steps());
}

void StepParts::Add(v1::StepResponse part) {
  if (part.has_states()) chunks_.push_back(std::move(*part.mutable_states()));
  part.clear_states();
  if (std::exchange(has_begun_, true)) {
    answer_.MergeFrom(part);
  } else {
    answer_ = std::move(part);
  }
  answer_.clear_continues();
}

StepStream::Impl::Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
                       std::shared_ptr<std::atomic<uint64_t>> shared_told_step)
    : BidirectionalCall(std::move(shared_connection), route),
      session(route.session),
      told_step(std::move(shared_told_step)) {
  stream = connection->stub->StepStream(&context);
}

StepStream::StepStream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StepStream::StepStream(StepStream&&) noexcept = default;
StepStream& StepStream::operator=(StepStream&&) noexcept = default;
StepStream::~StepStream() = default;

void StepStream::Write(v1::StepRequest request) {
  request.set_session(impl_->session);
  if (!impl_->Write(request)) {
    throw LocalError(ErrorCode::kFailedPrecondition, "STREAM_ENDED",
                     "the stream takes no more requests; Read() throws the reason");
  }
}

std::optional<v1::StepResponse> StepStream::Read() {
  v1::StepResponse response;
  if (impl_->stream->Read(&response)) {
    NoteSteps(response, *impl_->told_step);
    return response;
  }
  const grpc::Status status = impl_->Finish();
  if (status.ok()) return std::nullopt;
  ErrorDetails details = DecodeStatus(status);
  AddLoss(*impl_->told_step, &details);
  Throw(std::move(details));
}

std::optional<SteppedStates> StepStream::ReadStates() {
  StepParts parts;
  while (std::optional<v1::StepResponse> part = Read()) {
    const bool continues = part->continues();
    parts.Add(std::move(*part));
    if (!continues) return parts.Take();
  }
  return std::nullopt;
}

void StepStream::FinishWriting() {
  impl_->FinishWriting();
}
void StepStream::Cancel() {
  impl_->context.TryCancel();
}

RunStream::Impl::Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
                      v1::RunRequest::Start start)
    : BidirectionalCall(std::move(shared_connection), route) {
  stream = connection->stub->Run(&context);
  v1::RunRequest request;
  *request.mutable_start() = std::move(start);
  (void)Write(request);  // Next() reports a stream that has ended already
}

RunStream::RunStream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RunStream::RunStream(RunStream&&) noexcept = default;
RunStream& RunStream::operator=(RunStream&&) noexcept = default;
RunStream::~RunStream() = default;

std::optional<v1::RunReport> RunStream::Next() {
  v1::RunReport report;
  if (impl_->stream->Read(&report)) return report;
  ThrowIfFailed(impl_->Finish());
  return std::nullopt;
}

void RunStream::SetPaused(bool is_paused) {
  v1::RunRequest request;
  request.set_pause(is_paused);
  (void)impl_->Write(request);  // Next() reports a stream that has ended
}

void RunStream::Stop() {
  impl_->FinishWriting();
}
void RunStream::Cancel() {
  impl_->context.TryCancel();
}

StateStream::Impl::Impl(std::shared_ptr<Connection> shared_connection, const SessionRoute& route,
                        v1::StreamStatesRequest::Subscribe subscribe)
    : BidirectionalCall(std::move(shared_connection), route) {
  stream = connection->stub->StreamStates(&context);
  gives_credit = subscribe.delivery() != v1::StreamStatesRequest::EVERY_FRAME;
  if (gives_credit && subscribe.initial_credit() == 0) subscribe.set_initial_credit(kInitialCredit);
  v1::StreamStatesRequest request;
  *request.mutable_subscribe() = std::move(subscribe);
  (void)Write(request);  // Next() reports a stream that has ended already
}

StateStream::StateStream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StateStream::StateStream(StateStream&&) noexcept = default;
StateStream& StateStream::operator=(StateStream&&) noexcept = default;
StateStream::~StateStream() = default;

std::optional<States> StateStream::Next() {
  std::vector<v1::StateChunk> chunks;
  for (v1::StateChunk chunk; impl_->stream->Read(&chunk);) {
    const bool is_last = chunk.is_last();
    chunks.push_back(std::move(chunk));
    if (!is_last) continue;
    if (impl_->gives_credit) {
      v1::StreamStatesRequest credit;
      credit.set_credit(1);
      (void)impl_->Write(credit);  // the next call reports a stream that has ended
    }
    return States(std::move(chunks));
  }
  ThrowIfFailed(impl_->Finish());
  return std::nullopt;
}

void StateStream::SetPaused(bool is_paused) {
  v1::StreamStatesRequest request;
  request.set_pause(is_paused);
  (void)impl_->Write(request);  // Next() reports a stream that has ended
}

void StateStream::Stop() {
  impl_->FinishWriting();
}
void StateStream::Cancel() {
  impl_->context.TryCancel();
}

}  // namespace client
}  // namespace drape
