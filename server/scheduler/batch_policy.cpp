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

// Takes up to `places` cloths from the front of the queue; returns how many.
uint32_t TakeFromQueue(std::span<const RunnableRequest> requests, uint32_t places,
                       TenantQueue& queue, std::vector<uint32_t>& taken) {
  uint32_t total = 0;
  while (total < places && !queue.is_empty()) {
    const uint32_t r = queue.requests[queue.next];
    const uint32_t take = std::min(places - total, requests[r].cloth_count - taken[r]);
    taken[r] += take;
    total += take;
    if (taken[r] == requests[r].cloth_count) ++queue.next;
  }
  return total;
}

// The round robin proper, for when not everybody fits. Fills `taken` [request].
FairShare ShareOut(std::span<const RunnableRequest> requests, FairShare share,
                   const BatchLimits& limits, std::vector<uint32_t>& taken) {
  std::vector<TenantQueue> queues = QueuesByTenant(requests);
  const auto tenant_count = static_cast<uint32_t>(queues.size());
  share.deficits.resize(tenant_count, 0);
  uint32_t tenant = share.first_tenant % tenant_count;
  uint32_t room = limits.max_cloths;
  while (room > 0) {  // ends: more cloths wait than there is room
    uint32_t& deficit = share.deficits[tenant];
    if (deficit == 0) deficit = limits.quantum_cloths;
    const uint32_t total = TakeFromQueue(requests, std::min(deficit, room), queues[tenant], taken);
    room -= total;
    deficit -= total;
    // Who has nothing left to do saves nothing up.
    if (queues[tenant].is_empty()) deficit = 0;
    if (deficit == 0) tenant = (tenant + 1) % tenant_count;
  }
  share.first_tenant = tenant;
  return share;
}

}  // namespace

BatchChoice SelectBatch(std::span<const RunnableRequest> requests, const FairShare& share,
                        const BatchLimits& limits) {
  BatchChoice choice;
  choice.share = share;
  std::vector<uint32_t> taken(requests.size(), 0);
  const uint64_t waiting = std::accumulate(
      requests.begin(), requests.end(), uint64_t{0},
      [](uint64_t sum, const RunnableRequest& request) { return sum + request.cloth_count; });
  if (waiting <= limits.max_cloths) {
    for (size_t r = 0; r < requests.size(); ++r) taken[r] = requests[r].cloth_count;
    std::fill(choice.share.deficits.begin(), choice.share.deficits.end(), 0);
  } else {
    choice.share = ShareOut(requests, share, limits, taken);
  }
  for (uint32_t r = 0; r < requests.size(); ++r) {
    if (taken[r] > 0) choice.takes.push_back({r, taken[r]});
  }
  return choice;
}

}  // namespace drape
