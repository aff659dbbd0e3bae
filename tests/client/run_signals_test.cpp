// `drape run` and the world around it: Ctrl-C, a terminal, a sudden death.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <thread>

#include "tests/client/cli_end_to_end_test.h"

namespace drape {
namespace {

using client_test::Example;
using client_test::Outcome;
using client_test::ReadText;
using client_test::RunningProgram;
using client_test::TemporaryFolder;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

// True once `condition` holds; gives up after ten seconds.
bool Eventually(const std::function<bool()>& condition) {
  for (int tries = 0; tries < 1000; ++tries) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

// Processes whose parent is `parent`.
std::vector<pid_t> ChildrenOf(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream status(entry.path() / "status");
    for (std::string line; std::getline(status, line);) {
      if (line == "PPid:\t" + std::to_string(parent)) children.push_back(std::stoi(name));
    }
  }
  return children;
}

// A run that would take about forever.
std::vector<std::string> LongRun() {
  return {"run", Example("hanging_two_corners.json"), "--backend=cpu", "--duration=10000"};
}

TEST(RunSignalsTest, AnInterruptKeepsWhatThereIs) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = LongRun();
  const std::string states = folder / "s.csv";
  arguments.insert(arguments.end(),
                   {"--report=" + (folder / "r.json").string(), "--states=" + states});
  RunningProgram program("drape", arguments);
  EXPECT_TRUE(Eventually([&] { return fs::exists(states) && fs::file_size(states) > 100'000; }));
  kill(program.pid(), SIGINT);
  const Outcome outcome = program.Wait();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("interrupted after step "));
  const auto report = nlohmann::json::parse(ReadText(folder / "r.json"));
  const uint64_t steps = report["steps"];
  EXPECT_GT(steps, 0u);
  EXPECT_LT(steps, 600'000u);
  EXPECT_EQ(report["cloths"][0]["samples"].size(), steps);
  const std::string text = ReadText(states);
  EXPECT_EQ(static_cast<uint64_t>(std::count(text.begin(), text.end(), '\n')), 1 + 1024 * steps);
}

TEST(RunSignalsTest, TheServerDiesWithTheClient) {
  RunningProgram program("drape", LongRun());
  std::vector<pid_t> servers;
  ASSERT_TRUE(Eventually([&] { return !(servers = ChildrenOf(program.pid())).empty(); }));
  ASSERT_EQ(servers.size(), 1u);
  // Until it is a server of its own: exec has happened.
  ASSERT_TRUE(Eventually([&] {
    std::error_code error;
    return fs::read_symlink("/proc/" + std::to_string(servers[0]) + "/exe", error).filename() ==
           "draped";
  }));
  kill(program.pid(), SIGKILL);
  EXPECT_EQ(program.Wait().exit_code, -1);
  // Gone, or dead and waiting for an init process to notice.
  EXPECT_TRUE(Eventually([&] {
    std::ifstream stat("/proc/" + std::to_string(servers[0]) + "/stat");
    const std::string text(std::istreambuf_iterator<char>(stat), {});
    return text.empty() || text.find(") Z ") != std::string::npos;
  }));
}

TEST(RunSignalsTest, ATerminalGetsAProgressBar) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(terminal, 0);
  ASSERT_EQ(grantpt(terminal), 0);
  ASSERT_EQ(unlockpt(terminal), 0);
  RunningProgram program("drape", {"run", Example("chain.json"), "--backend=cpu", "--duration=0.2"},
                         ptsname(terminal));
  EXPECT_EQ(program.Wait().exit_code, 0);
  std::string text(100'000, '\0');
  const ssize_t size = read(terminal, text.data(), text.size());
  ASSERT_GT(size, 0);
  text.resize(static_cast<size_t>(size));
  EXPECT_THAT(text, HasSubstr("chain [###"));
  EXPECT_THAT(text, HasSubstr("100 %"));
  close(terminal);
}

}  // namespace
}  // namespace drape
