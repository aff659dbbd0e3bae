#include "server/api/field_checks.h"

#include <gtest/gtest.h>

#include <limits>

namespace drape::api {
namespace {

TEST(FieldPath, ReadsAsTheClientWroteIt) {
  const FieldPath pin = FieldPath("spec").Child("pins").At(2);
  EXPECT_EQ(pin.ToString(), "spec.pins[2]");
  EXPECT_EQ(pin.Child("target_m").At(0).ToString(), "spec.pins[2].target_m[0]");
  EXPECT_EQ(FieldPath("count").ToString(), "count");
}

TEST(FieldChecks, TextsShowValueAndRange) {
  FieldChecks checks;
  EXPECT_FALSE(checks.InRange(FieldPath("a"), 0.1, 1, 2, "m"));
  EXPECT_FALSE(checks.InRange(FieldPath("b"), std::numeric_limits<double>::quiet_NaN(), -1, 1, ""));
  EXPECT_FALSE(checks.CountInRange(FieldPath("c"), 7, 1, 6));
  EXPECT_TRUE(checks.InRange(FieldPath("d"), 1, 1, 2, "m"));
  EXPECT_EQ(checks.ToStatus().message(),
            "a: 0.1 is not in [1, 2] m; b: nan is not in [-1, 1]; c: 7 is not in [1, 6]");
}

TEST(FieldChecks, KeepsTheFirstSixteenAndStopsLooking) {
  FieldChecks checks;
  DoubleList values;
  values.Resize(1000, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(checks.AllWithin(FieldPath("values"), values, 1, ""));
  EXPECT_TRUE(checks.is_full());
  const Status status = checks.ToStatus();
  ASSERT_EQ(status.violations().size(), FieldChecks::kMaxViolations);
  EXPECT_EQ(status.violations().back().field, "values[15]");
}

TEST(FieldChecks, WithoutViolationsTheStatusIsOk) {
  EXPECT_TRUE(FieldChecks().ToStatus().ok());
}

TEST(FieldChecks, VectorsHaveThreeNumbers) {
  FieldChecks checks;
  DoubleList values;
  for (const double value : {1.0, 2.0, 3.0}) values.Add(value);
  EXPECT_EQ(checks.Vector3(FieldPath("v"), values, 5, "m"), Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(checks.Vector3(FieldPath("v"), values, 2.5, "m"));
  values.Add(4);
  EXPECT_FALSE(checks.Vector3(FieldPath("v"), values, 5, "m"));
  EXPECT_EQ(checks.violation_count(), 2u);
}

}  // namespace
}  // namespace drape::api
