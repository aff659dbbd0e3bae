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

const std::string& OwnerOf(const std::string& session, const std::string& tenant) {
  return tenant.empty() ? session : tenant;
}

// The front has had its turn, and has nothing more if it `is_empty`.
template <class Turns>
void EndTurn(Turns& turns, bool is_empty) {
  if (is_empty) {
    turns.pop_front();
  } else {
    turns.splice(turns.end(), turns, turns.begin());
  }
}

}  // namespace

void PictureQueue::Push(PictureJob job) {
  const std::string& name = OwnerOf(job.session, job.tenant);
  auto owner = std::ranges::find(owners_, name, &OwnerJobs::owner);
  if (owner == owners_.end()) owner = owners_.insert(owners_.end(), {name, {}});
  std::list<SessionJobs>& sessions = owner->sessions;
  auto session = std::ranges::find(sessions, job.session, &SessionJobs::session);
  if (session == sessions.end()) session = sessions.insert(sessions.end(), {job.session, {}});
  session->jobs.push_back(std::move(job));
}

size_t PictureQueue::size() const {
  size_t count = returned_.size();
  for (const OwnerJobs& owner : owners_) {
    for (const SessionJobs& session : owner.sessions) count += session.jobs.size();
  }
  return count;
}

size_t PictureQueue::size_of(const std::string& session, const std::string& tenant) const {
  const auto owner = std::ranges::find(owners_, OwnerOf(session, tenant), &OwnerJobs::owner);
  if (owner == owners_.end()) return 0;
  size_t count = 0;
  for (const SessionJobs& its : owner->sessions) count += its.jobs.size();
  return count;
}

const PictureJob& PictureQueue::Next() const {
  DRAPE_CHECK(!empty(), "no picture waits");
  return returned_.empty() ? owners_.front().sessions.front().jobs.front() : returned_.front();
}

PictureJob PictureQueue::Pop() {
  DRAPE_CHECK(!empty(), "no picture waits");
  if (!returned_.empty()) {
    PictureJob job = std::move(returned_.front());
    returned_.pop_front();
    return job;
  }
  std::list<SessionJobs>& sessions = owners_.front().sessions;
  std::deque<PictureJob>& jobs = sessions.front().jobs;
  PictureJob job = std::move(jobs.front());
  jobs.pop_front();
  EndTurn(sessions, jobs.empty());
  EndTurn(owners_, sessions.empty());
  return job;
}

std::vector<PictureJob> PictureQueue::TakeCancelled() {
  std::vector<PictureJob> cancelled;
  MoveCancelled(returned_, cancelled);
  for (OwnerJobs& owner : owners_) {
    for (SessionJobs& session : owner.sessions) MoveCancelled(session.jobs, cancelled);
    owner.sessions.remove_if([](const SessionJobs& session) { return session.jobs.empty(); });
  }
  owners_.remove_if([](const OwnerJobs& owner) { return owner.sessions.empty(); });
  return cancelled;
}

std::vector<PictureJob> PictureQueue::TakeAll() {
  std::vector<PictureJob> all;
  while (!empty()) all.push_back(Pop());
  return all;
}

}  // namespace drape::render
