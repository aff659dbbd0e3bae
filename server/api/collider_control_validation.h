// Motions of colliders: those of a spec, and the controls of a StepRequest. Pure.
#pragma once

#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "drape/v1/step.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/colliders.h"
#include "server/session/control_rows.h"

namespace drape::api {

// The motions of `colliders`, whose shapes are `shapes`; empty if all of them rest about their
// centres, or after a violation of a shape.
std::vector<RigidMotion> CheckColliderMotions(
    const FieldPath& path, const google::protobuf::RepeatedPtrField<v1::Collider>& colliders,
    const std::vector<Collider>& shapes, Violations& violations);

// Reads the rows of "collider_controls" and adds what is wrong to `violations`.
std::vector<ControlRow<ColliderControl>> CheckColliderControls(const v1::ColliderControls& controls,
                                                               Violations& violations);

}  // namespace drape::api
