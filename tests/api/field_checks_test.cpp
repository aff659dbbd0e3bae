#include "server/api/field_checks.h"

#include <gtest/gtest.h>

#include <limits>

namespace drape::api {
namespace {

TEST(CheckAllWithin, StopsLookingWhenTheListIsFull) {
  Violations violations;
  DoubleList values;
  values.Resize(1000, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(CheckAllWithin("values", values, 1, "", violations));
  EXPECT_TRUE(violations.is_full());
  const Status status = violations.ToStatus();
  ASSERT_EQ(status.violations().size(), Violations::kMaxCount);
  EXPECT_EQ(status.violations().back().field, "values[15]");
  EXPECT_EQ(status.violations().back().description, "inf is not in [-1, 1]");
}

TEST(CheckVector3, VectorsHaveThreeNumbers) {
  Violations violations;
  DoubleList values;
  for (const double value : {1.0, 2.0, 3.0}) values.Add(value);
  EXPECT_EQ(CheckVector3("v", values, 5, "m", violations), Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(CheckVector3("v", values, 2.5, "m", violations));
  values.Add(4);
  EXPECT_FALSE(CheckVector3("v", values, 5, "m", violations));
  EXPECT_EQ(violations.count(), 2u);
}

}  // namespace
}  // namespace drape::api
