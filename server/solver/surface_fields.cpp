#include "server/solver/surface_fields.h"

#include <string>

namespace drape {

std::vector<FieldViolation> CheckSelfFriction(const ClothParameters& parameters) {
  if (!parameters.self_collision) return {};
  const SelfContactNumbers numbers = SelfContactOf(parameters);
  const Range legal{0, kMaxCoefficient};
  const double most = numbers.friction_static;
  const double dynamic = numbers.friction_dynamic;
  if (!legal.Contains(most) || !legal.Contains(dynamic) || dynamic <= most) return {};
  const auto owner = [](bool is_own) { return is_own ? "its own" : "the material's"; };
  const bool has_dynamic = parameters.self_collision->friction_dynamic.has_value();
  const bool has_static = parameters.self_collision->friction_static.has_value();
  return {{has_dynamic || !has_static ? "self_collision.friction_dynamic"
                                      : "self_collision.friction_static",
           "friction_dynamic " + NumberText(dynamic) + " (" + owner(has_dynamic) +
               ") is not in [0, friction_static = " + NumberText(most) + " (" + owner(has_static) +
               ")]"}};
}

}  // namespace drape
