// `drape load` against a server: what it counts, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::Outcome;
using client_test::ReadText;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// `drape load` on small sheets and a private server.
Outcome Load(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"load", "--backend=cpu"});
  return RunProgram("drape", arguments);
}

nlohmann::json LoadForJson(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--side=4", "--max-trials=1", "--json"});
  const Outcome outcome = Load(std::move(arguments));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  return outcome.exit_code == 0 ? nlohmann::json::parse(outcome.out) : nlohmann::json::array();
}

TEST(LoadCommandTest, ACountEndsAWindowAndEveryRequestIsCounted) {
  const auto rows = LoadForJson({"--concurrency-range=1:3:2", "--request-count=12", "--cloths=2",
                                 "--steps=5", "--measurement-interval=60000"});
  ASSERT_EQ(rows.size(), 2u);
  for (const auto& row : rows) {
    EXPECT_EQ(row["requests"], 12);
    EXPECT_EQ(row["failed"], 0);
    // Ten cloth steps per request.
    EXPECT_NEAR(row["cloth_steps_per_s"], 10 * row["requests_per_s"].get<double>(),
                1e-6 * row["cloth_steps_per_s"].get<double>());
    EXPECT_LE(row["p50_ms"], row["p99_ms"]);
    EXPECT_GT(row["device_ms"], 0);
  }
  EXPECT_EQ(rows[0]["concurrency"], 1);
  EXPECT_EQ(rows[1]["concurrency"], 3);
}

TEST(LoadCommandTest, ARateIsKeptAndWhatCannotBeSentIsSaid) {
  // 40 requests are due in 0.4 s; one client does them easily.
  const auto calm =
      LoadForJson({"--request-rate-range=100", "--measurement-interval=400", "--max-threads=4"});
  ASSERT_EQ(calm.size(), 1u);
  EXPECT_GE(calm[0]["requests"].get<int>() + calm[0]["delayed"].get<int>(), 40);
  EXPECT_LE(calm[0]["requests"], 40);

  // 100 000 requests per second are too many for a client that waits for each answer.
  const auto busy =
      LoadForJson({"--request-rate-range=100000", "--measurement-interval=200", "--max-threads=1"});
  ASSERT_EQ(busy.size(), 1u);
  EXPECT_GE(busy[0]["requests"].get<int>() + busy[0]["delayed"].get<int>(), 20'000);
  EXPECT_GT(busy[0]["delayed"], 1000);
  EXPECT_GT(busy[0]["p99_ms"], 50) << "latency counts from when a request was due";
}

TEST(LoadCommandTest, OtherKindsOfRequests) {
  for (const char* kind : {"create", "session"}) {
    const auto rows = LoadForJson({"--request-count=5", std::string("--request=") + kind});
    ASSERT_EQ(rows.size(), 1u) << kind;
    EXPECT_EQ(rows[0]["requests"], 5) << kind;
    EXPECT_EQ(rows[0]["failed"], 0) << kind;
  }
  const auto streamed = LoadForJson({"--request-count=8", "--streaming", "--positions"});
  EXPECT_EQ(streamed[0]["requests"], 8);
}

TEST(LoadCommandTest, ViewersSeeFramesAndStalledOnesHoldNothingUp) {
  const auto rows = LoadForJson({"--viewers=2", "--viewer-hz=50", "--stalled-viewers=1",
                                 "--concurrency-range=2", "--measurement-interval=500"});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0]["failed"], 0) << rows[0]["errors"];
  EXPECT_GT(rows[0]["requests"], 0);
  EXPECT_GT(rows[0]["frames_per_s"], 0);
  EXPECT_LE(rows[0]["frames_per_s"], 2 * 50 * 1.2);
}

TEST(LoadCommandTest, FailuresAreCountedByReason) {
  // 50 ms are too short for 2000 steps of 32 x 32 particles.
  const Outcome outcome =
      Load({"--steps=2000", "--request-timeout=0.05", "--request-count=3", "--max-trials=1",
            "--side=32", "--warmup-request-count=0", "--json"});
  EXPECT_EQ(outcome.exit_code, 1) << "no request succeeded";
  const auto rows = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(rows[0]["requests"], 0);
  EXPECT_EQ(rows[0]["failed"], 3);
  EXPECT_EQ(rows[0]["errors"].begin().value(), 3) << rows[0]["errors"];
}

TEST(LoadCommandTest, TheCsvFileHasALinePerLevel) {
  const TemporaryFolder folder;
  const std::string path = folder / "load.csv";
  const Outcome outcome = Load({"--side=4", "--max-trials=1", "--request-count=2",
                                "--concurrency-range=1:2", "--csv=" + path});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("concurrency 2: "));
  const std::string text = ReadText(path);
  EXPECT_THAT(text, StartsWith("concurrency,request_rate_per_s,"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3);
}

TEST(LoadCommandTest, ThresholdEndsTheRange) {
  const auto rows =
      LoadForJson({"--concurrency-range=1:9", "--request-count=3", "--latency-threshold=0.000001"});
  EXPECT_EQ(rows.size(), 1u);
}

TEST(LoadCommandTest, BadRangesAreUsageErrors) {
  for (const char* range :
       {"0", "-1", "x", "2:1", "1:2:0", "1:2:3:4", "1:", "1.5", "1:5000", "nan"}) {
    const Outcome outcome = Load({std::string("--concurrency-range=") + range});
    EXPECT_EQ(outcome.exit_code, 2) << range;
    EXPECT_THAT(outcome.err, HasSubstr("--concurrency-range")) << range;
  }
  EXPECT_EQ(Load({"--concurrency-range=1", "--request-rate-range=1"}).exit_code, 2);
}

}  // namespace
}  // namespace drape
