// Comparing what steps tell.
#pragma once

#include <string>

#include "server/solver/step_report.h"

namespace drape::test {

// The names and both values of what differs, to the bit; empty: nothing does.
std::string DifferenceOf(const StepReport& actual, const StepReport& expected);

}  // namespace drape::test
