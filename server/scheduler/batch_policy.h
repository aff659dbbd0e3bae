// Who takes part in the next batch. Pure: no clock, no state, no thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace drape {

// A request that may be stepped now: every cloth of it has the turn (cloth_runtime.h).
struct RunnableRequest {
  uint32_t tenant = 0;       // index into the tenants
  uint32_t cloth_count = 0;  // cloths of it that have steps left; >= 1
  // The round in which it last took part or, before that, in which it arrived. Inside a tenant the
  // one that waited longest goes first, in order of arrival where equal.
  uint64_t last_round = 0;
};

struct BatchLimits {
  uint32_t max_cloths = 16384;  // >= 1
  // Places that a tenant gets per turn of the round robin, >= 1. Small: fair within one batch;
  // large: fewer turns to make.
  uint32_t quantum_cloths = 256;
};

// The state of the deficit round robin between batches, kept by the caller.
struct FairShare {
  uint32_t first_tenant = 0;  // whose turn it is
  // [tenant_count] places left of a turn that a full batch cut short.
  std::vector<uint32_t> deficits;
};

// `cloth_count` cloths of request `request` (index into the input) are stepped.
struct BatchTake {
  uint32_t request = 0;
  uint32_t cloth_count = 0;
};

struct BatchChoice {
  std::vector<BatchTake> takes;  // each request at most once
  FairShare share;               // for the next call
};

// Deficit round robin over tenants (Shreedhar and Varghese 1996), one cloth = one place. Everybody
// who fits is taken; if not all fit, tenants share the places by turns of quantum_cloths, and the
// next batch goes on with the turn where this one was full. Work-conserving: places stay empty only
// if no cloth waits. No request waits for ever: with T tenants of R requests each and the limits of
// this call, a request takes part within T * R * ceil(largest request / quantum) turns of the round
// robin. `requests` in order of arrival.
BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits);

}  // namespace drape
