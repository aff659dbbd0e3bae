// Tables of spoiled requests: each case names the field that must be refused.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <ostream>
#include <string>

#include "server/core/status.h"

namespace drape::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

template <class Request>
struct BadCase {
  std::string name;
  std::function<void(Request&)> spoil;
  std::string field;
  std::string text;  // part of the description: the value, or the legal range
};

template <class Request>
void PrintTo(const BadCase<Request>& bad, std::ostream* out) {
  *out << bad.name;
}

struct NameOf {
  template <class Request>
  std::string operator()(const testing::TestParamInfo<BadCase<Request>>& bad) const {
    return bad.param.name;
  }
};

// This field is named, and the text is in its description.
inline void ExpectViolation(const Status& status, const std::string& field,
                            const std::string& text) {
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << status.ToString();
  bool is_named = false;
  for (const FieldViolation& violation : status.violations()) {
    is_named |= violation.field == field && violation.description.find(text) != std::string::npos;
  }
  EXPECT_TRUE(is_named) << "no violation of '" << field << "' with '" << text << "' in "
                        << status.ToString();
}

}  // namespace drape::test
