// drape.v1.Collider, in and out. Pure.
#pragma once

#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/api/limits.h"
#include "server/scene/colliders.h"

namespace drape::api {

// Distance maps without their maps: ReadColliderMeshes and BuildColliderMaps (collider_maps.h) make
// them. The value returned after a violation is usable but meaningless.
std::vector<Collider> CheckColliders(
    const FieldPath& path, const google::protobuf::RepeatedPtrField<v1::Collider>& colliders,
    const RequestLimits& limits, Violations& violations);

// A mesh has only the shapes of its arrays, which may be large.
v1::Collider ToProto(const Collider& collider);

}  // namespace drape::api
