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
  auto session = std::find_if(sessions_.begin(), sessions_.end(), [&](const SessionJobs& entry) {
    return entry.session == job.session;
  });
  if (session == sessions_.end()) session = sessions_.insert(sessions_.end(), {job.session, {}});
  session->jobs.push_back(std::move(job));
}

size_t PictureQueue::size() const {
  size_t count = returned_.size();
  for (const SessionJobs& session : sessions_) count += session.jobs.size();
  return count;
}

const PictureJob& PictureQueue::Next() const {
  DRAPE_CHECK(!empty(), "no picture waits");
  return returned_.empty() ? sessions_.front().jobs.front() : returned_.front();
}

PictureJob PictureQueue::Pop() {
  DRAPE_CHECK(!empty(), "no picture waits");
  std::deque<PictureJob>& jobs = returned_.empty() ? sessions_.front().jobs : returned_;
  PictureJob job = std::move(jobs.front());
  jobs.pop_front();
  if (&jobs == &returned_) return job;
  if (jobs.empty()) {
    sessions_.pop_front();
  } else {
    sessions_.splice(sessions_.end(), sessions_, sessions_.begin());
  }
  return job;
}

std::vector<PictureJob> PictureQueue::TakeCancelled() {
  std::vector<PictureJob> cancelled;
  MoveCancelled(returned_, cancelled);
  for (SessionJobs& session : sessions_) MoveCancelled(session.jobs, cancelled);
  sessions_.remove_if([](const SessionJobs& session) { return session.jobs.empty(); });
  return cancelled;
}

std::vector<PictureJob> PictureQueue::TakeAll() {
  std::vector<PictureJob> all;
  while (!empty()) all.push_back(Pop());
  return all;
}

}  // namespace drape::render
