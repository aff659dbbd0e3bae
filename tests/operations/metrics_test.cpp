#include "server/operations/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  const std::string text = MetricsText(numbers);
  EXPECT_THAT(text,
              HasSubstr("drape_server_info{version=\"1.2\",backend=\"cpu\",server_id=\"a7\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE drape_cloth_steps_total counter\n"));
  EXPECT_THAT(text, HasSubstr("drape_cloth_steps_total 12345678901\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE drape_sessions gauge\ndrape_sessions 3\n"));
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

}  // namespace
}  // namespace drape
