#include "server/session/sliced_command.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

namespace drape {
namespace {

struct SlicedWork {
  Scheduler& scheduler;
  std::string owner;
  size_t count;
  size_t per_slice;
  std::function<Status(Backend&, size_t, size_t)> slice;
  std::function<void(Backend&, const Status&)> finish;
  size_t next = 0;
};

void RunNextSlice(const std::shared_ptr<SlicedWork>& work, Backend& backend) {
  const size_t end = std::min(work->count, work->next + work->per_slice);
  const Status status = work->slice(backend, work->next, end);
  work->next = end;
  if (!status.ok() || end == work->count) {
    work->finish(backend, status);
    return;
  }
  const bool is_taken =
      work->scheduler.PostCleanup(work->owner, [work](Backend& b) { RunNextSlice(work, b); });
  DRAPE_CHECK(is_taken, "the device thread takes commands as long as it runs one");
}

}  // namespace

size_t ClothsPerSlice(uint32_t particle_count) {
  return std::clamp<size_t>(kSliceParticles / std::max<uint32_t>(1, particle_count), 1,
                            kSliceCloths);
}

Status RunInSlices(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                   std::function<Status(Backend&, size_t begin, size_t end)> slice,
                   std::function<void(Backend&, const Status&)> finish) {
  const auto work = std::make_shared<SlicedWork>(
      SlicedWork{scheduler, owner, count, per_slice, std::move(slice), std::move(finish)});
  return scheduler.Post(owner, [work](Backend& backend) { RunNextSlice(work, backend); });
}

}  // namespace drape
