// A list of those of many candidates that pass a test which no processor can foresee.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace drape::self_contact {

// Every candidate is written, and the next one over it if it did not pass: a branch would be
// predicted wrongly half the time, which takes longer than most tests.
template <class T>
class FilteredList {
 public:
  void clear() { size_ = 0; }
  // Makes room for so many candidates more.
  void Reserve(size_t candidates) {
    if (entries_.size() < size_ + candidates) entries_.resize(2 * (size_ + candidates));
  }
  // Within the room.
  void Offer(const T& candidate, bool passes) {
    entries_[size_] = candidate;
    size_ += static_cast<size_t>(passes);
  }
  std::span<const T> entries() const { return std::span(entries_).first(size_); }
  size_t size() const { return size_; }

 private:
  std::vector<T> entries_;
  size_t size_ = 0;
};

}  // namespace drape::self_contact
