#include "server/solver/gl_compute/device_map.h"

#include <array>
#include <bit>
#include <utility>

#include "shaders/interface/bindings.h"

namespace drape {

Result<std::shared_ptr<const DeviceMap>> MapStore::Acquire(std::shared_ptr<const DistanceMap> map) {
  const auto known = maps_.find(map.get());
  if (known != maps_.end()) {
    if (std::shared_ptr<const DeviceMap> on_device = known->second.lock()) return on_device;
  }
  std::erase_if(maps_, [](const auto& entry) { return entry.second.expired(); });
  const auto [count_x, count_y, count_z] = map->sample_counts();
  const std::array<uint32_t, DRAPE_MAP_HEADER_WORDS> header = {
      count_x, count_y, count_z, std::bit_cast<uint32_t>(static_cast<float>(map->cell_m())),
      std::bit_cast<uint32_t>(static_cast<float>(1 / map->cell_m()))};
  Result<WordRange> range = arena_->Allocate(header.size() + map->samples_m().size());
  if (!range.ok()) return range.status();
  auto on_device = std::make_shared<DeviceMap>();
  on_device->words = std::move(range).value();
  arena_->Write(on_device->words, 0, std::span<const uint32_t>(header));
  arena_->Write(on_device->words, DRAPE_MAP_HEADER_WORDS, map->samples_m());
  maps_[map.get()] = on_device;
  on_device->map = std::move(map);
  return std::shared_ptr<const DeviceMap>(on_device);
}

}  // namespace drape
