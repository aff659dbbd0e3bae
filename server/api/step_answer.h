// The answer to a step as one message, or as several of bounded size.
#pragma once

#include <cstdint>
#include <optional>

#include "drape/v1/step.pb.h"
#include "server/api/message_slices.h"
#include "server/api/shared_chunks.h"

namespace drape::api {

// Copies share the states. Not thread-safe; copies may be used on different threads.
class StepAnswer {
 public:
  StepAnswer() = default;
  // In one message: `answer`, which is without states, and `states`, a StateChunk; none if empty.
  explicit StepAnswer(v1::StepResponse answer, MessageSlices states = {});
  // In several: the first one has everything but states, reports and contacts, each one some more
  // of those. `answer` is without states, `chunks` makes theirs, of `state_bytes` together.
  StepAnswer(v1::StepResponse answer, std::optional<SharedChunks> chunks, uint64_t state_bytes);

  bool has_next() const { return has_next_; }
  // The next StepResponse, which says whether others follow.
  MessageSlices Next();
  // Of all messages together, about.
  uint64_t ByteSizeLong() const { return rest_.ByteSizeLong() + state_bytes_; }
  bool is_in_chunks() const { return is_in_chunks_; }

 private:
  bool HasMore() const;
  // What comes next but for the states.
  v1::StepResponse NextPart();

  // What comes first, and the reports and contacts of all messages.
  v1::StepResponse rest_;
  MessageSlices states_;  // in one message
  std::optional<SharedChunks> chunks_;
  uint64_t state_bytes_ = 0;
  int next_report_ = 0;
  int next_contact_ = 0;  // row of contact_impulses
  bool is_in_chunks_ = false;
  bool is_first_ = true;
  bool has_next_ = false;
};

}  // namespace drape::api
