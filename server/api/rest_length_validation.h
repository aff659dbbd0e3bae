// Driven rest lengths of a StepRequest. Pure.
#pragma once

#include <vector>

#include "drape/v1/step.pb.h"
#include "server/api/field_checks.h"
#include "server/session/control_rows.h"

namespace drape::api {

// Largest scale of all rest lengths at once; the smallest is its reciprocal.
inline constexpr double kMaxLengthScale = 1000;

// Reads the rows of "rest_length_controls" and "rest_length_scales" and adds what is wrong to
// `violations`.
std::vector<ControlRow<LengthControl>> CheckLengthControls(const v1::RestLengthControls& controls,
                                                           Violations& violations);
std::vector<ControlRow<LengthScale>> CheckLengthScales(const v1::RestLengthScales& scales,
                                                       Violations& violations);

}  // namespace drape::api
