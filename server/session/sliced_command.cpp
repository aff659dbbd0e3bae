#include "server/session/sliced_command.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "server/core/memory_reserve.h"

namespace drape {
namespace {

struct SlicedWork {
  Scheduler& scheduler;
  std::string owner;
  bool is_one;  // RunAsOne
  size_t count;
  size_t per_slice;
  std::function<Status(Backend&, size_t, size_t)> slice;
  std::function<void(Backend&, const Status&)> finish;
  size_t next = 0;
};
using SlicedWorkPointer = std::shared_ptr<SlicedWork>;

void RunNextSlice(const SlicedWorkPointer& work, Backend& backend);

void PostNextSlice(const SlicedWorkPointer& work) {
  const auto command = [work](Backend& backend) { RunNextSlice(work, backend); };
  if (work->is_one) return work->scheduler.Continue(work->owner, command);
  const bool is_taken = work->scheduler.PostCleanup(work->owner, command);
  DRAPE_CHECK(is_taken, "the device thread takes commands as long as it runs one");
}

void RunNextSlice(const SlicedWorkPointer& work, Backend& backend) {
  const size_t end = std::min(work->count, work->next + work->per_slice);
  const Status status = WithinMemory([&] { return work->slice(backend, work->next, end); });
  work->next = end;
  if (!status.ok() || end == work->count) return work->finish(backend, status);
  PostNextSlice(work);
}

Status Post(const SlicedWorkPointer& work) {
  return work->scheduler.Post(work->owner,
                              [work](Backend& backend) { RunNextSlice(work, backend); });
}

}  // namespace

size_t ClothsPerSlice(uint64_t cost) {
  return std::clamp<size_t>(kSliceParticles / std::max<uint64_t>(1, cost), 1, kSliceCloths);
}

Status RunInSlices(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                   std::function<Status(Backend&, size_t begin, size_t end)> slice,
                   std::function<void(Backend&, const Status&)> finish) {
  return Post(std::make_shared<SlicedWork>(
      SlicedWork{scheduler, owner, false, count, per_slice, std::move(slice), std::move(finish)}));
}

Status RunAsOne(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                std::function<Status(Backend&, size_t begin, size_t end)> slice,
                std::function<void(Backend&, const Status&)> finish) {
  return Post(std::make_shared<SlicedWork>(
      SlicedWork{scheduler, owner, true, count, per_slice, std::move(slice), std::move(finish)}));
}

bool CleanUpAsOne(Scheduler& scheduler, const std::string& owner, size_t count, size_t per_slice,
                  std::function<Status(Backend&, size_t begin, size_t end)> slice,
                  std::function<void(Backend&, const Status&)> finish) {
  const auto work = std::make_shared<SlicedWork>(
      SlicedWork{scheduler, owner, true, count, per_slice, std::move(slice), std::move(finish)});
  return scheduler.PostCleanup(owner, [work](Backend& backend) { RunNextSlice(work, backend); });
}

void ContinueAsOne(Backend& backend, Scheduler& scheduler, const std::string& owner, size_t count,
                   size_t per_slice,
                   std::function<Status(Backend&, size_t begin, size_t end)> slice,
                   std::function<void(Backend&, const Status&)> finish) {
  const auto work = std::make_shared<SlicedWork>(
      SlicedWork{scheduler, owner, true, count, per_slice, std::move(slice), std::move(finish)});
  if (count == 0) return work->finish(backend, Status::Ok());
  if (count <= per_slice) return RunNextSlice(work, backend);
  PostNextSlice(work);
}

}  // namespace drape
