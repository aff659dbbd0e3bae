// drape.v1.StepSettings in and out, field by field by the names of kSettings.
#pragma once

#include "drape/v1/cloth_spec.pb.h"
#include "server/core/violations.h"
#include "server/solver/step_settings.h"

namespace drape::api {

// The preset with what the message sets. After a violation: REALTIME.
StepSettings CheckSettings(const FieldPath& path, const v1::StepSettings& message,
                           Violations& violations);

// Every field is set.
v1::StepSettings ToProto(const StepSettings& settings);

}  // namespace drape::api
