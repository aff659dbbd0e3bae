#include "server/operations/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/support/paths/paths.h"

namespace drape {
namespace {

using testing::HasSubstr;

TEST(Metrics, EveryNumberHasALineOfItsKind) {
  ServerNumbers numbers;
  numbers.version = "1.2";
  numbers.backend = "cpu";
  numbers.server_id = "a7";
  numbers.cloth_steps = 12345678901;
  numbers.sessions = 3;
  numbers.builder_s = 1.25;
  EXPECT_THAT(MetricsText(numbers), testing::Not(HasSubstr("checkpoint")));
  numbers.checkpoint_age_s = 1.5;
  const std::string text = MetricsText(numbers);
  EXPECT_THAT(text,
              HasSubstr("drape_server_info{version=\"1.2\",backend=\"cpu\",server_id=\"a7\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE drape_cloth_steps_total counter\n"));
  EXPECT_THAT(text, HasSubstr("drape_cloth_steps_total 12345678901\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE drape_sessions gauge\ndrape_sessions 3\n"));
  EXPECT_THAT(text, HasSubstr("drape_builder_seconds_total 1.25\n"));
  EXPECT_THAT(text, HasSubstr("drape_checkpoint_age_seconds 1.5\n"));
}

TEST(Metrics, BucketsAreCumulativeAndInSeconds) {
  DurationHistogram durations;
  for (const int64_t us : {50, 100, 101, 40'000, 60'000'000}) durations.Add(us);
  ServerNumbers numbers;
  numbers.batch_durations = durations.Read();
  const std::string text = MetricsText(numbers);
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_bucket{le=\"0.0001\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_bucket{le=\"0.00025\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_bucket{le=\"0.05\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_bucket{le=\"10\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_bucket{le=\"+Inf\"} 5\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_count 5\n"));
  EXPECT_THAT(text, HasSubstr("drape_batch_duration_seconds_sum 60.040251\n"));
}

// Prometheus drops the suffixes of a histogram's and a counter's samples from no name: a query must
// name a sample that the text has.
TEST(Metrics, TheDashboardShowsTheNumbersThatThereAre) {
  ServerNumbers numbers;
  numbers.checkpoint_age_s = 1;
  const std::string text = MetricsText(numbers);
  std::ifstream file(test::SourcePath("docker/monitoring/drape.json"));
  ASSERT_TRUE(file.is_open());
  const nlohmann::json board = nlohmann::json::parse(file);
  std::set<std::string> asked;
  for (const auto& panel : board["panels"]) {
    for (const auto& target : panel["targets"]) {
      const std::string query = target["expr"];
      const std::regex name("drape_[a-z_]+");
      for (std::sregex_iterator at(query.begin(), query.end(), name), end; at != end; ++at) {
        asked.insert(at->str());
        EXPECT_TRUE(std::regex_search(text, std::regex("\\n" + at->str() + "[ {]"))) << at->str();
      }
    }
  }
  // And shows each of them. What a histogram is made of is one number.
  const std::regex type("# TYPE (drape_[a-z_]+) ");
  for (std::sregex_iterator at(text.begin(), text.end(), type), end; at != end; ++at) {
    const std::string name = (*at)[1];
    if (name == "drape_server_info") continue;
    EXPECT_TRUE(asked.contains(name) || asked.contains(name + "_bucket")) << name;
  }
}

}  // namespace
}  // namespace drape
