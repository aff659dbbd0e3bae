// A server process that belongs to this one.
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drape/client.h"

namespace drape {
inline namespace client {

// The path of the server program: `requested`, else $DRAPE_SERVER, else `draped` beside this
// executable, else on PATH. Throws kNotFound, naming the places.
std::filesystem::path FindServerProgram(const std::filesystem::path& requested);

// Starts `draped` and waits for its port. The starting thread lives as long as the process:
// PR_SET_PDEATHSIG, which ends the process with this one, belongs to a thread.
class PrivateServer {
 public:
  // Throws kNotFound without the program, kUnavailable when it ends or is not ready in time.
  explicit PrivateServer(const SpawnOptions& options);
  // SIGTERM, then SIGKILL for a server that does not end. Waits for its end.
  ~PrivateServer();
  PrivateServer(const PrivateServer&) = delete;
  PrivateServer& operator=(const PrivateServer&) = delete;

  // 127.0.0.1:PORT
  const std::string& address() const { return address_; }
  pid_t pid() const { return pid_; }
  // By itself, or by somebody else.
  bool has_ended() const;

 private:
  void Start(const std::filesystem::path& program, const SpawnOptions& options);
  void WaitForPort(double timeout_s);
  void Stop();
  void RemoveFolder();
  // The last lines of its log.
  std::string LogTail() const;

  // Private temporary folder for port file and log, while the server comes up: one that stayed
  // longer would be left behind when this process is killed.
  std::filesystem::path folder_;
  std::string address_;
  pid_t pid_ = -1;
  std::thread keeper_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool has_started_ = false;        // guarded by mutex_: fork was tried
  std::optional<int> exit_status_;  // guarded by mutex_: as of waitpid, once it has ended
};

}  // namespace client
}  // namespace drape
