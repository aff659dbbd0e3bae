#include "server/solver/cpu/refine.h"

#include <algorithm>

namespace drape::cpu {

void Refinement::Begin(uint32_t particle_count) {
  if (far_off_.size() < particle_count) far_off_.resize(particle_count, 0);
}

std::span<const RefinedLink> Refinement::TakeLinks(const FloatModel& model) {
  links_.clear();
  for (const uint32_t i : particles_) {
    for (uint32_t k = model.link_offsets[i]; k < model.link_offsets[i + 1]; ++k) {
      links_.push_back({model.link_places[k], 0});
    }
  }
  const auto is_before = [](const RefinedLink& a, const RefinedLink& b) {
    return a.place < b.place;
  };
  const auto is_same = [](const RefinedLink& a, const RefinedLink& b) {
    return a.place == b.place;
  };
  std::sort(links_.begin(), links_.end(), is_before);
  links_.erase(std::unique(links_.begin(), links_.end(), is_same), links_.end());
  for (RefinedLink& link : links_) {
    const DistanceGroup& group = model.groups[link.place / kLaneCount];
    const uint32_t lane = link.place % kLaneCount;
    link.cloths = far_off_[group.i[lane]] | far_off_[group.j[lane]];
  }
  for (const uint32_t i : particles_) far_off_[i] = 0;
  particles_.clear();
  return links_;
}

}  // namespace drape::cpu
