// The cloths of a step request by id.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>

#include "server/session/cloth_record.h"

namespace drape {

// At most this many bad rows of a table of controls are named; the rest would be more of the same.
inline constexpr size_t kMaxNamedRows = 16;

class ClothIndices {
 public:
  explicit ClothIndices(std::span<const std::shared_ptr<ClothRecord>> cloths) {
    for (uint32_t k = 0; k < cloths.size(); ++k) indices_.emplace(cloths[k]->id, k);
  }

  // None: no cloth of the request.
  std::optional<uint32_t> Find(ClothId id) const {
    const auto found = indices_.find(id);
    if (found == indices_.end()) return std::nullopt;
    return found->second;
  }

 private:
  std::unordered_map<ClothId, uint32_t> indices_;
};

}  // namespace drape
