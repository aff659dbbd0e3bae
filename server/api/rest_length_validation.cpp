#include "server/api/rest_length_validation.h"

#include "server/api/over_column.h"
#include "server/scene/description_checks.h"

namespace drape::api {

std::vector<ControlRow<LengthControl>> CheckLengthControls(const v1::RestLengthControls& controls,
                                                           Violations& violations) {
  std::vector<ControlRow<LengthControl>> result;
  const FieldPath path("rest_length_controls");
  const size_t rows = controls.cloth_ids_size();
  const bool is_even =
      violations.Length(path.Child("constraints"), controls.constraints_size(), rows, "1 per row") &
      violations.Length(path.Child("lengths_m"), controls.lengths_m_size(), rows, "1 per row") &
      CheckOverColumn(path.Child("over_s"), controls.over_s(), rows, violations);
  if (!is_even) return result;
  for (size_t r = 0; r < rows && !violations.is_full(); ++r) {
    const int row = static_cast<int>(r);
    violations.InRange(path.Child("lengths_m").At(r), controls.lengths_m(row),
                       {kMinRestLength_m, kMaxExtent_m, "m"});
    const double over_s = CheckOver(path.Child("over_s"), controls.over_s(), r, violations);
    result.push_back({ClothId::FromPacked(controls.cloth_ids(row)),
                      {controls.constraints(row), controls.lengths_m(row), over_s}});
  }
  return result;
}

std::vector<ControlRow<LengthScale>> CheckLengthScales(const v1::RestLengthScales& scales,
                                                       Violations& violations) {
  std::vector<ControlRow<LengthScale>> result;
  const FieldPath path("rest_length_scales");
  const size_t rows = scales.cloth_ids_size();
  const bool is_even =
      violations.Length(path.Child("scales"), scales.scales_size(), rows, "1 per row") &
      CheckOverColumn(path.Child("over_s"), scales.over_s(), rows, violations);
  if (!is_even) return result;
  for (size_t r = 0; r < rows && !violations.is_full(); ++r) {
    const int row = static_cast<int>(r);
    violations.InRange(path.Child("scales").At(r), scales.scales(row),
                       {1 / kMaxLengthScale, kMaxLengthScale});
    const double over_s = CheckOver(path.Child("over_s"), scales.over_s(), r, violations);
    result.push_back({ClothId::FromPacked(scales.cloth_ids(row)), {scales.scales(row), over_s}});
  }
  return result;
}

}  // namespace drape::api
