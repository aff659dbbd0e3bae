#include "client/cli/load_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

namespace drape::cli {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

LoadSamples Window(uint32_t requests, double latency_ms) {
  LoadSamples window;
  window.wall_s = 2;
  window.latencies_ms.assign(requests, latency_ms);
  return window;
}

TEST(LoadReportTest, PercentilesAreNearestRanks) {
  std::vector<double> values;
  for (int k = 100; k >= 1; --k) values.push_back(k);
  EXPECT_EQ(Percentile(values, 50), 50);
  EXPECT_EQ(Percentile(values, 99), 99);
  EXPECT_EQ(Percentile(values, 99.5), 100);
  EXPECT_EQ(Percentile(values, 100), 100);
  EXPECT_EQ(Percentile(values, 0.001), 1);
  EXPECT_EQ(Percentile({}, 50), 0);
  const double one[] = {7};
  EXPECT_EQ(Percentile(one, 1), 7);
}

TEST(LoadReportTest, ThreeWindowsInARowMakeALevelStable) {
  const std::vector<LoadSamples> calm = {Window(100, 1), Window(105, 1.05), Window(95, 0.95)};
  EXPECT_TRUE(IsStable(calm, 50, 10));
  EXPECT_FALSE(IsStable(calm, 50, 4));
  EXPECT_FALSE(IsStable({calm.data(), 2}, 50, 10)) << "two are too few";

  // Only the last three count.
  EXPECT_TRUE(IsStable(std::vector{Window(1, 50), calm[0], calm[1], calm[2]}, 50, 10));
  EXPECT_FALSE(IsStable(std::vector{calm[0], calm[1], Window(200, 1)}, 50, 10)) << "rate";
  EXPECT_FALSE(IsStable(std::vector{calm[0], calm[1], Window(100, 2)}, 50, 10)) << "latency";
  EXPECT_FALSE(IsStable(std::vector{Window(0, 0), Window(0, 0), Window(0, 0)}, 50, 10))
      << "where nothing succeeds nothing is stable";
}

TEST(LoadReportTest, StabilityIsThatOfTheWantedPercentile) {
  LoadSamples spiky = Window(98, 1);
  spiky.latencies_ms.resize(100, 30);  // two of a hundred
  const std::vector<LoadSamples> windows = {Window(100, 1), Window(100, 1), spiky};
  EXPECT_TRUE(IsStable(windows, 50, 10));
  EXPECT_FALSE(IsStable(windows, 99, 10));
}

TEST(LoadReportTest, SamplesAddUp) {
  LoadSamples sum = Window(2, 1);
  sum.errors = {{"QUEUE_FULL", 1}};
  LoadSamples other = Window(1, 3);
  other.errors = {{"QUEUE_FULL", 2}, {"DEADLINE_EXCEEDED", 4}};
  other.delayed = 5;
  other.cloth_steps = 6;
  sum.Add(other);
  EXPECT_EQ(sum.latencies_ms, (std::vector<double>{1, 1, 3}));
  EXPECT_EQ(sum.wall_s, 4);
  EXPECT_EQ(sum.error_count(), 7u);
  EXPECT_EQ(sum.delayed, 5u);
  EXPECT_EQ(sum.cloth_steps, 6u);
}

TEST(LoadReportTest, EveryRowHasTheColumnsOfTheHeader) {
  LoadRow row{{4, 0}, true, Window(10, 2.5)};
  row.samples.cloth_steps = 80;
  row.samples.queue_us = 20'000;
  row.samples.errors = {{"A", 1}, {"B", 2}};
  const std::string header = LoadCsvHeader(99.9), line = LoadCsvLine(row, 99.9);
  EXPECT_EQ(std::count(header.begin(), header.end(), ','),
            std::count(line.begin(), line.end(), ','));
  EXPECT_THAT(header, HasSubstr(",p99.9_ms,"));
  EXPECT_THAT(LoadCsvHeader(0), Not(HasSubstr("p99.9")));
  EXPECT_THAT(line, EndsWith(",1,A=1;B=2\n"));
  const auto json = nlohmann::json::parse(LoadJson({row}, 0));
  EXPECT_EQ(json[0]["concurrency"], 4);
  EXPECT_EQ(json[0]["requests_per_s"], 5);
  EXPECT_EQ(json[0]["cloth_steps_per_s"], 40);
  EXPECT_EQ(json[0]["p50_ms"], 2.5);
  EXPECT_EQ(json[0]["queue_ms"], 2);  // per request
  EXPECT_EQ(json[0]["errors"]["B"], 2);
}

TEST(LoadReportTest, TheTableSaysWhatIsNotStableAndWhatFailed) {
  LoadRow row{{16, 200}, false, Window(10, 2.5)};
  row.samples.errors = {{"QUEUE_FULL", 3}};
  row.samples.delayed = 7;
  const std::string table = LoadTable({row}, 0);
  EXPECT_THAT(table, HasSubstr("rate 200/s, 16 clients: 5.0 requests/s"));
  EXPECT_THAT(table, HasSubstr("(not stable)"));
  EXPECT_THAT(table, HasSubstr("failed: QUEUE_FULL=3"));
  EXPECT_THAT(table, HasSubstr("busy: 7"));
}

}  // namespace
}  // namespace drape::cli
