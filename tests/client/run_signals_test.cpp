// `drape run` and the world around it: Ctrl-C, a terminal, a sudden death.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <thread>

#include "tests/client/cli_end_to_end_test.h"
#include "tests/client/usda_reader.h"

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

// Ended, or dead and waiting for an init process to notice.
bool IsGone(pid_t pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  const std::string text(std::istreambuf_iterator<char>(stat), {});
  return text.empty() || text.find(") Z ") != std::string::npos;
}

// It has a handler of its own for the signal.
bool Catches(pid_t pid, int signal) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("SigCgt:")) continue;
    return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
  }
  return false;
}

// The private server of `drape`, once exec has happened; 0 when none comes up.
pid_t ServerOf(const RunningProgram& program) {
  std::vector<pid_t> servers;
  const bool is_up = Eventually([&] {
    servers = ChildrenOf(program.pid());
    if (servers.size() != 1) return false;
    std::error_code error;
    return fs::read_symlink("/proc/" + std::to_string(servers[0]) + "/exe", error).filename() ==
           "draped";
  });
  return is_up ? servers[0] : 0;
}

// A run that would take about forever.
std::vector<std::string> LongRun() {
  return {"run", Example("hanging_two_corners.json"), "--backend=cpu", "--duration=10000"};
}

// A file of `folder` has grown: the states that are on their way.
bool HasStates(const TemporaryFolder& folder) {
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.file_size() > 100'000) return true;
  }
  return false;
}

// LongRun with both outputs, into `folder`.
std::vector<std::string> LongRunInto(const TemporaryFolder& folder) {
  std::vector<std::string> arguments = LongRun();
  arguments.push_back("--report=" + (folder / "r.json").string());
  arguments.push_back("--states=" + (folder / "s.csv").string());
  return arguments;
}

// r.json and s.csv hold the same steps, fewer than all; gives their number.
uint64_t SampledSteps(const TemporaryFolder& folder) {
  const auto report = nlohmann::json::parse(ReadText(folder / "r.json"));
  const uint64_t steps = report["steps"];
  EXPECT_GT(steps, 0u);
  EXPECT_LT(steps, 600'000u);
  EXPECT_EQ(report["cloths"][0]["samples"].size(), steps);
  const std::string text = ReadText(folder / "s.csv");
  EXPECT_EQ(static_cast<uint64_t>(std::count(text.begin(), text.end(), '\n')), 1 + 1024 * steps);
  return steps;
}

TEST(RunSignalsTest, AnInterruptKeepsWhatThereIs) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    RunningProgram program("drape", LongRunInto(folder));
    EXPECT_TRUE(Eventually([&] { return HasStates(folder); }));
    kill(program.pid(), signal);
    const Outcome outcome = program.Wait();
    EXPECT_EQ(outcome.exit_code, 1);
    const uint64_t steps = SampledSteps(folder);
    EXPECT_THAT(outcome.err, HasSubstr("interrupted after step " + std::to_string(steps)));
  }
}

// Formats whose headers and order are known only at the end also give complete files.
TEST(RunSignalsTest, AnInterruptCompletesEveryFormat) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = LongRunInto(folder);
  for (const char* name : {"s.pc2", "s.usda", "s.npz"}) {
    arguments.push_back("--states=" + (folder / name).string());
  }
  RunningProgram program("drape", arguments);
  EXPECT_TRUE(Eventually([&] { return HasStates(folder); }));
  kill(program.pid(), SIGINT);
  EXPECT_EQ(program.Wait().exit_code, 1);
  const uint64_t steps = SampledSteps(folder);
  const std::string cache = ReadText(folder / "s.pc2");
  int32_t sample_count = 0;
  std::memcpy(&sample_count, cache.data() + 28, sizeof(sample_count));
  EXPECT_EQ(static_cast<uint64_t>(sample_count), steps);
  EXPECT_EQ(cache.size(), 32 + steps * 1024 * 12);
  const auto stage = client_test::ParseUsda(ReadText(folder / "s.usda"));
  EXPECT_EQ(stage.metadata.at("endTimeCode"), std::to_string(steps));
  EXPECT_EQ(stage.prims.at(0).children.at(0).attributes.at("points").samples.size(), steps);
  EXPECT_GT(fs::file_size(folder / "s.npz"), steps * 1024 * 24);
}

