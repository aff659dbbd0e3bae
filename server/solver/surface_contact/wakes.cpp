#include "server/solver/surface_contact/wakes.h"

#include <bit>
#include <numeric>

namespace drape::surface_contact {

template <class Real>
void Wakes<Real>::Begin(uint32_t particle_count, std::vector<Corners> corners) {
  corners_ = std::move(corners);
  wakes_.assign(corners_.size(), kMost);
  substeps_.assign(corners_.size(), kNever);
  ways_.assign(particle_count, 0);
  first_wakes_.assign(particle_count, kMost);
  offsets_.assign(particle_count + 1, 0);
  for (const Corners& its : corners_) {
    for (const uint32_t i : its) ++offsets_[i];
  }
  // First where the parts of each particle end; from the last part on, down to where they begin.
  std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
  parts_.resize(offsets_.back());
  for (size_t part = corners_.size(); part-- > 0;) {
    for (const uint32_t i : corners_[part]) parts_[--offsets_[i]] = static_cast<uint32_t>(part);
  }
  again_.clear();
  timed_.clear();
  first_timed_ = 0;
  is_due_.assign((corners_.size() + 63) / 64, 0);
}

template <class Real>
void Wakes<Real>::Wait(size_t part, Real way, uint32_t substep) {
  wakes_[part] = WayOf(part) + way;
  substeps_[part] = substep;
  for (const uint32_t i : corners_[part]) {
    first_wakes_[i] = std::min(first_wakes_[i], wakes_[part]);
  }
  if (substep != kNever) timed_.emplace_back(substep, static_cast<uint32_t>(part));
}

template <class Real>
void Wakes<Real>::LookAgain(size_t part) {
  wakes_[part] = kMost;
  substeps_[part] = 0;
  again_.push_back(static_cast<uint32_t>(part));
}

// Those that wake where this particle may come; the others say when to look at it again.
template <class Real>
void Wakes<Real>::LookAtPartsOf(uint32_t particle, Real reach) {
  Real first = kMost;
  for (uint32_t k = offsets_[particle]; k < offsets_[particle + 1]; ++k) {
    const uint32_t part = parts_[k];
    if (reach >= wakes_[part]) {
      Mark(part);
    } else {
      first = std::min(first, wakes_[part]);
    }
  }
  first_wakes_[particle] = first;
}

template <class Real>
std::span<const uint32_t> Wakes<Real>::FindDue(uint32_t substep, Real expected) {
  for (const uint32_t part : again_) Mark(part);
  again_.clear();
  for (; first_timed_ < timed_.size() && timed_[first_timed_].first <= substep; ++first_timed_) {
    const auto [its, part] = timed_[first_timed_];
    if (substeps_[part] == its) Mark(part);  // else it has been looked at since
  }
  for (uint32_t i = 0; i < ways_.size(); ++i) {
    const Real reach = ways_[i] + expected;
    if (reach >= first_wakes_[i]) LookAtPartsOf(i, reach);
  }
  due_.clear();
  for (uint32_t word = 0; word < is_due_.size(); ++word) {
    for (uint64_t bits = is_due_[word]; bits != 0; bits &= bits - 1) {
      due_.push_back(word * 64 + static_cast<uint32_t>(std::countr_zero(bits)));
    }
    is_due_[word] = 0;
  }
  return due_;
}

template class Wakes<float>;
template class Wakes<double>;

}  // namespace drape::surface_contact
