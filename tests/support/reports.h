// Comparison of the reports of steps.
#pragma once

#include <string>

#include "server/solver/step_report.h"

namespace drape::test {

// The names and both values of fields that differ in any bit, impulses too; empty: none does.
std::string DifferenceOf(const StepReport& actual, const StepReport& expected);

// The bytes of a backend's report, the same for every NaN.
std::string ReportBits(const StepReport& report);

}  // namespace drape::test
