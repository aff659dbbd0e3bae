#include "server/scheduler/batch_policy.h"

#include <algorithm>
#include <numeric>

namespace drape {
namespace {

// The requests of one tenant in the order in which they are served.
struct TenantQueue {
  std::vector<uint32_t> requests;
  size_t next = 0;  // the first one that is not wholly taken

  bool is_empty() const { return next == requests.size(); }
};

std::vector<TenantQueue> QueuesByTenant(std::span<const RunnableRequest> requests) {
  std::vector<TenantQueue> queues;
  for (uint32_t r = 0; r < requests.size(); ++r) {
    if (requests[r].tenant >= queues.size()) queues.resize(requests[r].tenant + 1);
    queues[requests[r].tenant].requests.push_back(r);
  }
  for (TenantQueue& queue : queues) {
    std::stable_sort(queue.requests.begin(), queue.requests.end(), [&](uint32_t a, uint32_t b) {
      return requests[a].last_round < requests[b].last_round;
    });
  }
  return queues;
}

// A batch that is being filled.
struct OpenBatch {
  std::span<const RunnableRequest> requests;
  uint64_t room = 0;            // places left
  std::vector<uint32_t> taken;  // [request] cloths
  bool is_empty = true;

  // Places of the next cloth of a queue that is not empty.
  uint64_t NextPlaces(const TenantQueue& queue) const {
    const uint32_t r = queue.requests[queue.next];
    return requests[r].places[taken[r]];
  }
  // A cloth that needs more than there are in all has a batch of its own.
  bool Fits(uint64_t places) const { return places <= room || is_empty; }
  void TakeNext(TenantQueue& queue) {
    const uint32_t r = queue.requests[queue.next];
    room -= std::min(room, NextPlaces(queue));
    is_empty = false;
    if (++taken[r] == requests[r].places.size()) ++queue.next;
  }
};

// The round robin proper, for when not everybody fits. Ends: more places are wanted than there are.
FairShare ShareOut(FairShare share, uint32_t quantum_places, OpenBatch& batch) {
  std::vector<TenantQueue> queues = QueuesByTenant(batch.requests);
  const auto tenant_count = static_cast<uint32_t>(queues.size());
  share.deficits.resize(tenant_count, 0);
  share.first_tenant %= tenant_count;
  while (true) {
    TenantQueue& queue = queues[share.first_tenant];
    uint64_t& deficit = share.deficits[share.first_tenant];
    if (!share.has_turn_begun && !queue.is_empty()) deficit += quantum_places;
    share.has_turn_begun = true;
    while (!queue.is_empty() && batch.NextPlaces(queue) <= deficit) {
      if (!batch.Fits(batch.NextPlaces(queue))) return share;
      deficit -= batch.NextPlaces(queue);
      batch.TakeNext(queue);
    }
    // Who has nothing left to do saves nothing up.
    if (queue.is_empty()) deficit = 0;
    share.first_tenant = (share.first_tenant + 1) % tenant_count;
    share.has_turn_begun = false;
    if (batch.room == 0) return share;
  }
}

}  // namespace

BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits) {
  BatchChoice choice;
  choice.share = share;
  uint64_t wanted = 0;
  for (const RunnableRequest& request : requests) {
    wanted = std::accumulate(request.places.begin(), request.places.end(), wanted);
  }
  OpenBatch batch{requests, limits.max_places, std::vector<uint32_t>(requests.size(), 0)};
  if (wanted <= limits.max_places) {
    for (size_t r = 0; r < requests.size(); ++r) {
      batch.taken[r] = static_cast<uint32_t>(requests[r].places.size());
    }
    choice.share = {share.first_tenant, false, {}};  // nobody has to wait: all begin anew
  } else {
    choice.share = ShareOut(share, limits.quantum_places, batch);
  }
  for (uint32_t r = 0; r < requests.size(); ++r) {
    if (batch.taken[r] > 0) choice.takes.push_back({r, batch.taken[r]});
  }
  return choice;
}

}  // namespace drape
