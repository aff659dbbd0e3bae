// Particle states as they arrived: typed views into the received bytes. Nothing is copied, except
// that a cloth larger than one chunk is joined from its chunks, and that states of 16-bit numbers
// (v1::StateView.encoding) become float32.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drape/v1/state.pb.h"

namespace drape {
inline namespace client {

// The cloth's name in messages; never reused for another cloth.
using ClothId = uint64_t;

// A list of vectors, [row_count][3], either float32 or float64. Lives as long as the States that it
// came from.
class VectorView {
 public:
  VectorView() = default;
  explicit VectorView(std::span<const float> elements) : floats_(elements) {}
  explicit VectorView(std::span<const double> elements) : doubles_(elements) {}

  // True when the field was not requested, or there are no particles.
  bool empty() const { return floats_.empty() && doubles_.empty(); }
  size_t row_count() const { return (floats_.size() + doubles_.size()) / 3; }
  bool is_float64() const { return !doubles_.empty(); }
  // Row-major elements, 3 * row_count; empty when the array has the other type.
  std::span<const float> floats() const { return floats_; }
  std::span<const double> doubles() const { return doubles_; }
  // Element of either type. row < row_count(), axis 0 to 2 (x, y, z).
  double At(size_t row, size_t axis) const {
    const size_t index = 3 * row + axis;
    return doubles_.empty() ? static_cast<double>(floats_[index]) : doubles_[index];
  }

 private:
  std::span<const float> floats_;
  std::span<const double> doubles_;
};

// One cloth at the end of one step, in the world frame. Views of fields that were not requested are
// empty. Row r is particle r or, if the v1::StateView of the request named particles, the r-th of
// those.
struct ClothState {
  ClothId cloth_id = 0;
  uint64_t step = 0;  // completed steps
  double time_s = 0;
  size_t particle_count = 0;  // rows
  VectorView positions_m;
  VectorView velocities_m_per_s;
  // The reductions that the view asked for (v1::StateView.reductions).
  std::optional<double> coverage_m2;
  std::optional<std::array<double, 3>> centroid_m;
  std::optional<std::array<double, 6>> box_m;  // lowest and highest corner
  std::optional<double> target_distance_m;
};

// The states of several cloths and the bytes that hold them. Moving keeps the views valid.
// Thread-safe for reading.
class States {
 public:
  States() = default;
  // Throws Error (kInternal) when counts, shapes and bytes of a chunk do not belong together.
  explicit States(std::vector<v1::StateChunk> chunks);
  States(States&&) noexcept = default;
  States& operator=(States&&) noexcept = default;
  States(const States&) = delete;
  States& operator=(const States&) = delete;

  size_t size() const { return cloths_.size(); }
  bool empty() const { return cloths_.empty(); }
  // In the order of the request; in order of creation when it named no cloths.
  const ClothState& operator[](size_t index) const { return cloths_[index]; }
  auto begin() const { return cloths_.begin(); }
  auto end() const { return cloths_.end(); }

  // Streams only: number of the frame from 1, and how many due frames were left out before it.
  uint64_t frame() const { return frame_; }
  uint64_t frames_dropped() const { return frames_dropped_; }

 private:
  void AddChunk(const v1::StateChunk& chunk);

  std::vector<v1::StateChunk> chunks_;
  std::vector<ClothState> cloths_;
  uint64_t frame_ = 0;
  uint64_t frames_dropped_ = 0;
};

}  // namespace client
}  // namespace drape
