// drape.v1.BodyJoint, in and out. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/body_joint.h"

namespace drape::api {

// The joints of one collider among `collider_count`. The value returned after a violation is usable
// but meaningless.
std::vector<BodyJoint> CheckJoints(const FieldPath& path,
                                   const google::protobuf::RepeatedPtrField<v1::BodyJoint>& joints,
                                   uint32_t collider, uint32_t collider_count,
                                   Violations& violations);

v1::BodyJoint ToProto(const BodyJoint& joint);

}  // namespace drape::api
