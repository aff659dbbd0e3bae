// The columns of requests that change or reset cloths one by one: transforms and overrides. Pure.
#pragma once

#include <vector>

#include "drape/v1/cloths.pb.h"
#include "server/api/field_checks.h"
#include "server/session/cloth_reset.h"

namespace drape::api {

using OverrideList = google::protobuf::RepeatedPtrField<v1::ClothOverride>;

// Seven numbers per row, or none: then the result is empty.
std::vector<RigidTransform> CheckTransforms(const FieldPath& path, const DoubleList& transforms,
                                            size_t rows, Violations& violations);

// One per row, or none. Settings are refused: UpdateCloths has a path for them.
std::vector<ParameterOverride> CheckParameterOverrides(const FieldPath& path,
                                                       const OverrideList& overrides, size_t rows,
                                                       Violations& violations);

}  // namespace drape::api
