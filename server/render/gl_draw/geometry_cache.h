// Scene models on the device, for drawing.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/render/gl_draw/model_geometry.h"

namespace drape::render {

struct DeviceGeometry {
  GeometryLayout layout;
  uint32_t index_count = 0;    // 0: a cloth without a surface
  double rest_diagonal_m = 0;  // of the box around the rest shape
  double mean_length_m = 0;    // of its constraints
  gl::Buffer indices;
  gl::Buffer surface;
  gl::Buffer constraints;

  int64_t size_bytes() const {
    return static_cast<int64_t>(indices.size_bytes() + surface.size_bytes() +
                                constraints.size_bytes());
  }
};

// Keeps the most recently drawn geometry, up to a size, while its model exists. The context must be
// current in every call.
class GeometryCache {
 public:
  // `max_block_bytes`: limit of one array on the device.
  GeometryCache(int64_t max_bytes, int64_t max_block_bytes)
      : max_bytes_(max_bytes), max_block_bytes_(max_block_bytes) {}

  // RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::shared_ptr<const DeviceGeometry>> Acquire(
      const std::shared_ptr<const SceneModel>& model);

  // Frees the geometry of models that have ended: a look at all, so once for each picture.
  void DropEndedModels();

  int64_t size_bytes() const { return size_bytes_; }

 private:
  struct Entry {
    const SceneModel* address = nullptr;  // where another model may be once this one has ended
    std::weak_ptr<const SceneModel> model;
    std::shared_ptr<const DeviceGeometry> geometry;
  };
  Result<std::shared_ptr<const DeviceGeometry>> Upload(const SceneModel& model) const;
  void Drop(std::list<Entry>::iterator entry);

  int64_t max_bytes_;
  int64_t max_block_bytes_;
  int64_t size_bytes_ = 0;
  std::list<Entry> entries_;  // most recently used first
  std::unordered_map<const SceneModel*, std::list<Entry>::iterator> places_;  // by address
};

}  // namespace drape::render
