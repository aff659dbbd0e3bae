// From GripControls to plain values. Pure.
#pragma once

#include <vector>

#include "drape/v1/step.pb.h"
#include "server/api/field_checks.h"
#include "server/session/control_rows.h"

namespace drape::api {

// Environment frame; slots and particles are not known to exist.
std::vector<ControlRow<GripControl>> CheckGripControls(const v1::GripControls& controls,
                                                       Violations& violations);

}  // namespace drape::api
