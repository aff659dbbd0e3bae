// Constraints and springs that replace those of running cloths. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/scene/description.h"

namespace drape::api {

// As in topology_validation.h, except for rest lengths: those that are set are checked here, and
// the others stay marked as unset (kRestShapeLength) until the rest shape is known. `path` leads to
// `particles`.
std::vector<DistanceConstraint> CheckNewConstraints(const FieldPath& path,
                                                    const v1::Particles& particles,
                                                    Violations& violations);
std::vector<Spring> CheckNewSprings(const FieldPath& path, const v1::Particles& particles,
                                    Violations& violations);

}  // namespace drape::api
