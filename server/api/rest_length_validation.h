// Driven rest lengths of a StepRequest. Pure.
#pragma once

#include <vector>

#include "drape/v1/step.pb.h"
#include "server/api/field_checks.h"
#include "server/session/control_rows.h"

namespace drape::api {

// Of all rest lengths at once; the least is its reciprocal.
inline constexpr double kMaxLengthScale = 1000;

// The rows of "rest_length_controls" and "rest_length_scales"; what is wrong goes to `violations`.
std::vector<ControlRow<LengthControl>> CheckLengthControls(const v1::RestLengthControls& controls,
                                                           Violations& violations);
std::vector<ControlRow<LengthScale>> CheckLengthScales(const v1::RestLengthScales& scales,
                                                       Violations& violations);

}  // namespace drape::api
