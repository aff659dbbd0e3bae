// The numbers of a material that ClothParameters holds, as a table: checks, messages and changes of
// cloths iterate over it.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "server/core/violations.h"
#include "server/scene/description_checks.h"
#include "server/solver/cloth_parameters.h"

namespace drape {

struct SurfaceField {
  std::string_view name;  // of the field of drape.v1.Material
  double ClothParameters::*member;
  Range range;
};

inline constexpr std::array kSurfaceFields{
    SurfaceField{"damping_per_s", &ClothParameters::damping_per_s, {0, kMaxCoefficient, "1/s"}},
    SurfaceField{"friction_static", &ClothParameters::friction_static, {0, kMaxCoefficient}},
    SurfaceField{"friction_dynamic", &ClothParameters::friction_dynamic, {0, kMaxCoefficient}},
    SurfaceField{"restitution", &ClothParameters::restitution, {0, 1}},
    SurfaceField{"thickness_m", &ClothParameters::thickness_m, {0, kMaxExtent_m, "m"}},
    SurfaceField{"air_drag", &ClothParameters::air_drag, {0, kMaxAirCoefficient}},
    SurfaceField{"air_lift", &ClothParameters::air_lift, {0, kMaxAirCoefficient}},
};

// Of a cloth that touches itself: friction_dynamic <= friction_static, with the material's numbers
// where it has none of its own. Empty: it is so, or a number is out of its own range.
std::vector<FieldViolation> CheckSelfFriction(const ClothParameters& parameters);

}  // namespace drape
