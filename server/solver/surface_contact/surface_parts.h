// The edges and triangles of a model whose insides may touch colliders.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/made_per_model.h"
#include "server/scene/scene_model.h"

namespace drape {

// Constant after construction; safe to share between threads.
class SurfaceParts {
 public:
  // `interruption`: asked now and then; null: nobody is.
  explicit SurfaceParts(const SceneModel& model, Interruption* interruption = nullptr);

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

using SurfacePartsCache = MadePerModel<SurfaceParts>;

}  // namespace drape
