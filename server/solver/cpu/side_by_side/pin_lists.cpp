#include "server/solver/cpu/side_by_side/pin_lists.h"

#include <algorithm>

namespace drape::cpu {

void PinLists::Make(std::span<const FloatModel* const> models, const FloatModel& layout) {
  all_cloths = (uint32_t{1} << models.size()) - 1;
  held_by.assign(layout.particle_count, 0);
  ListHolds(models);
  free_particles.clear();
  for (uint32_t i = 0; i < layout.particle_count; ++i) {
    if (held_by[i] != all_cloths) free_particles.push_back(i);
  }
  released.clear();
  for (const uint32_t i : layout.pins) {
    if (held_by[i] != all_cloths) released.push_back(i);
  }
  tether_offsets.assign(1, 0);
  tether_end_offsets.assign(1, 0);
  tether_ends.clear();
  for (uint32_t i = 0; i < layout.particle_count; ++i) ListTethers(models, i);
}

void PinLists::ListHolds(std::span<const FloatModel* const> models) {
  holds.clear();
  pin_count = 0;
  for (const FloatModel* model : models) {
    pin_count = std::max(pin_count, static_cast<uint32_t>(model->pins.size()));
  }
  for (uint32_t pin = 0; pin < pin_count; ++pin) {
    const auto begin = static_cast<std::ptrdiff_t>(holds.size());
    for (size_t lane = 0; lane < models.size(); ++lane) {
      if (pin >= models[lane]->pins.size()) continue;
      const uint32_t particle = models[lane]->pins[pin], cloth = uint32_t{1} << lane;
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

void PinLists::ListTethers(std::span<const FloatModel* const> models, uint32_t particle) {
  const auto offset = [&](const FloatModel* model, uint32_t i) {
    return model->source->tether_offsets()[i];
  };
  uint32_t count = 0;
  for (const FloatModel* model : models) {
    count = std::max(count, offset(model, particle + 1) - offset(model, particle));
  }
  for (uint32_t rank = 0; rank < count; ++rank) {
    const auto begin = static_cast<std::ptrdiff_t>(tether_ends.size());
    for (size_t lane = 0; lane < models.size(); ++lane) {
      const uint32_t own = offset(models[lane], particle) + rank;
      if (own >= offset(models[lane], particle + 1)) continue;
      const uint32_t pin = models[lane]->single_tethers[own].pin_index, cloth = uint32_t{1} << lane;
      const auto same = std::find_if(tether_ends.begin() + begin, tether_ends.end(),
                                     [&](const TetherEnd& end) { return end.pin == pin; });
      if (same == tether_ends.end()) {
        tether_ends.push_back({pin, cloth});
      } else {
        same->cloths |= cloth;
      }
    }
    tether_end_offsets.push_back(static_cast<uint32_t>(tether_ends.size()));
  }
  tether_offsets.push_back(tether_offsets.back() + count);
}

}  // namespace drape::cpu
