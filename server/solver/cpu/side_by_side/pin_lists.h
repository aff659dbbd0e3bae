// Which particles the cloths of a group hold that do not all hold the same ones (lanes.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/model/float_model.h"

namespace drape::cpu {

// Some of the cloths of a group, one bit each, have this particle as their pin of this index; what
// they grip counts on behind the pins.
struct PinHold {
  uint32_t particle;
  uint32_t pin;
  uint32_t cloths;
};

// One tether of a particle leads to the pin of this index in some of the cloths.
struct TetherEnd {
  uint32_t pin;
  uint32_t cloths;
};

// One tether of a particle: to the pin of this index, but in some cloths to others.
struct OwnTether {
  uint32_t pin;
  uint32_t others_begin;  // in PinLists::tether_ends
  uint32_t others_end;

  // Of the tethers of a particle, looked at one after the other.
  bool MayLeadTo(uint32_t other) const { return pin == other || others_begin != others_end; }
};

// The tethers of the model in a lane.
struct TethersOfLane {
  explicit TethersOfLane(const FloatModel& model)
      : offsets(model.source->tether_offsets().data()), tethers(model.single_tethers.data()) {}

  const uint32_t* offsets;  // [particle_count + 1]
  const SingleTether* tethers;
};

// Made anew for each step; kept only to save allocations.
struct PinLists {
  // The cloth in each lane.
  struct Lane {
    const FloatModel* model;
    std::span<const uint32_t> held;  // HeldParticles::particles
  };
  // `layout`: what they share (FloatModel::layout).
  void Make(std::span<const Lane> lanes, const FloatModel& layout);

  uint32_t all_cloths = 0;               // a bit of each lane
  std::vector<uint32_t> held_by;         // [particle_count] a bit of each lane
  std::vector<uint32_t> held_particles;  // by some cloth, ascending
  std::vector<uint32_t> free_particles;  // in some cloth, ascending
  std::vector<uint32_t> released;        // those of them that the layout holds
  uint32_t pin_count = 0;                // of the cloth that has most
  std::vector<PinHold> holds;
  // Of each of FloatModel::pair_links: whether the numbers of some cloth are not those of the
  // layout.
  std::vector<uint8_t> has_own_link;
  const FloatModel* one_model = nullptr;  // of all cloths; null: they have several
  // Of several models, those of each lane, and of all together the tethers of each particle, each
  // cloth's in the order of its pins: offsets [particle_count + 1]. One for each pin to which any
  // cloth has one or, where those were many, the first of each cloth, then the second, and so on.
  std::vector<TethersOfLane> tethers_of_lanes;
  std::vector<uint32_t> tether_offsets;
  std::vector<OwnTether> tethers;
  std::vector<TetherEnd> tether_ends;
  // [tethers][lanes] their lengths [m], infinite where a cloth has no such tether; aligned as
  // registers are.
  const float* tether_lengths() const {
    return length_blocks_.empty() ? nullptr : length_blocks_[0].numbers.data();
  }

 private:
  void ListHolds(std::span<const Lane> lanes);
  void MarkLinks(const FloatModel& layout);
  void ListTethers(uint32_t particle);
  // Whether they could be listed so.
  bool ListByPins(uint32_t particle);
  void ListByRanks(uint32_t particle);
  void AddLengths(uint32_t particle);
  // Of the tether whose ends begin there.
  void AddEnd(uint32_t pin, uint32_t cloth, uint32_t begin);

  // As large as the largest registers, and aligned as they are.
  struct alignas(64) LengthBlock {
    std::array<float, 16> numbers;
  };
  std::vector<LengthBlock> length_blocks_;
};

}  // namespace drape::cpu
