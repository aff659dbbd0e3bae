// The answer to a step as one message, or as several of bounded size.
#pragma once

#include <cstdint>
#include <optional>

#include "drape/v1/step.pb.h"
#include "server/api/state_chunks.h"

namespace drape::api {

// Copies are as large as the answer. Not thread-safe.
class StepAnswer {
 public:
  StepAnswer() = default;
  // In one message.
  explicit StepAnswer(v1::StepResponse answer) : rest_(std::move(answer)), has_next_(true) {}
  // In several: the first one has everything but states and reports, each one some more of those.
  // `answer` is without states, `states` makes their chunks.
  StepAnswer(v1::StepResponse answer, std::optional<StateChunker> states, uint64_t state_bytes);

  bool has_next() const { return has_next_; }
  // Overwrites `message`, which says whether others follow.
  void Next(v1::StepResponse* message);
  // Of all messages together, about.
  uint64_t ByteSizeLong() const { return rest_.ByteSizeLong() + state_bytes_; }
  bool is_in_chunks() const { return is_in_chunks_; }

 private:
  bool HasMore() const;

  v1::StepResponse rest_;  // what comes first, and the reports of all messages
  std::optional<StateChunker> states_;
  uint64_t state_bytes_ = 0;
  int next_report_ = 0;
  bool is_in_chunks_ = false;
  bool is_first_ = true;
  bool has_next_ = false;
};

}  // namespace drape::api
