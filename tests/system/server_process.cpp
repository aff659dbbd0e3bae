#include "tests/system/server_process.h"

#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <thread>

#include "server/core/check.h"
#include "tests/support/paths/paths.h"

namespace drape::test {
namespace {

// Generous: a loaded machine with a software GPU and sanitizers.
constexpr std::chrono::seconds kPatience{60};
constexpr std::chrono::milliseconds kPoll{5};

std::string ReadFile(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool Mentions(const std::vector<std::string>& flags, const std::string& name) {
  for (const std::string& flag : flags) {
    if (flag.rfind(name, 0) == 0) return true;
  }
  return false;
}

[[noreturn]] void RunChild(const std::vector<std::string>& words, const std::string& log_path,
                           const ServerProcess::Environment& environment,
                           uint64_t max_descriptors) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit limit{max_descriptors, max_descriptors};
  if (max_descriptors > 0 && setrlimit(RLIMIT_NOFILE, &limit) != 0) _exit(126);
  if (!std::freopen(log_path.c_str(), "w", stderr)) _exit(126);
  for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  _exit(127);
}

}  // namespace

ScratchDir::ScratchDir() {
  std::string pattern = (std::filesystem::temp_directory_path() / "drape_test_XXXXXX").string();
  DRAPE_CHECK(mkdtemp(pattern.data()) != nullptr, "no temporary directory");
  path_ = pattern;
}

ScratchDir::~ScratchDir() {
  std::filesystem::remove_all(path_);
}

ServerProcess::ServerProcess(std::vector<std::string> flags, const Environment& environment,
                             uint64_t max_descriptors) {
  const char* const other_program = std::getenv("DRAPE_TEST_SERVER");
  std::vector<std::string> words = {other_program != nullptr ? other_program
                                                             : ProgramPath("draped").string()};
  if (!Mentions(flags, "--listen")) words.push_back("--listen=127.0.0.1:0");
  if (!Mentions(flags, "--port-file")) words.push_back("--port-file=" + (dir_ / "port"));
  if (!Mentions(flags, "--backend")) words.push_back("--backend=cpu");
  words.insert(words.end(), flags.begin(), flags.end());
  pid_ = fork();
  DRAPE_CHECK(pid_ >= 0, "fork failed");
  if (pid_ == 0) RunChild(words, dir_ / "log", environment, max_descriptors);
}

ServerProcess::~ServerProcess() {
  if (!is_running()) return;
  Signal(SIGKILL);
  WaitForExit();
}

bool ServerProcess::WaitUntilUp() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (is_running() && std::chrono::steady_clock::now() < deadline) {
    if (std::filesystem::exists(dir_ / "port")) return true;
    std::this_thread::sleep_for(kPoll);
  }
  std::cerr << "draped is not up:\n" << Log();
  return false;
}

std::string ServerProcess::Address() const {
  return "127.0.0.1:" + std::to_string(std::stoi(ReadFile(dir_ / "port")));
}

std::shared_ptr<grpc::Channel> ServerProcess::NewChannel() const {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // A connection of its own, so that closing it looks like a vanished client.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(Address(), grpc::InsecureChannelCredentials(), arguments);
}

std::unique_ptr<v1::SimulationService::Stub> ServerProcess::NewStub() const {
  return v1::SimulationService::NewStub(NewChannel());
}

void ServerProcess::Signal(int signal) const {
  kill(pid_, signal);
}

bool ServerProcess::is_running() {
  if (has_ended_) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
  has_ended_ = true;
  exit_status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

int ServerProcess::WaitForExit() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (is_running() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(kPoll);
  }
  return has_ended_ ? exit_status_ : -1;
}

void ServerProcess::Limit(int resource, uint64_t value) const {
  const rlimit limit{value, value};
  EXPECT_EQ(prlimit(pid_, static_cast<__rlimit_resource>(resource), &limit, nullptr), 0);
}

uint64_t ServerProcess::PeakMemory_bytes() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string word; status >> word;) {
    uint64_t kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return 1024 * kilobytes;
  }
  ADD_FAILURE() << "no VmHWM of process " << pid_;
  return 0;
}

std::string ServerProcess::Log() const {
  return ReadFile(dir_ / "log");
}

}  // namespace drape::test
