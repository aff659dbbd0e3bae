#include "server/api/stream_validation.h"
#include "tests/api/bad_cases.h"
#include "tests/api/requests.h"

namespace drape::api {
namespace {

using test::ExpectViolation;
using test::kNaN;

TEST(RunValidation, DefaultsAreRealTimeWithoutEnd) {
  v1::RunRequest::Start start;
  ExpectViolation(CheckRun(start).status(), "start.cloth_ids", "all_cloths");
  start.set_all_cloths(true);
  const auto checked = CheckRun(start);
  ASSERT_TRUE(checked.ok());
  EXPECT_TRUE(checked->is_real_time);
  EXPECT_EQ(checked->max_steps, UINT64_MAX);
  EXPECT_EQ(checked->max_behind_s, 0.1);
  EXPECT_EQ(checked->report_interval_s, 1);
  EXPECT_FALSE(checked->expected_step.has_value());
}

TEST(RunValidation, ARateOrNone) {
  v1::RunRequest::Start start;
  start.set_all_cloths(true);
  start.set_steps_hz(50);
  EXPECT_EQ(CheckRun(start)->interval_s, 0.02);
  EXPECT_FALSE(CheckRun(start)->is_real_time);
  start.set_unpaced(true);
  ExpectViolation(CheckRun(start).status(), "start.unpaced", "steps_hz");
  start.clear_steps_hz();
  EXPECT_EQ(CheckRun(start)->interval_s, 0);
  EXPECT_FALSE(CheckRun(start)->is_real_time);
}

TEST(RunValidation, NumbersAreInTheirRanges) {
  struct Case {
    const char* field;
    void (v1::RunRequest::Start::*set)(double);
    double low, high;
  };
  using Start = v1::RunRequest::Start;
  const Case kCases[] = {
      {"start.steps_hz", &Start::set_steps_hz, 0.001, 1e6},
      {"start.max_behind_s", &Start::set_max_behind_s, 0.02, 60},
      {"start.report_interval_s", &Start::set_report_interval_s, 0.01, 3600},
  };
  for (const Case& c : kCases) {
    Start start;
    start.set_all_cloths(true);
    for (const double legal : {0.0, c.low, c.high}) {
      (start.*c.set)(legal);
      EXPECT_TRUE(CheckRun(start).ok()) << c.field << " " << legal;
    }
    for (const double illegal : {-c.low, 0.99 * c.low, 1.01 * c.high, kNaN, HUGE_VAL}) {
      (start.*c.set)(illegal);
      ExpectViolation(CheckRun(start).status(), c.field, "[");
    }
  }
}

}  // namespace
}  // namespace drape::api
