// Boxes of many primitives, compared four at a time.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/solver/self_contact/vectors.h"

namespace drape::self_contact {

// The boxes of primitives, and what they are. Working memory: Clear keeps it.
template <class V>
class BoxRows {
 public:
  using Real = ScalarOf<V>;

  static constexpr size_t kLanes = 4;

  struct Entry {
    uint32_t index;  // of a vertex, edge or triangle
    Box<V> box;
  };

  void Clear() {
    entries_.clear();
    rows_.clear();
  }
  void Add(uint32_t index, const Box<V>& box) {
    const size_t lane = entries_.size() % kLanes;
    if (lane == 0) rows_.emplace_back();
    entries_.push_back({index, box});
    for (int axis = 0; axis < 3; ++axis) {
      rows_.back().low[axis][lane] = box.low[axis];
      rows_.back().high[axis][lane] = box.high[axis];
    }
  }
  const std::vector<Entry>& entries() const { return entries_; }

  // Calls visit(index) for those from entry `begin` on that are no farther from the box than
  // `margin` along each axis (AreNear), in their order.
  template <class Visit>
  void ForEachNear(const Box<V>& box, const V& margin, size_t begin, const Visit& visit) const {
    const V low_x = All(box.low[0]), low_y = All(box.low[1]), low_z = All(box.low[2]);
    const V high_x = All(box.high[0]), high_y = All(box.high[1]), high_z = All(box.high[2]);
    const V margin_x = All(margin[0]), margin_y = All(margin[1]), margin_z = All(margin[2]);
    for (size_t r = begin / kLanes; r < rows_.size(); ++r) {
      const Row& row = rows_[r];
      const auto apart = (row.low[0] - high_x > margin_x) | (low_x - row.high[0] > margin_x) |
                         (row.low[1] - high_y > margin_y) | (low_y - row.high[1] > margin_y) |
                         (row.low[2] - high_z > margin_z) | (low_z - row.high[2] > margin_z);
      if ((apart[0] & apart[1] & apart[2] & apart[3]) != 0) continue;
      for (size_t lane = 0; lane < kLanes; ++lane) {
        const size_t entry = r * kLanes + lane;
        if (apart[lane] == 0 && entry >= begin && entry < entries_.size()) {
          visit(entries_[entry].index);
        }
      }
    }
  }

 private:
  static V All(Real value) { return V{value, value, value, value}; }
  // Lane by lane, along each axis. What is not filled is near nothing, as Box's empty box.
  struct Row {
    std::array<V, 3> low, high;
    Row() {
      low.fill(All(std::numeric_limits<Real>::max()));
      high.fill(All(-std::numeric_limits<Real>::max()));
    }
  };

  std::vector<Entry> entries_;
  std::vector<Row> rows_;
};

}  // namespace drape::self_contact
