// Reads and writes drape.v1.StepSettings, field by field, by the names in kSettings.
#pragma once

#include "drape/v1/cloth_spec.pb.h"
#include "server/core/violations.h"
#include "server/solver/step_settings.h"

namespace drape::api {

// The settings of the preset with those that the message sets; REALTIME after a violation.
StepSettings CheckSettings(const FieldPath& path, const v1::StepSettings& message,
                           Violations& violations);

// Every field is set.
v1::StepSettings ToProto(const StepSettings& settings);

}  // namespace drape::api
