// From drape.v1.ClothSpec to plain values. Pure.
#pragma once

#include <vector>

#include "drape/v1/cloth_spec.pb.h"
#include "server/api/field_checks.h"
#include "server/api/limits.h"
#include "server/scene/description.h"
#include "server/solver/cloth_parameters.h"

namespace drape::api {

// A checked ClothSpec.
struct CheckedSpec {
  ModelDescription description;
  std::vector<Pin> pins;  // as in the spec; targets in the cloth's environment
  RigidTransform transform;
  ClothParameters parameters;  // vectors and colliders in the cloth's environment
};

// Each reads one part of a spec at `path` and adds what is wrong to `violations`; the value
// returned after a violation is usable but meaningless.
CheckedSpec CheckSpec(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                      Violations& violations);
// The part of CheckSpec that needs no topology: transform, environment, surface, settings, grips.
// `result.description` and `result.pins` stay as they are.
void CheckClothPart(const FieldPath& path, const v1::ClothSpec& spec, const RequestLimits& limits,
                    CheckedSpec& result, Violations& violations);
// Targets only; the indices are drape::CheckDescription's.
std::vector<Pin> CheckPinTargets(const FieldPath& path,
                                 const google::protobuf::RepeatedPtrField<v1::Pin>& pins,
                                 Violations& violations);
Eigen::Vector3d CheckGravity(const FieldPath& path, const DoubleList& gravity_m_per_s2,
                             const Eigen::Vector3d& fallback, Violations& violations);
Eigen::Vector3d CheckWind(const FieldPath& path, const DoubleList& wind_m_per_s,
                          const Eigen::Vector3d& fallback, Violations& violations);

}  // namespace drape::api
