// A `draped` for one test: a child process on a free port of this machine.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drape/v1/simulation_service.grpc.pb.h"

namespace drape::test {

// Deleted with everything in it.
class ScratchDir {
 public:
  ScratchDir();
  ~ScratchDir();
  ScratchDir(const ScratchDir&) = delete;
  ScratchDir& operator=(const ScratchDir&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

class ServerProcess {
 public:
  using Environment = std::vector<std::pair<std::string, std::string>>;

  // Starts draped, or the program that DRAPE_TEST_SERVER names, with `flags`; --listen and
  // --port-file are given unless they are among the flags. Does not wait.
  // `max_descriptors`: of files and connections; 0: as this process.
  explicit ServerProcess(std::vector<std::string> flags = {}, const Environment& environment = {},
                         uint64_t max_descriptors = 0);
  // Kills the child if it still runs.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // Until the server listens. False, after printing its log, if it ended or took too long.
  bool WaitUntilUp();
  // "127.0.0.1:<port>".
  std::string Address() const;
  std::unique_ptr<v1::SimulationService::Stub> NewStub() const;
  std::shared_ptr<grpc::Channel> NewChannel() const;

  void Signal(int signal) const;
  // The exit status, or 128 + signal; -1 if it does not end in time.
  int WaitForExit();
  bool is_running();
  // Lowers a limit of the running process (RLIMIT_DATA, …).
  void Limit(int resource, uint64_t value) const;
  // The most memory that it has had.
  uint64_t PeakMemory_bytes() const;
  // Its stderr so far.
  std::string Log() const;

 private:
  ScratchDir dir_;
  pid_t pid_ = -1;
  int exit_status_ = -1;
  bool has_ended_ = false;
};

}  // namespace drape::test
