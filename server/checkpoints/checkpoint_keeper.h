// Sessions on disk: written on an interval and at the end, recovered at the start.
#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/api/limits.h"
#include "server/checkpoints/durable_file.h"
#include "server/checkpoints/expired_files.h"
#include "server/core/byte_budget.h"
#include "server/core/status.h"
#include "server/scheduler/scheduler.h"
#include "server/session/session_registry.h"

namespace drape {

struct CheckpointOptions {
  std::string folder;  // empty: nothing is written
  double interval_s = 60;
  uint64_t max_expired_bytes_per_tenant = uint64_t{1} << 30;  // see ExpiredFiles
};

// Time from the end of a round to the next one. A crash loses what came after the moment that the
// last whole round saw: so rounds begin early by what they take, and what one takes may double,
// before that is more than the interval. Those that take more than a quarter of it keep the disk
// busy half of the time.
double PauseAfterRound_s(double interval_s, double round_s);

// Outlived by the scheduler and the registry. Errors of the disk are warnings: the files stay as
// they were, and the next round tries again.
class CheckpointKeeper {
 public:
  CheckpointKeeper(CheckpointOptions options, SessionRegistry& sessions, Scheduler& scheduler,
                   const api::RequestLimits& limits, std::string version, std::string incarnation);
  ~CheckpointKeeper();
  CheckpointKeeper(const CheckpointKeeper&) = delete;
  CheckpointKeeper& operator=(const CheckpointKeeper&) = delete;

  bool is_on() const { return !options_.folder.empty(); }
  // Makes and locks the folder, brings back the sessions that are in it, and begins to write.
  // Before any client; blocks. FILE_FAILED, FOLDER_IN_USE.
  Status Start();
  // Writes what has changed, and forgets sessions that have ended. Any thread but the device's. The
  // first error, after all that could be written was.
  Status WriteRound();

  // Since the last round began that could write everything, or the start: what happened before is
  // in the files. None: nothing is written. Thread-safe.
  std::optional<double> age_s() const;

  // The end: Stop, then Scheduler::Drain(grace, LastCommand()), which writes all sessions and calls
  // `on_written` after each.
  void Stop();
  DeviceCommand LastCommand(std::function<void()> on_written);

 private:
  using SessionPointer = std::shared_ptr<Session>;

  // In the file `starts` of the folder: a warning where it cannot be written.
  void CountStart();
  void Recover(const std::filesystem::path& file);
  Status RecoverSession(const std::string& bytes);
  void Loop();
  // Once, until rounds are quick again.
  void WarnIfLate(double round_s);
  // The session at one moment, between steps of its cloths; where it has more cloths or particles
  // than a slice (sliced_command.h), at one moment for each slice of them, but never within an
  // update or a load. Before the other commands of its owner that wait. Not on the device thread.
  Result<SavedStates> Capture(const Session& session);
  // Logs errors, too.
  Status Write(const Session& session, const SavedStates& saved);
  // The checkpoint of the session goes, whatever becomes of its cloths: it has ended, and must
  // neither take room from others nor come back.
  void WriteExpired(const SessionPointer& session);
  // Ok without cloths, too.
  Status KeepExpired(const Session& session, const SavedStates& saved);
  // Removes the files of those that it has written or recovered, and no others.
  void ForgetEnded(const std::vector<SessionPointer>& live);
  std::filesystem::path PathOf(const std::string& session_name) const;

  const CheckpointOptions options_;
  SessionRegistry& sessions_;
  Scheduler& scheduler_;
  const api::RequestLimits limits_;
  const std::string version_;
  const std::string incarnation_;
  const std::shared_ptr<ByteBudget> budget_;  // without limits
  const ExpiredFiles expired_;
  FolderLock folder_lock_;
  uint32_t start_ = 0;  // of the servers of the folder, from 1

  std::mutex round_mutex_;                      // one writer at a time
  std::map<std::string, std::string> digests_;  // of its files, by session; guarded by round_mutex_

  std::atomic<int64_t> complete_until_us_;  // by SteadyClock

  std::mutex mutex_;
  std::condition_variable wake_;
  bool is_stopping_ = false;
  bool was_late_ = false;  // the thread's own
  std::thread thread_;
};

}  // namespace drape
