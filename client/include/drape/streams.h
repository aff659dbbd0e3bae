// The long-lived calls of a session.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "drape/states.h"
#include "drape/v1/run.pb.h"
#include "drape/v1/simulation_service.pb.h"
#include "drape/v1/step.pb.h"

namespace drape {
inline namespace client {

// A step, and the states after it that its view asked for. `answer` is without them.
struct SteppedStates {
  v1::StepResponse answer;
  States states;
};

// Step requests on one stream, answered in order; requests of the same cloth are also done in
// order. Several may wait for answers at once. If the next request does not need the last answer,
// keep two in flight: one waits in the server while the other one is stepped, and the device never
// waits.
//
//   stream.Write(request);
//   for (...) {
//     stream.Write(request);  // the next one
//     const auto answer = stream.Read();
//   }
//
// After a cut, repeat what has no answer (with its request_id) one by one: the first may still be
// under way, and those behind it would overtake it.
//
// One thread may write while another reads; Cancel from any thread. Destruction cancels what is
// still under way.
class StepStream {
 public:
  StepStream(StepStream&&) noexcept;
  StepStream& operator=(StepStream&&) noexcept;
  ~StepStream();

  // Sends a request; `session` is filled in. The server takes 16 at once: with more it may wait
  // until answers are read. Throws when the stream has ended.
  void Write(v1::StepRequest request);
  // Waits for the next answer. Throws the stream's error; unset when the stream ended without one
  // after FinishWriting().
  std::optional<v1::StepResponse> Read();
  // The same of a request with `in_chunks`, for large answers: its messages come in chunks of about
  // 1 MiB, whose states stay where they arrived. (Read brings them one by one.)
  std::optional<SteppedStates> ReadStates();
  // No more requests will come.
  void FinishWriting();
  void Cancel();

 private:
  friend class Session;
  struct Impl;
  explicit StepStream(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

// The server steps cloths by itself, at a pace, as long as this exists: see Run of the service. One
// thread reads; the rest from any thread. Destruction ends the run, at once.
//
//   RunStream run = session.Run(start);  // e.g. real time, which is the default
//   while (const auto report = run.Next()) Show(*report);
class RunStream {
 public:
  RunStream(RunStream&&) noexcept;
  RunStream& operator=(RunStream&&) noexcept;
  ~RunStream();

  // Waits for the next report; the first one comes when the run has begun. Throws what ended the
  // run, whose metadata `steps` says how many are complete; unset after the last report.
  std::optional<v1::RunReport> Next();
  // Paused: no step begins. A report follows.
  void SetPaused(bool is_paused);
  // Ends the run after the steps under way; the last report follows.
  void Stop();
  void Cancel();

 private:
  friend class Session;
  struct Impl;
  explicit RunStream(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

// Frames of states while others step the cloths. With delivery LATEST always the latest: frames
// that a slow reader misses are counted. With EVERY_FRAME all of them: a reader that falls behind
// gets kResourceExhausted, SLOW_CONSUMER, whose metadata `last_frame` and `last_step` say what it
// has got. One thread reads; the rest from any thread.
class StateStream {
 public:
  StateStream(StateStream&&) noexcept;
  StateStream& operator=(StateStream&&) noexcept;
  ~StateStream();

  // Waits for a whole frame and, with LATEST, grants the server the credit for another. Throws the
  // stream's error (kCancelled after Cancel()); unset when the server ended the stream.
  std::optional<States> Next();
  // Paused: the server sends nothing. With EVERY_FRAME this ends the stream with kInvalidArgument.
  void SetPaused(bool is_paused);
  // Ends the stream. With EVERY_FRAME the frames of all steps that have been answered still come.
  void Stop();
  void Cancel();

 private:
  friend class Session;
  struct Impl;
  explicit StateStream(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace client
}  // namespace drape
