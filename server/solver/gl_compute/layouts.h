// The places of a cloth's arrays on the device. Pure.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "server/solver/gl_compute/planned_cloth.h"
#include "shaders/interface/layouts.h"

namespace drape {

// Consecutive arrays: word offsets from the start of their range, and its length. Offsets beyond 32
// bits are cut; no device has room for a range of that length.
template <class Layout>
struct PackedLayout {
  Layout layout{};
  uint64_t size = 0;

  // The offset of `words` more.
  uint32_t Append(uint64_t words) {
    const uint64_t begin = size;
    size += words;
    return static_cast<uint32_t>(begin);
  }
};

// The layout from the start of the block, of a range that starts at `begin`.
template <class Layout>
Layout Placed(const Layout& layout, uint32_t begin) {
  auto offsets = std::bit_cast<std::array<uint32_t, sizeof(Layout) / sizeof(uint32_t)>>(layout);
  for (uint32_t& offset : offsets) offset += begin;
  return std::bit_cast<Layout>(offsets);
}

PackedLayout<shader::ParameterLayout> LayOutParameters(const PlannedCloth& cloth);

// `has_work_state`: the step's own copy of the state is in Scratch.
PackedLayout<shader::ScratchLayout> LayOutScratch(const PlannedCloth& cloth, bool has_work_state);

// Work groups that measure a cloth.
uint32_t MeasurePieceCount(const SceneModel& model);

}  // namespace drape
