// The choice of the cloths that take part in the next batch. Pure: no clock, no state, no thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace drape {

// A request that may be stepped now: it has the turn at every one of its cloths (cloth_runtime.h).
struct RunnableRequest {
  uint32_t session = 0;  // index into the sessions
  // The cost of the next step, >= 1, of each cloth, or world, that has steps left, in the order in
  // which they are taken; at least one. Most cloths cost 1.
  std::span<const uint32_t> costs;
  // The round in which it last took part or, before that, in which it arrived. Within a session the
  // request that has waited longest comes first; ties are in order of arrival.
  uint64_t last_round = 0;
  // Quanta that the session gets per turn, >= 1; the same for all its requests.
  uint32_t weight = 1;
};

struct BatchLimits {
  uint32_t max_cost = 16384;  // >= 1; a cloth that costs more is stepped alone
  // Cost that a session may use per turn of the round robin, >= 1. Small: fair within one batch;
  // large: fewer turns to make.
  uint32_t quantum = 256;
};

// The state of the deficit round robin between batches, kept by the caller.
struct FairShare {
  uint32_t first_session = 0;   // the session whose turn it is
  bool has_turn_begun = false;  // it has its quantum and continues with what is left
  // [session_count] cost that a session has not used yet: of a turn that a full batch cut short, or
  // saved up for a cloth that costs more than a quantum.
  std::vector<uint64_t> deficits;
};

// The next `count` of request `request` (index into the input) are stepped: cloths, or worlds.
struct BatchTake {
  uint32_t request = 0;
  uint32_t count = 0;
};

struct BatchChoice {
  std::vector<BatchTake> takes;  // each request at most once
  FairShare share;               // for the next call
};

// Deficit round robin over sessions (Shreedhar and Varghese 1996). If all cloths fit, all are
// taken. Otherwise sessions share the batch by turns of one quantum times their weight, and the
// next batch continues with the turn in which this one was full. A batch has room left only if no
// cloth waits, or if the next cloth does not fit. No request waits forever: with S sessions of R
// requests each and the limits of this call, a request takes part within S * R * ceil(cost of the
// largest request / quantum) turns of the round robin. `requests` in order of arrival.
BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits);

}  // namespace drape
