#include "server/session/driven_lengths.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace drape {

std::vector<DrivenCloth> DrivenBy(
    const StepControls& controls, std::span<const std::shared_ptr<ClothRecord>> cloths,
    std::span<const std::shared_ptr<const ClothDescription>> becoming) {
  std::vector<DrivenCloth> driven;
  const auto add = [&](uint32_t index) {
    if (!driven.empty() && driven.back().cloth == cloths[index]) return;  // rows of one cloth
    const bool is_another = !becoming.empty() && becoming[index] != nullptr;
    const auto description = is_another ? becoming[index] : cloths[index]->description();
    driven.push_back({cloths[index], description->model});
  };
  for (const auto& row : controls.length_scales) add(row.cloth_index);
  for (const auto& row : controls.lengths) add(row.cloth_index);
  return driven;
}

std::vector<DrivenCloth> DrivenBy(std::span<const LoadPair> pairs) {
  std::vector<DrivenCloth> driven;
  for (const LoadPair& pair : pairs) {
    if (!pair.from->runtime.lengths.is_driven()) continue;
    driven.push_back({pair.into, pair.from->description->model});
  }
  return driven;
}

Status ChargeLengths(std::span<const DrivenCloth> driven, ModelCache& models,
                     const std::string& owner) {
  struct Wanted {
    uint32_t count;
    std::shared_ptr<const void> charge{};
  };
  std::unordered_map<ClothRecord*, Wanted> wanted;
  for (const auto& [cloth, model] : driven) {
    // Other pins leave out other constraints.
    const uint32_t count = model->described_constraint_count();
    if (count <= cloth->charged_lengths()) continue;
    uint32_t& most = wanted.try_emplace(cloth.get(), Wanted{count}).first->second.count;
    most = std::max(most, count);
  }
  for (auto& [cloth, its] : wanted) {
    DRAPE_ASSIGN_OR_RETURN(its.charge, models.ChargeLengths(owner, its.count));
  }
  for (auto& [cloth, its] : wanted) cloth->HoldLengths(its.count, std::move(its.charge));
  return Status::Ok();
}

}  // namespace drape
