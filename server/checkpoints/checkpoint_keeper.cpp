#include "server/checkpoints/checkpoint_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <future>
#include <set>
#include <utility>

#include "server/api/checkpoint_file.h"
#include "server/api/snapshot_reading.h"
#include "server/api/snapshot_writing.h"
#include "server/core/clock.h"
#include "server/core/memory_reserve.h"
#include "server/core/trace.h"
#include "server/session/sliced_command.h"

namespace drape {
namespace {

namespace fs = std::filesystem;

FormerSession DescriptionOf(const Session& session) {
  return {session.name(), session.display_name(), session.ttl_s(), session.tenant(),
          session.issued_ids()};
}

// The file of the session stays as it was.
void WarnOfFailure(const Session& session, const Status& status) {
  spdlog::warn("checkpoint_failed name={} status=\"{}\"", ShortSessionName(session.name()),
               status.ToString());
}

// Cloths that were deleted meanwhile are left out.
Status SaveAlive(Backend& backend, std::span<const std::shared_ptr<ClothRecord>> cloths,
                 ByteBudget& budget, SavedStates& saved) {
  ClothList alive(cloths.begin(), cloths.end());
  std::erase_if(alive, [](const auto& cloth) { return !cloth->runtime->is_alive(); });
  return SaveOnDevice(backend, alive, budget, "checkpoints", saved);
}

std::vector<fs::path> FilesIn(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace

double PauseAfterRound_s(double interval_s, double round_s) {
  return std::clamp(interval_s - 3 * round_s, std::min(round_s, interval_s), interval_s);
}

CheckpointKeeper::CheckpointKeeper(CheckpointOptions options, SessionRegistry& sessions,
                                   Scheduler& scheduler, const api::RequestLimits& limits,
                                   std::string version, std::string incarnation)
    : options_(std::move(options)),
      sessions_(sessions),
      scheduler_(scheduler),
      limits_(limits),
      version_(std::move(version)),
      incarnation_(std::move(incarnation)),
      budget_(std::make_shared<ByteBudget>("UNUSED", ByteBudget::Limit{"unlimited", UINT64_MAX / 2},
                                           ByteBudget::Limit{"unlimited", UINT64_MAX / 2}, 0)),
      expired_(fs::path(options_.folder) / "expired", options_.max_expired_bytes_per_tenant,
               WriteDurably),
      complete_until_us_(SteadyClock().NowUs()) {}

CheckpointKeeper::~CheckpointKeeper() {
  Stop();
}

fs::path CheckpointKeeper::PathOf(const std::string& session_name) const {
  return fs::path(options_.folder) / (FileStemOf(session_name) + ".checkpoint");
}

Status CheckpointKeeper::Start() {
  if (!is_on()) return Status::Ok();
  DRAPE_RETURN_IF_ERROR(expired_.Open());
  DRAPE_RETURN_IF_ERROR(folder_lock_.Take(options_.folder));
  std::error_code ignored;
  fs::permissions(options_.folder, fs::perms::owner_all, ignored);
  RemoveDrafts(options_.folder);
  CountStart();
  for (const fs::path& file : FilesIn(options_.folder, ".checkpoint")) Recover(file);
  sessions_.SetBeforeExpiry([this](const SessionPointer& session) { WriteExpired(session); });
  thread_ = std::thread([this] { Loop(); });
  return Status::Ok();
}

void CheckpointKeeper::CountStart() {
  const fs::path path = fs::path(options_.folder) / "starts";
  const Result<std::string> former = ReadWhole(path);  // none: the first
  start_ = former.ok() ? static_cast<uint32_t>(std::strtoul(former->c_str(), nullptr, 10)) + 1 : 1;
  const Status status = WriteDurably(path, std::to_string(start_) + "\n");
  if (!status.ok()) spdlog::warn("start_not_counted status=\"{}\"", status.ToString());
}

void CheckpointKeeper::Recover(const fs::path& file) {
  const Result<std::string> bytes = ReadWhole(file);
  const Status status = bytes.ok() ? RecoverSession(*bytes) : bytes.status();
  if (status.ok()) return;
  spdlog::error("session_lost file={} status=\"{}\"", file.string(), status.ToString());
  // Only what will never be readable gives up its name: a next start tries the others again.
  if (status.code() != StatusCode::kInvalidArgument) return;
  std::error_code ignored;
  fs::rename(file, file.string() + ".unreadable", ignored);
}

Status CheckpointKeeper::RecoverSession(const std::string& bytes) {
  DRAPE_ASSIGN_OR_RETURN(api::CheckpointHead head, api::ReadCheckpointHead(bytes));
  // Every start since it was written may have given ids; the session counts this one itself.
  if (head.stamp.start > 0 && start_ > head.stamp.start) {
    head.session.issued.returns += start_ - head.stamp.start - 1;
  }
  head.session.checkpoint_unix_s = head.stamp.written_unix_s;
  DRAPE_ASSIGN_OR_RETURN(SessionLease session, sessions_.Return(head.session));
  api::SnapshotTarget target{scheduler_.description(), limits_, nullptr, *session, false};
  Result<std::vector<SavedCloth>> cloths = api::ReadSnapshot(head.snapshot, target);
  const bool is_exact = cloths.ok() || cloths.status().reason() != "OTHER_BUILD";
  if (!is_exact) {
    target.is_inexact = true;
    cloths = api::ReadSnapshot(head.snapshot, target);
  }
  std::promise<Status> done;
  size_t count = 0;
  if (cloths.ok()) {
    count = cloths->size();
    session->ReturnCloths(std::move(*cloths), [&done](const Result<std::vector<ClothId>>& ids) {
      done.set_value(ids.status());
    });
  } else {
    done.set_value(cloths.status());
  }
  const Status status = done.get_future().get();
  if (!status.ok()) {
    sessions_.Delete(
        head.session.name, [](const Status&) {}, head.session.tenant);
    sessions_.RememberLost(head.session.name, head.session.tenant);
    return status;
  }
  // Its file is ours from now on: it goes when the session ends.
  digests_.try_emplace(head.session.name);
  spdlog::info("session_recovered name={} cloths={} age_s={:.1f} exact={} from={}",
               ShortSessionName(head.session.name), count, NowUnix_s() - head.stamp.written_unix_s,
               is_exact, head.stamp.incarnation);
  return Status::Ok();
}

void CheckpointKeeper::Loop() {
  trace::NameThread("checkpoints");
  const SteadyClock clock;
  double round_s = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    const std::chrono::duration<double> pause(PauseAfterRound_s(options_.interval_s, round_s));
    if (wake_.wait_for(lock, pause, [this] { return is_stopping_; })) return;
    lock.unlock();
    const int64_t begin_us = clock.NowUs();
    static_cast<void>(WriteRound());  // it has warned
    // A round in which little has changed says little of the next one.
    constexpr double kForgotten = 0.1;
    round_s =
        std::max(static_cast<double>(clock.NowUs() - begin_us) / 1e6, (1 - kForgotten) * round_s);
    WarnIfLate(round_s);
    lock.lock();
  }
}

void CheckpointKeeper::WarnIfLate(double round_s) {
  const bool is_late = 4 * round_s > options_.interval_s;
  if (is_late && !was_late_) {
    spdlog::warn(
        "checkpoints_late round_s={:.1f} interval_s={} message=\"writing takes so long that a "
        "crash "
        "may lose more than an interval\"",
        round_s, options_.interval_s);
  }
  was_late_ = is_late;
}

void CheckpointKeeper::Stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Result<SavedStates> CheckpointKeeper::Capture(const Session& session) {
  ClothList cloths;
  SavedStates saved;
  const auto outcome = std::make_shared<std::promise<Status>>();
  const std::string& owner = session.owner();
  const auto slice = [&](Backend& backend, size_t begin, size_t end) {
    return SaveAlive(backend, std::span(cloths).subspan(begin, end - begin), *budget_, saved);
  };
  const auto finish = [outcome](Backend&, const Status& status) { outcome->set_value(status); };
  // Within no update, and none comes between its slices.
  const bool is_taken = scheduler_.PostFirst(owner, [&](Backend& backend) {
    Result<ClothList> found = session.FindCloths({});  // of the moment that is saved
    if (!found.ok()) return finish(backend, found.status());
    cloths = std::move(found).value();
    ContinueAsOne(backend, scheduler_, owner, cloths.size(), ClothsPerSlice(cloths), slice, finish);
  });
  if (!is_taken) return DrainingStatus();
  DRAPE_RETURN_IF_ERROR(outcome->get_future().get());
  return saved;
}

Status CheckpointKeeper::WriteRound() {
  const std::lock_guard lock(round_mutex_);
  const trace::Span span("checkpoints");
  const int64_t begin_us = SteadyClock().NowUs();
  Status first;
  for (const SessionPointer& session : sessions_.All()) {
    const Result<SavedStates> saved = Capture(*session);
    if (!saved.ok()) WarnOfFailure(*session, saved.status());
    const Status status = saved.ok() ? Write(*session, *saved) : saved.status();
    if (first.ok()) first = status;
  }
  ForgetEnded(sessions_.All());  // some have ended meanwhile
  if (first.ok()) complete_until_us_ = begin_us;
  return first;
}

std::optional<double> CheckpointKeeper::age_s() const {
  if (!is_on()) return std::nullopt;
  return static_cast<double>(SteadyClock().NowUs() - complete_until_us_) / 1e6;
}

Status CheckpointKeeper::Write(const Session& session, const SavedStates& saved) {
  const auto written = WithinMemory([&] {
    return api::WriteCheckpoint(DescriptionOf(session), saved, scheduler_.description(), version_,
                                {incarnation_, NowUnix_s(), start_});
  });
  Status status = written.status();
  if (written.ok()) {
    std::string& digest = digests_[session.name()];
    if (digest == written->digest) return status;
    status = WriteDurably(PathOf(session.name()), written->bytes);
    if (status.ok()) digest = written->digest;
  }
  if (!status.ok()) WarnOfFailure(session, status);
  return status;
}

void CheckpointKeeper::ForgetEnded(const std::vector<SessionPointer>& live) {
  std::set<std::string> names;
  for (const SessionPointer& session : live) names.insert(session->name());
  std::erase_if(digests_, [&](const auto& entry) {
    if (names.contains(entry.first)) return false;
    std::error_code ignored;
    fs::remove(PathOf(entry.first), ignored);
    return true;
  });
}

Status CheckpointKeeper::KeepExpired(const Session& session, const SavedStates& saved) {
  if (saved.cloths.empty()) return Status::Ok();
  const auto bytes =
      WithinMemory([&] { return api::WriteSnapshot(saved, scheduler_.description(), version_); });
  if (!bytes.ok()) return bytes.status();
  Result<fs::path> path = expired_.Keep(session.tenant(), session.name(), *bytes);
  if (!path.ok() && path.status().reason() == "DISK_FULL") {
    // The room that it takes itself is the last that it may have.
    std::error_code ignored;
    fs::remove(PathOf(session.name()), ignored);
    path = expired_.Keep(session.tenant(), session.name(), *bytes);
  }
  if (!path.ok()) return path.status();
  spdlog::info("session_kept name={} file={}", ShortSessionName(session.name()), path->string());
  return Status::Ok();
}

void CheckpointKeeper::WriteExpired(const SessionPointer& session) {
  const std::lock_guard lock(round_mutex_);
  const Result<SavedStates> saved = Capture(*session);
  const Status status = saved.ok() ? KeepExpired(*session, *saved) : saved.status();
  digests_.erase(session->name());
  // The server ends, and has written it with all others, or will.
  if (status.reason() == "DRAINING") return;
  if (!status.ok()) {
    spdlog::error("expired_session_lost name={} status=\"{}\"", ShortSessionName(session->name()),
                  status.ToString());
  }
  std::error_code ignored;
  fs::remove(PathOf(session->name()), ignored);
}

DeviceCommand CheckpointKeeper::LastCommand(std::function<void()> on_written) {
  if (!is_on()) return {};
  return [this, on_written = std::move(on_written)](Backend& backend) {
    // Whoever holds it waits for the disk alone: this thread has done all commands by now.
    const std::lock_guard lock(round_mutex_);
    const std::vector<SessionPointer> live = sessions_.All();
    size_t written = 0;
    for (const SessionPointer& session : live) {
      // Written one by one: all of them together may not fit into memory.
      SavedStates saved;
      const Result<ClothList> cloths = session->FindCloths({});
      Status status = cloths.status();
      if (status.ok()) {
        status = WithinMemory([&] { return SaveAlive(backend, *cloths, *budget_, saved); });
      }
      if (status.ok()) {
        written += Write(*session, saved).ok();  // else it has warned
      } else {
        WarnOfFailure(*session, status);
      }
      on_written();
    }
    ForgetEnded(live);
    spdlog::log(written < live.size() ? spdlog::level::err : spdlog::level::info,
                "checkpoints_written sessions={} of={}", written, live.size());
  };
}

}  // namespace drape
