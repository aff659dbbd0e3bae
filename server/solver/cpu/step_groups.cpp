#include "server/solver/cpu/step_groups.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <unordered_map>

namespace drape::cpu {
namespace {

// The cloths that could all share lanes, in the order of the batch, but those of a model after its
// first.
std::vector<std::vector<uint32_t>> Alike(std::span<const GroupCandidate> cloths) {
  std::map<LaneKey, size_t> places;
  std::vector<std::vector<uint32_t>> classes;
  std::unordered_map<const FloatModel*, uint32_t> firsts;  // of each model
  for (uint32_t k = 0; k < cloths.size(); ++k) {
    if (!cloths[k].key) continue;
    const auto [found, is_new] = places.emplace(*cloths[k].key, classes.size());
    if (is_new) classes.emplace_back();
    classes[found->second].push_back(k);
    firsts.emplace(cloths[k].model, k);
  }
  const auto first_of = [&](uint32_t k) {
    const GroupCandidate& cloth = cloths[k];
    return std::tuple(firsts.at(cloth.model), cloth.has_grips, cloth.asks_for_impulses);
  };
  for (std::vector<uint32_t>& alike : classes) std::ranges::stable_sort(alike, {}, first_of);
  return classes;
}

}  // namespace

LaneKey::LaneKey(const FloatModel& key_model, const FloatControls& controls,
                 uint32_t key_max_iterations, bool moves)
    : layout(&key_model.layout()),
      stages(controls.plan.stages),
      solver(controls.plan.solver),
      schedule(controls.plan.schedule),
      tolerance(controls.plan.tolerance),
      max_iterations(key_max_iterations),
      have_motions(moves),
      touching_model(controls.touches_itself ? &key_model : nullptr) {
  // Cloths with and without damping share a group: each lane has a factor of its own.
  stages.Add(StepStage::kCorrectVelocity);
  solver.span_give = 0;
  solver.end_share = controls.has_start_directions() ? 0 : 1;
  for (const FloatCollider& collider : controls.colliders) {
    colliders.push_back(static_cast<char>(collider.kind));
  }
}

std::vector<StepGroup> FormGroups(std::span<const GroupCandidate> batch, uint32_t lane_count,
                                  uint32_t thread_count) {
  const size_t share_of_thread = (batch.size() + thread_count - 1) / thread_count;
  const size_t width = std::min<size_t>(lane_count, std::max<size_t>(share_of_thread, 1));
  std::vector<StepGroup> groups;
  std::vector<uint32_t> alone;
  for (uint32_t k = 0; k < batch.size(); ++k) {
    if (!batch[k].key) alone.push_back(k);
  }
  for (const std::vector<uint32_t>& cloths : Alike(batch)) {
    for (size_t begin = 0; begin < cloths.size(); begin += width) {
      const auto first = cloths.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto count = static_cast<std::ptrdiff_t>(std::min(width, cloths.size() - begin));
      if (count >= MinGroupSize(lane_count)) {
        groups.emplace_back(first, first + count);
      } else {
        alone.insert(alone.end(), first, first + count);
      }
    }
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (const uint32_t k : alone) groups.push_back({k});
  return groups;
}

}  // namespace drape::cpu
