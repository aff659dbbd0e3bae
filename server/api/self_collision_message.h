// drape.v1.SelfCollision, checked.
#pragma once

#include <optional>

#include "drape/v1/cloth_spec.pb.h"
#include "server/core/violations.h"
#include "server/solver/cloth_parameters.h"

namespace drape::api {

// Unset: the cloth passes through itself. Its friction is checked with that of `material`, whose
// numbers are its defaults.
std::optional<SelfCollision> CheckSelfCollision(const FieldPath& path, const v1::ClothSpec& spec,
                                                Violations& violations);

}  // namespace drape::api
