#include "server/api/start_validation.h"

#include "server/api/geometry_message.h"
#include "server/api/material_message.h"
#include "server/api/settings_message.h"
#include "server/api/spec_validation.h"
#include "server/scene/description_checks.h"

namespace drape::api {
namespace {

// x, y, z, quaternion x, y, z, w.
constexpr size_t kNumbersPerTransform = 7;

}  // namespace

std::vector<RigidTransform> CheckTransforms(const FieldPath& path, const DoubleList& transforms,
                                            size_t rows, Violations& violations) {
  std::vector<RigidTransform> result;
  if (transforms.empty()) return result;
  if (!violations.Length(path, transforms.size(), rows * kNumbersPerTransform, "7 per cloth") ||
      !CheckAllWithin(path, transforms, kMaxExtent_m, "", violations)) {
    return result;
  }
  for (size_t k = 0; k < rows && !violations.is_full(); ++k) {
    const double* row = transforms.data() + kNumbersPerTransform * k;
    RigidTransform& transform = result.emplace_back();
    transform.position_m = {row[0], row[1], row[2]};
    transform.rotation = CheckRotation(path.At(kNumbersPerTransform * k + 3),
                                       {row[3], row[4], row[5], row[6]}, violations);
  }
  return result;
}

std::vector<ParameterOverride> CheckParameterOverrides(const FieldPath& path,
                                                       const OverrideList& overrides, size_t rows,
                                                       Violations& violations) {
  std::vector<ParameterOverride> result;
  if (overrides.empty() || !violations.Length(path, overrides.size(), rows, "1 per cloth")) {
    return result;
  }
  const ClothParameters none;
  for (size_t k = 0; k < rows && !violations.is_full(); ++k) {
    const v1::ClothOverride& message = overrides[static_cast<int>(k)];
    ParameterOverride& own = result.emplace_back();
    violations.Require(!message.has_settings(), path.At(k).Child("settings"), [] {
      return std::string("are the same for all cloths here: use the path \"settings\" of a mask");
    });
    // Not a number is named all the same.
    if (message.has_settings()) {
      CheckSettings(path.At(k).Child("settings"), message.settings(), violations);
    }
    if (!message.gravity_m_per_s2().empty()) {
      own.gravity_m_per_s2 =
          CheckGravity(path.At(k).Child("gravity_m_per_s2"), message.gravity_m_per_s2(),
                       none.gravity_m_per_s2, violations);
    }
    if (!message.wind_m_per_s().empty()) {
      own.wind_m_per_s = CheckWind(path.At(k).Child("wind_m_per_s"), message.wind_m_per_s(),
                                   none.wind_m_per_s, violations);
    }
    own.numbers = ReadSurfaceOverride(path.At(k), message, violations);
  }
  return result;
}

}  // namespace drape::api
