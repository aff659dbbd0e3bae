#include "server/solver/cpu/step/refine.h"

#include <bit>

namespace drape::cpu {
namespace {

constexpr uint32_t kWordBits = 64;

}  // namespace

void Refinement::Begin(const FloatModel& model) {
  model_ = &model;
  solves_.fill(0);
  if (marks_.size() < model.particle_count) marks_.resize(model.particle_count, 0);
  const size_t word_count = (model.groups.size() * kVec4Size + kWordBits - 1) / kWordBits;
  if (is_listed_.size() < word_count) is_listed_.resize(word_count, 0);
}

void Refinement::Mark(uint32_t place, uint32_t cloths) {
  const DistanceGroup& group = model_->groups[place / kVec4Size];
  const uint32_t lane = place % kVec4Size;
  MarkEnd(group.i[lane], cloths);
  MarkEnd(group.j[lane], cloths);
}

void Refinement::MarkEnd(uint32_t i, uint32_t cloths) {
  if (marks_[i] == 0) particles_.push_back(i);
  marks_[i] |= cloths;
}

std::span<const RefinedLink> Refinement::TakeLinks() {
  links_.clear();
  if (particles_.empty()) return links_;
  for (const uint32_t i : particles_) {
    for (uint32_t k = model_->link_offsets[i]; k < model_->link_offsets[i + 1]; ++k) {
      const uint32_t place = model_->link_places[k];
      is_listed_[place / kWordBits] |= uint64_t{1} << place % kWordBits;
    }
  }
  for (uint32_t word = 0; word < is_listed_.size(); ++word) {
    for (uint64_t bits = is_listed_[word]; bits != 0; bits &= bits - 1) {
      const uint32_t place = word * kWordBits + static_cast<uint32_t>(std::countr_zero(bits));
      const DistanceGroup& group = model_->groups[place / kVec4Size];
      const uint32_t lane = place % kVec4Size;
      links_.push_back({place, marks_[group.i[lane]] | marks_[group.j[lane]]});
    }
    is_listed_[word] = 0;
  }
  for (const uint32_t i : particles_) marks_[i] = 0;
  particles_.clear();
  return links_;
}

uint32_t Refinement::ClothsGoingOn(std::span<const RefinedLink> moved, uint32_t solve_limit) {
  for (const RefinedLink& link : moved) {
    for (uint32_t bits = link.cloths; bits != 0; bits &= bits - 1) {
      solves_[static_cast<size_t>(std::countr_zero(bits))] += kRefineSweeps;
    }
  }
  uint32_t going_on = 0;
  for (uint32_t cloth = 0; cloth < kMostCloths; ++cloth) {
    if (solves_[cloth] < solve_limit) going_on |= uint32_t{1} << cloth;
  }
  return going_on;
}

}  // namespace drape::cpu
