#include "server/solver/gl_compute/device_arrays.h"

#include <algorithm>
#include <string>

#include "shaders/interface/bindings.h"

namespace drape {

namespace {

constexpr uint64_t kFirstBatch = 64;
constexpr uint64_t kFirstDispatches = 64;

}  // namespace

Result<std::unique_ptr<DeviceArrays>> DeviceArrays::Create(int64_t max_bytes) {
  Result<MirroredBuffer> cloths = MirroredBuffer::Create("cloths", max_bytes);
  if (!cloths.ok()) return cloths.status();
  Result<DeviceArena> models = DeviceArena::Create("models", max_bytes);
  if (!models.ok()) return models.status();
  Result<DeviceArena> states = DeviceArena::Create("states", max_bytes);
  if (!states.ok()) return states.status();
  Result<MirroredArena> parameters = MirroredArena::Create("parameters", max_bytes);
  if (!parameters.ok()) return parameters.status();
  Result<ScratchPool> scratch = ScratchPool::Create(max_bytes);
  if (!scratch.ok()) return scratch.status();
  // Not make_unique: the constructor is private.
  std::unique_ptr<DeviceArrays> arrays(new DeviceArrays(
      std::move(cloths).value(), std::move(models).value(), std::move(states).value(),
      std::move(parameters).value(), std::move(scratch).value(), max_bytes));
  DRAPE_RETURN_IF_ERROR(arrays->ReserveBatch(kFirstBatch, kFirstDispatches));
  return arrays;
}

Status DeviceArrays::ReserveBuffer(gl::Buffer& buffer, uint64_t size_bytes) const {
  if (buffer.size_bytes() >= size_bytes) return Status::Ok();
  if (size_bytes > static_cast<uint64_t>(max_bytes_)) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "a batch would need a device array of " + std::to_string(size_bytes) +
                      " bytes, the limit is " + std::to_string(max_bytes_));
  }
  Result<gl::Buffer> grown = gl::Buffer::Create(
      std::clamp<uint64_t>(2 * buffer.size_bytes(), size_bytes, static_cast<uint64_t>(max_bytes_)));
  if (!grown.ok()) return grown.status();
  buffer = std::move(grown).value();
  return Status::Ok();
}

Status DeviceArrays::ReserveBatch(uint64_t cloth_count, uint64_t dispatches_of_sweep) {
  // Each cloth may be stepped and measured.
  DRAPE_RETURN_IF_ERROR(ReserveBuffer(items, 2 * cloth_count * sizeof(shader::BatchItem)));
  DRAPE_RETURN_IF_ERROR(ReserveBuffer(statuses, cloth_count * sizeof(shader::ClothStatus)));
  if (read_statuses.size_bytes() < statuses.size_bytes()) {
    Result<gl::ReadbackBuffer> made = gl::ReadbackBuffer::Create(statuses.size_bytes());
    if (!made.ok()) return made.status();
    read_statuses = std::move(made).value();
  }
  return ReserveBuffer(dispatches, dispatches_of_sweep * sizeof(shader::DispatchArgs));
}

void DeviceArrays::BindForStep() const {
  items.BindStorage(DRAPE_BINDING_ITEMS);
  cloths.buffer().BindStorage(DRAPE_BINDING_CLOTHS);
  models.buffer().BindStorage(DRAPE_BINDING_MODELS);
  states.buffer().BindStorage(DRAPE_BINDING_STATES);
  parameters.buffer().BindStorage(DRAPE_BINDING_PARAMETERS);
  statuses.BindStorage(DRAPE_BINDING_STATUSES);
  dispatches.BindStorage(DRAPE_BINDING_DISPATCHES);
}

}  // namespace drape
