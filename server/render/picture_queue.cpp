#include "server/render/picture_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/core/check.h"

namespace drape::render {
namespace {

void MoveCancelled(std::deque<PictureJob>& jobs, std::vector<PictureJob>& cancelled) {
  const auto first = std::stable_partition(
      jobs.begin(), jobs.end(), [](const PictureJob& job) { return !job.is_cancelled(); });
  std::move(first, jobs.end(), std::back_inserter(cancelled));
  jobs.erase(first, jobs.end());
}

}  // namespace

void PictureQueue::Push(PictureJob job) {
  auto tenant = std::find_if(tenants_.begin(), tenants_.end(),
                             [&](const Tenant& entry) { return entry.name == job.tenant; });
  if (tenant == tenants_.end()) tenant = tenants_.insert(tenants_.end(), {job.tenant, {}});
  tenant->jobs.push_back(std::move(job));
}

size_t PictureQueue::size() const {
  size_t count = returned_.size();
  for (const Tenant& tenant : tenants_) count += tenant.jobs.size();
  return count;
}

const PictureJob& PictureQueue::Next() const {
  DRAPE_CHECK(!empty(), "no picture waits");
  return returned_.empty() ? tenants_.front().jobs.front() : returned_.front();
}

PictureJob PictureQueue::Pop() {
  DRAPE_CHECK(!empty(), "no picture waits");
  std::deque<PictureJob>& jobs = returned_.empty() ? tenants_.front().jobs : returned_;
  PictureJob job = std::move(jobs.front());
  jobs.pop_front();
  if (&jobs == &returned_) return job;
  if (jobs.empty()) {
    tenants_.pop_front();
  } else {
    tenants_.splice(tenants_.end(), tenants_, tenants_.begin());
  }
  return job;
}

std::vector<PictureJob> PictureQueue::TakeCancelled() {
  std::vector<PictureJob> cancelled;
  MoveCancelled(returned_, cancelled);
  for (Tenant& tenant : tenants_) MoveCancelled(tenant.jobs, cancelled);
  tenants_.remove_if([](const Tenant& tenant) { return tenant.jobs.empty(); });
  return cancelled;
}

std::vector<PictureJob> PictureQueue::TakeAll() {
  std::vector<PictureJob> all;
  while (!empty()) all.push_back(Pop());
  return all;
}

}  // namespace drape::render
