// Who takes part in the next batch. Pure: no clock, no state, no thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace drape {

// A request that may be stepped now: every cloth of it has the turn (cloth_runtime.h).
struct RunnableRequest {
  uint32_t tenant = 0;  // index into the tenants
  // Of each of its cloths that have steps left, in the order in which they are taken, the places
  // that it occupies, >= 1; at least one cloth.
  std::span<const uint32_t> places;
  // The round in which it last took part or, before that, in which it arrived. Inside a tenant the
  // one that waited longest goes first, in order of arrival where equal.
  uint64_t last_round = 0;
};

// A place is room for a cloth whose step costs little; one that costs more occupies several.
struct BatchLimits {
  uint32_t max_places = 16384;  // >= 1; a cloth that needs more is stepped alone
  // Places that a tenant gets per turn of the round robin, >= 1. Small: fair within one batch;
  // large: fewer turns to make.
  uint32_t quantum_places = 256;
};

// The state of the deficit round robin between batches, kept by the caller.
struct FairShare {
  uint32_t first_tenant = 0;    // whose turn it is
  bool has_turn_begun = false;  // it has got its places and goes on with what is left of them
  // [tenant_count] places that a tenant has not used: of a turn that a full batch cut short, or
  // saved up for a cloth that needs more than a turn gives.
  std::vector<uint64_t> deficits;
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

// Deficit round robin over tenants (Shreedhar and Varghese 1996). Everybody who fits is taken; if
// not all fit, tenants share the places by turns of quantum_places, and the next batch goes on with
// the turn where this one was full. Places stay empty only if no cloth waits, or the next one needs
// more than there are. No request waits for ever: with T tenants of R requests each and the limits
// of this call, a request takes part within T * R * ceil(places of the largest request / quantum)
// turns of the round robin. `requests` in order of arrival.
BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits);

}  // namespace drape
