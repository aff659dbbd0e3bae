#include "server/session/rest_length_controls.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/scene/description_checks.h"

namespace drape {
namespace {

// At most this many bad rows are named; the rest would be more of the same.
constexpr size_t kMaxViolations = 16;

// The cloths of a request by id.
class ClothIndices {
 public:
  explicit ClothIndices(std::span<const std::shared_ptr<ClothRecord>> cloths) {
    for (uint32_t k = 0; k < cloths.size(); ++k) indices_.emplace(cloths[k]->id, k);
  }
  std::optional<uint32_t> Find(ClothId id) const {
    const auto found = indices_.find(id);
    if (found == indices_.end()) return std::nullopt;
    return found->second;
  }

 private:
  std::unordered_map<ClothId, uint32_t> indices_;
};

// Empty: the constraint can be driven.
std::string WhyNot(const SceneModel& model, uint32_t constraint) {
  if (constraint >= model.described_constraint_count()) {
    return fmt::format("{} is not below the number of distance constraints, {}", constraint,
                       model.described_constraint_count());
  }
  const auto sources = model.constraint_sources();
  if (std::find(sources.begin(), sources.end(), constraint) != sources.end()) return "";
  return fmt::format("constraint {} joins two pins", constraint);
}

double ShortestLength(const SceneModel& model) {
  double shortest = kMaxExtent_m;
  for (const auto& constraint : model.constraints()) {
    shortest = std::min(shortest, constraint.rest_length_m);
  }
  return shortest;
}

double LongestLength(const SceneModel& model) {
  double longest = 0;
  for (const auto& constraint : model.constraints()) {
    longest = std::max(longest, constraint.rest_length_m);
  }
  return longest;
}

std::string WhyNotScale(const SceneModel& model, double scale) {
  if (model.constraint_count() == 0) return "the cloth has no distance constraint";
  const double shortest_m = scale * ShortestLength(model);
  const double longest_m = scale * LongestLength(model);
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
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxViolations; ++r) {
    const std::optional<uint32_t> index = indices.Find(rows[r].cloth);
    if (!index) {
      violations.push_back(
          {fmt::format("rest_length_controls.cloth_ids[{}]", r), "no cloth of this request"});
      continue;
    }
    std::string why_not = WhyNot(*cloths[*index]->description()->model, rows[r].constraint);
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
  for (size_t r = 0; r < rows.size() && violations.size() < kMaxViolations; ++r) {
    const std::optional<uint32_t> index = indices.Find(rows[r].cloth);
    if (!index) {
      violations.push_back(
          {fmt::format("rest_length_scales.cloth_ids[{}]", r), "no cloth of this request"});
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
