// Generational ids: a stale id never names a new owner.
#pragma once

#include <cstdint>
#include <functional>

namespace drape {

// A slot of a table and the generation of its occupant. Generation 0 is never issued.
template <class Tag>
struct SlotId {
  uint32_t slot = 0;
  uint32_t generation = 0;

  friend bool operator==(const SlotId&, const SlotId&) = default;
  uint64_t Packed() const { return (uint64_t{generation} << 32) | slot; }
  static SlotId FromPacked(uint64_t packed) {
    return {static_cast<uint32_t>(packed), static_cast<uint32_t>(packed >> 32)};
  }
};

struct ClothTag {};
struct HandleTag {};
// The id that clients see (fixed64 on the wire).
using ClothId = SlotId<ClothTag>;
// The handle that a backend issues.
using ClothHandle = SlotId<HandleTag>;

}  // namespace drape

template <class Tag>
struct std::hash<drape::SlotId<Tag>> {
  size_t operator()(const drape::SlotId<Tag>& id) const {
    return std::hash<uint64_t>()(id.Packed());
  }
};
