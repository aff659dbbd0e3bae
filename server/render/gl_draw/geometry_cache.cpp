#include "server/render/gl_draw/geometry_cache.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <span>
#include <string>
#include <utility>

namespace drape::render {

namespace {

// OpenGL has no empty buffers: one word stands for an empty array.
Result<gl::Buffer> UploadWords(std::span<const uint32_t> words, int64_t max_bytes) {
  if (static_cast<int64_t>(words.size_bytes()) > max_bytes) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "a cloth needs " + std::to_string(words.size_bytes()) +
                      " bytes in one array to be drawn; the device allows " +
                      std::to_string(max_bytes));
  }
  Result<gl::Buffer> buffer = gl::Buffer::Create(std::max(words.size_bytes(), sizeof(uint32_t)));
  if (buffer.ok()) buffer->Upload(0, std::as_bytes(words));
  return buffer;
}

}  // namespace

Result<std::shared_ptr<const DeviceGeometry>> GeometryCache::Acquire(
    const std::shared_ptr<const SceneModel>& model) {
  if (const auto known = places_.find(model.get()); known != places_.end()) {
    const auto entry = known->second;
    if (!entry->model.expired()) {
      entries_.splice(entries_.begin(), entries_, entry);
      return entry->geometry;
    }
    Drop(entry);
  }
  Result<std::shared_ptr<const DeviceGeometry>> geometry = Upload(*model);
  if (!geometry.ok()) return geometry;
  size_bytes_ += (*geometry)->size_bytes();
  entries_.push_front({model.get(), model, *geometry});
  places_[model.get()] = entries_.begin();
  // The newest entry stays even if it alone is too large: it is about to be drawn.
  while (size_bytes_ > max_bytes_ && entries_.size() > 1) Drop(std::prev(entries_.end()));
  return geometry;
}

Result<std::shared_ptr<const DeviceGeometry>> GeometryCache::Upload(const SceneModel& model) const {
  const ModelGeometry words = BuildGeometry(model);
  DRAPE_ASSIGN_OR_RETURN(gl::Buffer indices, UploadWords(words.indices, max_block_bytes_));
  DRAPE_ASSIGN_OR_RETURN(gl::Buffer surface, UploadWords(words.surface, max_block_bytes_));
  DRAPE_ASSIGN_OR_RETURN(gl::Buffer constraints, UploadWords(words.constraints, max_block_bytes_));
  Eigen::AlignedBox3d rest_box;
  for (const Eigen::Vector3d& position : model.rest_positions_m()) rest_box.extend(position);
  return std::make_shared<const DeviceGeometry>(
      DeviceGeometry{.layout = words.layout,
                     .index_count = static_cast<uint32_t>(words.indices.size()),
                     .rest_diagonal_m = rest_box.diagonal().norm(),
                     .mean_length_m = model.length_scale_m(),
                     .indices = std::move(indices),
                     .surface = std::move(surface),
                     .constraints = std::move(constraints)});
}

void GeometryCache::DropEndedModels() {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const auto next = std::next(entry);
    if (entry->model.expired()) Drop(entry);
    entry = next;
  }
}

void GeometryCache::Drop(std::list<Entry>::iterator entry) {
  size_bytes_ -= entry->geometry->size_bytes();
  places_.erase(entry->address);
  entries_.erase(entry);
}

}  // namespace drape::render
