// How a stream both ways ends, so that its client gets everything, behind proxies too.
#pragma once

#include <grpcpp/alarm.h>
#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "server/api/simulation_service.h"

namespace drape::api {

// How long a stream that has ended waits for its client to close its sending side; a draining
// server ends it soon.
inline constexpr std::chrono::milliseconds kHalfCloseGrace{60'000};
inline constexpr std::chrono::milliseconds kHalfCloseGraceOfDrain{500};

// gRPC resets a stream that ends while its client could still send. HAProxy passes that on, as
// RST_STREAM(CANCEL), right behind the status, and gRPC's client then forgets what it has not read,
// and often the status. So a client that asks for it (kHalfCloseHeader) is told of the end by a
// last message, closes its sending side, and then gets the status: nothing is reset. One that does
// not close it in time gets the status without.
//
// Owns itself until gRPC is done with it. Requests come by Read, not StartRead.
template <class Request, class Response>
class EndingStream : public grpc::ServerBidiReactor<Request, Response> {
 protected:
  EndingStream(const ServiceContext& context, Caller caller)
      : context_(context), caller_(std::move(caller)) {}

  // What OnReadDone and OnWriteDone are for other reactors, up to End. Without mutex_.
  virtual void OnRequest(bool ok) = 0;
  virtual void OnWritten(bool ok) = 0;

  // With mutex_ held.
  void Read(Request* request) {
    is_reading_ = true;
    this->StartRead(request);
  }

  // In the place of Finish: once, with mutex_ held, and no write under way. `last`: the message
  // with `is_end`.
  void End(const grpc::Status& status, Response last) {
    if (!caller_.half_closes || has_half_closed_) {
      phase_ = Phase::kOver;
      return this->Finish(status);
    }
    status_ = status;
    last_ = std::move(last);
    phase_ = Phase::kTelling;
    if (!is_reading_) Read(&ignored_);
    this->StartWrite(&last_);
  }

  const ServiceContext& context_;
  const Caller caller_;
  std::shared_ptr<EndingStream> self_;  // until OnDone
  std::mutex mutex_;

 private:
  enum class Phase { kOpen, kTelling, kWaiting, kOver };

  void OnReadDone(bool ok) final {
    {
      const std::lock_guard lock(mutex_);
      is_reading_ = false;
      if (!ok) has_half_closed_ = true;
      if (phase_ != Phase::kOpen) {
        if (ok && phase_ != Phase::kOver) Read(&ignored_);
        if (!ok && phase_ == Phase::kWaiting) FinishNow();
        return;
      }
    }
    OnRequest(ok);
  }

  void OnWriteDone(bool ok) final {
    {
      const std::lock_guard lock(mutex_);
      if (phase_ == Phase::kTelling) {
        phase_ = Phase::kWaiting;
        if (!ok || has_half_closed_) return FinishNow();
        return WaitForClient();
      }
    }
    OnWritten(ok);
  }

  void OnDone() final { const std::shared_ptr<EndingStream> last = std::move(self_); }

  void WaitForClient() {
    const auto grace = context_.scheduler.is_draining() ? kHalfCloseGraceOfDrain : kHalfCloseGrace;
    grace_.emplace();
    grace_->Set(std::chrono::system_clock::now() + grace,
                [stream = std::weak_ptr(self_)](bool is_time) {
                  const std::shared_ptr<EndingStream> alive = stream.lock();
                  if (!is_time || !alive) return;
                  const std::lock_guard lock(alive->mutex_);
                  if (alive->phase_ == Phase::kWaiting) alive->FinishNow();
                });
  }

  void FinishNow() {
    phase_ = Phase::kOver;
    if (grace_) grace_->Cancel();
    this->Finish(status_);
  }

  Phase phase_ = Phase::kOpen;
  bool is_reading_ = false;
  bool has_half_closed_ = false;  // the client sends no more
  grpc::Status status_;
  Response last_;
  Request ignored_;  // what comes after the end
  std::optional<grpc::Alarm> grace_;
};

}  // namespace drape::api
