#include "server/session/rest_length_controls.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/scene/constraint_places.h"
#include "server/scene/description_checks.h"
#include "server/session/cloth_indices.h"

namespace drape {
namespace {

// Empty: the constraint can be driven.
std::string WhyNot(const SceneModel& model, const ConstraintPlaces& places, uint32_t constraint) {
  if (constraint >= model.described_constraint_count()) {
    return fmt::format("{} is not below the number of distance constraints, {}", constraint,
                       model.described_constraint_count());
  }
  if (places.Find(constraint).has_value()) return "";
  return fmt::format("constraint {} joins two pins", constraint);
}

std::string WhyNotScale(const SceneModel& model, double scale) {
  if (model.constraint_count() == 0) return "the cloth has no distance constraint";
  const auto [shortest, longest] = std::minmax_element(
      model.constraints().begin(), model.constraints().end(),
      [](const auto& a, const auto& b) { return a.rest_length_m < b.rest_length_m; });
  const double shortest_m = scale * shortest->rest_length_m;
  const double longest_m = scale * longest->rest_length_m;
  if (shortest_m >= kMinRestLength_m && longest_m <= kMaxExtent_m) return "";
  return fmt::format("{} makes rest lengths of {} to {} m, which are not in [{}, {}] m", scale,
                     shortest_m, longest_m, kMinRestLength_m, kMaxExtent_m);
}

}  // namespace

Result<std::vector<LengthControl>> MapLengthControls(
    std::span<const RestLengthRow> rows, std::span<const std::shared_ptr<ClothRecord>> cloths) {
  std::vector<LengthControl> controls;
  std::vector<FieldViolation> violations;
  if (rows.empty()) return controls;
  const ClothIndices indices(cloths);
  std::unordered_map<uint32_t, ConstraintPlaces> places;  // by cloth
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxNamedRows; ++r) {
    const std::optional<uint32_t> index = indices.Find(rows[r].cloth);
    if (!index) {
      violations.push_back(
          {fmt::format("rest_length_controls.cloth_ids[{}]", r), "no cloth of this request"});
      continue;
    }
    const auto model = cloths[*index]->description()->model;
    const ConstraintPlaces& of_cloth = places.try_emplace(*index, *model).first->second;
    std::string why_not = WhyNot(*model, of_cloth, rows[r].constraint);
    if (!why_not.empty()) {
      violations.push_back(
          {fmt::format("rest_length_controls.constraints[{}]", r), std::move(why_not)});
      continue;
    }
    controls.push_back({*index, rows[r].constraint, rows[r].length_m, rows[r].over_s});
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return controls;
}

Result<std::vector<LengthScale>> MapLengthScales(
    std::span<const RestLengthScaleRow> rows,
    std::span<const std::shared_ptr<ClothRecord>> cloths) {
  std::vector<LengthScale> scales;
  std::vector<FieldViolation> violations;
  if (rows.empty()) return scales;
  const ClothIndices indices(cloths);
  std::unordered_set<uint32_t> scaled;
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxNamedRows; ++r) {
    const std::string cloth_field = fmt::format("rest_length_scales.cloth_ids[{}]", r);
    const std::optional<uint32_t> index = indices.Find(rows[r].cloth);
    if (!index) {
      violations.push_back({cloth_field, "no cloth of this request"});
      continue;
    }
    if (!scaled.insert(*index).second) {
      violations.push_back({cloth_field, fmt::format("{} occurs twice", rows[r].cloth.Packed())});
      continue;
    }
    std::string why_not = WhyNotScale(*cloths[*index]->description()->model, rows[r].scale);
    if (!why_not.empty()) {
      violations.push_back({fmt::format("rest_length_scales.scales[{}]", r), std::move(why_not)});
      continue;
    }
    scales.push_back({*index, rows[r].scale, rows[r].over_s});
  }
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  return scales;
}

}  // namespace drape