TEST(RunSignalsTest, AnInterruptDoesNotWaitForTheNextSample) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments = LongRun();
  arguments.insert(arguments.end(), {"--every=600000", "--report=" + (folder / "r.json").string()});
  RunningProgram program("drape", arguments);
  ASSERT_TRUE(Eventually([&] { return Catches(program.pid(), SIGTERM); }));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // into the run
  kill(program.pid(), SIGTERM);
  EXPECT_TRUE(Eventually([&] { return IsGone(program.pid()); }));
  kill(program.pid(), SIGKILL);
  EXPECT_EQ(program.Wait().exit_code, 1);
  const auto report = nlohmann::json::parse(ReadText(folder / "r.json"));
  ASSERT_EQ(report["cloths"][0]["samples"].size(), 1u);
  EXPECT_EQ(report["cloths"][0]["samples"][0]["step"], report["steps"]);
}

// Nor for the second backend, which has not begun.
TEST(RunSignalsTest, AnInterruptDoesNotWaitForTheComparison) {
  std::vector<std::string> arguments = LongRun();
  arguments.insert(arguments.end(), {"--every=600000", "--compare=reference", "--json"});
  RunningProgram program("drape", arguments);
  ASSERT_TRUE(Eventually([&] { return Catches(program.pid(), SIGTERM); }));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // into the run
  kill(program.pid(), SIGTERM);
  const Outcome outcome = program.Wait();
  EXPECT_EQ(outcome.exit_code, 1);
  const auto printed = nlohmann::json::parse(outcome.out);
  EXPECT_GT(printed["steps"], 2);
  EXPECT_EQ(printed["comparison"]["compared_steps"], 0);
}

TEST(RunSignalsTest, ARunThatLosesItsServerKeepsItsSamples) {
  const TemporaryFolder folder;
  RunningProgram program("drape", LongRunInto(folder));
  const pid_t server = ServerOf(program);
  ASSERT_GT(server, 0);
  EXPECT_TRUE(Eventually([&] { return HasStates(folder); }));
  kill(server, SIGKILL);
  const Outcome outcome = program.Wait();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("UNAVAILABLE"));
  SampledSteps(folder);
}

TEST(RunSignalsTest, TheServerDiesWithTheClientAndNothingStays) {
  const TemporaryFolder folder, temporaries;
  setenv("TMPDIR", temporaries.path().c_str(), /*overwrite=*/1);
  RunningProgram program("drape", LongRunInto(folder));
  unsetenv("TMPDIR");
  const pid_t server = ServerOf(program);
  ASSERT_GT(server, 0);
  EXPECT_TRUE(Eventually([&] { return HasStates(folder); }));
  kill(program.pid(), SIGKILL);
  program.Wait();
  EXPECT_TRUE(Eventually([&] { return IsGone(server); }));
  for (const auto& entry : fs::directory_iterator(temporaries.path())) {
    EXPECT_TRUE(entry.path().filename().string().starts_with("drape-test-")) << entry.path();
  }
}

// The first waits for the request under way, which such a server never answers.
TEST(RunSignalsTest, TheSecondInterruptEndsEvenAServerThatHangs) {
  const TemporaryFolder folder;
  RunningProgram program("drape", LongRunInto(folder));
  const pid_t server = ServerOf(program);
  ASSERT_GT(server, 0);
  EXPECT_TRUE(Eventually([&] { return HasStates(folder); }));  // it knows of signals by then
  kill(server, SIGSTOP);
  EXPECT_TRUE(Eventually([&] {
    kill(program.pid(), SIGINT);
    return IsGone(server);
  }));
  kill(server, SIGKILL);
  kill(program.pid(), SIGKILL);
  EXPECT_EQ(program.Wait().exit_code, -1);
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
