#include "server/solver/cpu/side_by_side/pin_lists.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

namespace drape::cpu {
namespace {

// Tethers of a particle, one for each pin, at most [-]. Larger: more are looked at than any cloth
// has; smaller: more of them lead to another pin in each cloth.
constexpr int kMostByPins = 4;

}  // namespace

void PinLists::Make(std::span<const Lane> lanes, const FloatModel& layout) {
  all_cloths = (uint32_t{1} << lanes.size()) - 1;
  held_by.assign(layout.particle_count, 0);
  ListHolds(lanes);
  held_particles.clear();
  free_particles.clear();
  for (uint32_t i = 0; i < layout.particle_count; ++i) {
    if (held_by[i] != 0) held_particles.push_back(i);
    if (held_by[i] != all_cloths) free_particles.push_back(i);
  }
  released.clear();
  for (const uint32_t i : layout.pins) {
    if (held_by[i] != all_cloths) released.push_back(i);
  }
  MarkLinks(layout);
  tethers_of_lanes.clear();
  tether_offsets.assign(1, 0);
  tethers.clear();
  tether_ends.clear();
  length_blocks_.clear();
  const bool have_one_model =
      std::ranges::all_of(lanes, [&](const Lane& lane) { return lane.model == lanes[0].model; });
  one_model = have_one_model ? lanes[0].model : nullptr;
  if (have_one_model) return;
  for (const Lane& lane : lanes) tethers_of_lanes.emplace_back(*lane.model);
  for (uint32_t i = 0; i < layout.particle_count; ++i) ListTethers(i);
}

void PinLists::ListHolds(std::span<const Lane> lanes) {
  holds.clear();
  pin_count = 0;
  for (const Lane& lane : lanes) {
    pin_count = std::max(pin_count, static_cast<uint32_t>(lane.held.size()));
  }
  for (uint32_t pin = 0; pin < pin_count; ++pin) {
    const auto begin = static_cast<std::ptrdiff_t>(holds.size());
    for (size_t lane = 0; lane < lanes.size(); ++lane) {
      if (pin >= lanes[lane].held.size()) continue;
      const uint32_t particle = lanes[lane].held[pin], cloth = uint32_t{1} << lane;
      held_by[particle] |= cloth;
      const auto same = std::find_if(holds.begin() + begin, holds.end(), [&](const PinHold& hold) {
        return hold.particle == particle;
      });
      if (same == holds.end()) {
        holds.push_back({particle, pin, cloth});
      } else {
        same->cloths |= cloth;
      }
    }
  }
}

void PinLists::AddEnd(uint32_t pin, uint32_t cloth, uint32_t begin) {
  for (size_t k = begin; k < tether_ends.size(); ++k) {
    if (tether_ends[k].pin != pin) continue;
    tether_ends[k].cloths |= cloth;
    return;
  }
  tether_ends.push_back({pin, cloth});
}

// Numbers of links follow from what their ends weigh.
void PinLists::MarkLinks(const FloatModel& layout) {
  has_own_link.clear();
  const auto differs = [&](uint32_t i) {
    return i < layout.particle_count && held_by[i] != (layout.IsFree(i) ? 0 : all_cloths);
  };
  for (const StripPair& pair : layout.strip_pairs) {
    const std::array<uint32_t, 2>* from = &pair.first;
    for (uint32_t k = pair.link_begin; k < pair.link_end; ++k) {
      const std::array<uint32_t, 2>& to = layout.pair_links[k].to;
      has_own_link.push_back(std::ranges::any_of(*from, differs) ||
                             std::ranges::any_of(to, differs));
      from = &to;
    }
  }
}

void PinLists::ListTethers(uint32_t particle) {
  if (!ListByPins(particle)) ListByRanks(particle);
  AddLengths(particle);
  tether_offsets.push_back(static_cast<uint32_t>(tethers.size()));
}

void PinLists::AddLengths(uint32_t particle) {
  const size_t begin = tether_offsets.back(), lanes = tethers_of_lanes.size();
  if (tethers.size() == begin) return;
  LengthBlock endless;
  endless.numbers.fill(std::numeric_limits<float>::infinity());
  constexpr size_t kBlock = endless.numbers.size();
  length_blocks_.resize((tethers.size() * lanes + kBlock - 1) / kBlock, endless);
  float* const lengths = length_blocks_[0].numbers.data() + begin * lanes;
  for (size_t lane = 0; lane < lanes; ++lane) {
    const TethersOfLane& own = tethers_of_lanes[lane];
    size_t place = 0;
    for (uint32_t t = own.offsets[particle]; t < own.offsets[particle + 1]; ++t, ++place) {
      while (!tethers[begin + place].MayLeadTo(own.tethers[t].pin_index)) ++place;
      lengths[place * lanes + lane] = own.tethers[t].length;
    }
  }
}

bool PinLists::ListByPins(uint32_t particle) {
  uint64_t pins = 0;  // a bit of each
  for (const TethersOfLane& lane : tethers_of_lanes) {
    for (uint32_t t = lane.offsets[particle]; t < lane.offsets[particle + 1]; ++t) {
      const uint32_t pin = lane.tethers[t].pin_index;
      if (pin >= 64) return false;
      pins |= uint64_t{1} << pin;
    }
  }
  if (std::popcount(pins) > kMostByPins) return false;
  for (; pins != 0; pins &= pins - 1) {
    tethers.push_back({static_cast<uint32_t>(std::countr_zero(pins)), 0, 0});
  }
  return true;
}

void PinLists::ListByRanks(uint32_t particle) {
  const std::span<const TethersOfLane> lanes = tethers_of_lanes;
  uint32_t count = 0;
  for (const TethersOfLane& lane : lanes) {
    count = std::max(count, lane.offsets[particle + 1] - lane.offsets[particle]);
  }
  for (uint32_t rank = 0; rank < count; ++rank) {
    constexpr uint32_t kNone = ~uint32_t{0};
    const auto begin = static_cast<uint32_t>(tether_ends.size());
    uint32_t first_pin = kNone;
    for (size_t lane = 0; lane < lanes.size(); ++lane) {
      const uint32_t own = lanes[lane].offsets[particle] + rank;
      if (own >= lanes[lane].offsets[particle + 1]) continue;
      const uint32_t pin = lanes[lane].tethers[own].pin_index;
      if (first_pin == kNone) first_pin = pin;
      if (pin != first_pin) AddEnd(pin, uint32_t{1} << lane, begin);
    }
    tethers.push_back({first_pin, begin, static_cast<uint32_t>(tether_ends.size())});
  }
}

}  // namespace drape::cpu
