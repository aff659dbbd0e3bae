// From the topology of a drape.v1.ClothSpec to plain values. Pure.
#pragma once

#include <optional>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/description.h"

namespace drape::api {

// Checks only what is lost in plain values: that a topology is set, and the form of packed and flat
// arrays. Sizes, indices and numbers are drape::CheckDescription's. None where there is nothing to
// go on with. `path` leads to the spec.
std::optional<Topology> ReadTopology(const FieldPath& path, const v1::ClothSpec& spec,
                                     FieldChecks& checks);

}  // namespace drape::api
