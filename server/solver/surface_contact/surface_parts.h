// The edges and triangles of a model whose insides may touch colliders.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/scene/scene_model.h"

namespace drape {

// Constant after construction; safe to share between threads.
class SurfaceParts {
 public:
  explicit SurfaceParts(const SceneModel& model);

  // Those of the drawn triangles, ascending; of a model without triangles its links. Ropes are not
  // among these: a slack one is not where the line between its ends is.
  std::span<const std::array<uint32_t, 2>> edges() const { return edges_; }
  std::span<const std::array<uint32_t, 3>> triangles() const { return triangles_; }
  // The longest edge at rest [m].
  double longest_m() const { return longest_m_; }

 private:
  std::vector<std::array<uint32_t, 2>> edges_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  double longest_m_ = 0;
};

// One SurfaceParts per model, for as long as somebody uses it. One thread.
class SurfacePartsCache {
 public:
  std::shared_ptr<const SurfaceParts> Get(const std::shared_ptr<const SceneModel>& model);

 private:
  struct Entry {
    std::weak_ptr<const SceneModel> model;
    std::weak_ptr<const SurfaceParts> parts;
  };
  std::unordered_map<const SceneModel*, Entry> entries_;
};

}  // namespace drape
