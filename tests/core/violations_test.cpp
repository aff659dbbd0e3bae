#include "server/core/violations.h"

#include <gtest/gtest.h>

#include <limits>

namespace drape {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(FieldPath, ReadsAsTheClientWroteIt) {
  const FieldPath pin = FieldPath("spec").Child("pins").At(2);
  EXPECT_EQ(pin.ToString(), "spec.pins[2]");
  EXPECT_EQ(pin.Child("target_m").At(0).ToString(), "spec.pins[2].target_m[0]");
  EXPECT_EQ(FieldPath("count").ToString(), "count");
}

TEST(Range, HoldsAndShowsItsEnds) {
  const Range closed{0, 1};
  EXPECT_TRUE(closed.Contains(0) && closed.Contains(1));
  EXPECT_FALSE(closed.Contains(-1e-300) || closed.Contains(1.1) || closed.Contains(kNan));
  EXPECT_EQ(closed.ToString(), "[0, 1]");
  const Range positive = Positive(1e6, "1/s");
  EXPECT_TRUE(positive.Contains(1e-300));
  EXPECT_FALSE(positive.Contains(0) || positive.Contains(kNan));
  EXPECT_EQ(positive.ToString(), "(0, 1e+06] 1/s");
  const Range open_above{.low = 0, .high = 1, .includes_high = false};
  EXPECT_FALSE(open_above.Contains(1) || open_above.Contains(kNan));
  EXPECT_EQ(open_above.ToString(), "[0, 1)");
}

TEST(Violations, TextsShowValueAndRange) {
  Violations violations;
  EXPECT_FALSE(violations.InRange("a", 0.1, {1, 2, "m"}));
  EXPECT_FALSE(violations.InRange("b", kNan, {-1, 1}));
  EXPECT_FALSE(violations.CountInRange("c", 7, 1, 6));
  EXPECT_TRUE(violations.InRange("d", 1, {1, 2, "m"}));
  EXPECT_FALSE(violations.IsParticle("e", 3, 3));
  EXPECT_TRUE(violations.IsParticle("e", 2, 3));
  EXPECT_FALSE(violations.IsParticle("f", 0, 0));
  EXPECT_FALSE(violations.Length("g", 2, 3, "x, y, z"));
  EXPECT_EQ(violations.ToStatus().message(),
            "a: 0.1 is not in [1, 2] m; b: nan is not in [-1, 1]; c: 7 is not in [1, 6]; "
            "e: 3 is not in [0, 2]; f: 0: there are no particles; "
            "g: has 2 elements, needs 3 (x, y, z)");
}

TEST(Violations, KeepsTheFirstSixteen) {
  Violations violations;
  for (size_t k = 0; k < 20; ++k) violations.Add(FieldPath("values").At(k), "bad");
  EXPECT_TRUE(violations.is_full());
  violations.AddAll({{"more", "bad"}});
  const Status status = violations.ToStatus();
  ASSERT_EQ(status.violations().size(), Violations::kMaxCount);
  EXPECT_EQ(status.violations().back().field, "values[15]");
}

// A request of millions of bad values costs no text for each.
TEST(Violations, NothingIsDescribedThatWouldBeDropped) {
  Violations violations;
  size_t described = 0;
  for (size_t k = 0; k < 1000; ++k) {
    EXPECT_FALSE(violations.Require(false, FieldPath("values").At(k), [&] {
      ++described;
      return std::string("bad");
    }));
  }
  EXPECT_EQ(described, Violations::kMaxCount);
}

TEST(Violations, WithoutAnyTheStatusIsOk) {
  EXPECT_TRUE(Violations().ToStatus().ok());
}

TEST(Violations, FieldsOfALowerLayerGetTheirPath) {
  Violations violations;
  violations.AddAll({{"pins[2]", "bad"}}, "spec.");
  EXPECT_EQ(violations.ToStatus().violations()[0].field, "spec.pins[2]");
  const Status below =
      Below(FieldPath("overrides").At(1), Status::InvalidFields({{"a", "bad"}, {"b", "worse"}}));
  EXPECT_EQ(below.message(), "overrides[1].a: bad; overrides[1].b: worse");
  EXPECT_TRUE(Below("spec", Status::Ok()).ok());
  EXPECT_EQ(Below("spec", Status(StatusCode::kNotFound, "GONE", "gone")).message(), "gone");
}

}  // namespace
}  // namespace drape
