#include "client/src/private_server.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <sstream>
#include <vector>

#include "client/src/errors.h"

namespace drape {
inline namespace client {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr char kProgramName[] = "draped";
constexpr milliseconds kPortFilePoll(10);
// Time for unfinished work before SIGKILL; nobody waits for its answer.
constexpr std::chrono::seconds kDrainTime(8);
constexpr size_t kLogTailLines = 20;
constexpr int kExecFailed = 127;  // as shells do

bool IsExecutable(const fs::path& path) {
  return fs::is_regular_file(path) && access(path.c_str(), X_OK) == 0;
}

// In the child between fork and exec: only async-signal-safe calls.
[[noreturn]] void BecomeServer(const char* program, char* const* arguments, int log, pid_t parent) {
  setpgid(0, 0);                      // Ctrl-C of the terminal is for the client
  prctl(PR_SET_PDEATHSIG, SIGKILL);   // it has nothing to drain
  if (getppid() != parent) _exit(0);  // the parent ended before prctl
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(program, arguments);
  _exit(kExecFailed);
}

std::string HowItEnded(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  if (WEXITSTATUS(status) == kExecFailed) return "could not be started";
  return "ended with status " + std::to_string(WEXITSTATUS(status));
}

}  // namespace

fs::path FindServerProgram(const fs::path& requested) {
  std::vector<fs::path> candidates;
  if (!requested.empty()) {
    candidates.push_back(requested);
  } else if (const char* variable = std::getenv("DRAPE_SERVER"); variable && *variable) {
    candidates.emplace_back(variable);
  } else {
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    if (!error) candidates.push_back(self.parent_path() / kProgramName);
    if (const char* path = std::getenv("PATH")) {
      std::istringstream folders(path);
      for (std::string folder; std::getline(folders, folder, ':');) {
        if (!folder.empty()) candidates.push_back(fs::path(folder) / kProgramName);
      }
    }
  }
  for (const fs::path& candidate : candidates) {
    if (IsExecutable(candidate)) return fs::absolute(candidate);
  }
  const std::string where = candidates.empty() ? kProgramName : candidates.front().string();
  throw LocalError(ErrorCode::kNotFound, "NO_SERVER_PROGRAM",
                   "no server program at " + where +
                       "; set DRAPE_SERVER, or name a running server by its address");
}

PrivateServer::PrivateServer(const SpawnOptions& options) {
  const fs::path program = FindServerProgram(options.executable);
  std::string folder = (fs::temp_directory_path() / "drape-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    throw LocalError(ErrorCode::kUnavailable, "NO_TEMPORARY_FOLDER",
                     "cannot make " + folder + ": " + std::strerror(errno));
  }
  folder_ = folder;
  try {
    Start(program, options);
    WaitForPort(options.ready_timeout_s);
    RemoveFolder();
  } catch (...) {
    Stop();
    throw;
  }
}

PrivateServer::~PrivateServer() {
  Stop();
}

void PrivateServer::Start(const fs::path& program, const SpawnOptions& options) {
  std::vector<std::string> arguments = {program.string(), "--listen=127.0.0.1:0",
                                        "--port-file=" + (folder_ / "port").string(),
                                        "--backend=" + options.backend};
  arguments.insert(arguments.end(), options.flags.begin(), options.flags.end());
  const int log = open((folder_ / "log").c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
  if (log < 0) {
    throw LocalError(ErrorCode::kUnavailable, "NO_TEMPORARY_FOLDER",
                     "cannot write in " + folder_.string() + ": " + std::strerror(errno));
  }
  keeper_ = std::thread([this, arguments = std::move(arguments), log]() mutable {
    std::vector<char*> argument_pointers;
    for (std::string& argument : arguments) argument_pointers.push_back(argument.data());
    argument_pointers.push_back(nullptr);
    const pid_t parent = getpid();
    const pid_t pid = fork();
    if (pid == 0) BecomeServer(argument_pointers[0], argument_pointers.data(), log, parent);
    close(log);
    {
      const std::lock_guard lock(mutex_);
      pid_ = pid;
      has_started_ = true;
      if (pid < 0) exit_status_ = kExecFailed << 8;
    }
    changed_.notify_all();
    if (pid < 0) return;
    // First wait without reaping: Stop() may signal the process until it is known to have ended.
    siginfo_t info;
    while (waitid(P_PID, static_cast<id_t>(pid), &info, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
    }
    {
      const std::lock_guard lock(mutex_);
      int status = 0;
      waitpid(pid, &status, 0);
      exit_status_ = status;
    }
    changed_.notify_all();
  });
}

void PrivateServer::WaitForPort(double timeout_s) {
  const auto deadline = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                                  std::chrono::duration<double>(timeout_s));
  std::unique_lock lock(mutex_);
  std::string previous;
  while (true) {
    std::ifstream file(folder_ / "port");
    std::string port;
    file >> port;
    // Two equal reads: the file is complete.
    if (!port.empty() && port == previous) {
      address_ = "127.0.0.1:" + port;
      return;
    }
    previous = port;
    if (exit_status_) {
      throw LocalError(
          ErrorCode::kUnavailable, "SERVER_ENDED",
          "the server " + HowItEnded(*exit_status_) + " before it was ready" + LogTail());
    }
    if (steady_clock::now() >= deadline) {
      throw LocalError(
          ErrorCode::kUnavailable, "SERVER_NOT_READY",
          "the server was not ready after " + std::to_string(timeout_s) + " s" + LogTail());
    }
    changed_.wait_for(lock, kPortFilePoll);
  }
}

bool PrivateServer::has_ended() const {
  const std::lock_guard lock(mutex_);
  return exit_status_.has_value();
}

void PrivateServer::Stop() {
  if (keeper_.joinable()) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return has_started_; });
      if (!exit_status_) kill(pid_, SIGTERM);
      if (!changed_.wait_for(lock, kDrainTime, [this] { return exit_status_.has_value(); })) {
        kill(pid_, SIGKILL);
      }
    }
    keeper_.join();
  }
  RemoveFolder();
}

void PrivateServer::RemoveFolder() {
  std::error_code ignored;  // a temporary folder that is left does no harm
  fs::remove_all(folder_, ignored);
}

std::string PrivateServer::LogTail() const {
  std::ifstream file(folder_ / "log");
  std::deque<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
    if (lines.size() > kLogTailLines) lines.pop_front();
  }
  if (lines.empty()) return "; it wrote no log";
  std::string tail = "; the end of its log:";
  for (const std::string& line : lines) tail += "\n  " + line;
  return tail;
}

}  // namespace client
}  // namespace drape
