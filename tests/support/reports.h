// Comparing what steps tell.
#pragma once

#include <string>

#include "server/solver/step_report.h"

namespace drape::test {

// The names and both values of what differs, to the bit; empty: nothing does.
std::string DifferenceOf(const StepReport& actual, const StepReport& expected);

// The bytes of what a backend reports, the same for every NaN.
std::string ReportBits(const StepReport& report);

}  // namespace drape::test
