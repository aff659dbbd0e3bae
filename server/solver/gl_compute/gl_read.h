// States of the OpenGL backend on their way to the host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/device_loss.h"
#include "server/gl/context.h"
#include "server/solver/device_backend.h"
#include "server/solver/gl_compute/state_reader.h"

namespace drape {

// How the rows of these particles (strictly ascending; empty: all) are read. A few runs are
// gathered on the device. Many runs would be as many pieces of work there, so whole columns come
// and the host picks the rows.
class RowPlan {
 public:
  static constexpr size_t kMaxRuns = 16;

  explicit RowPlan(std::span<const uint32_t> particles)
      : runs_(RunsOf(particles)), row_count_(particles.size()) {
    if (runs_.size() <= kMaxRuns) return;
    runs_.clear();
    picked_.assign(particles.begin(), particles.end());
  }
  // Adds the next cloth. Returns how many words of each of its columns come.
  size_t AddCloth(uint32_t particle_count) {
    if (!picked_.empty()) particle_counts_.push_back(particle_count);
    return 3 * (runs_.empty() ? size_t{particle_count} : row_count_);
  }
  // To gather on the device; none: whole columns.
  std::span<const ColumnRun> runs() const { return runs_; }
  // The requested rows of a column of all cloths that has arrived.
  std::vector<float> Pick(std::vector<float> column) const {
    if (picked_.empty() || column.empty()) return column;
    std::vector<float> rows;
    rows.reserve(3 * picked_.size() * particle_counts_.size());
    const float* cloth = column.data();
    for (const uint32_t particle_count : particle_counts_) {
      for (const uint32_t particle : picked_) {
        const float* const row = cloth + 3 * size_t{particle};
        rows.insert(rows.end(), row, row + 3);
      }
      cloth += 3 * size_t{particle_count};
    }
    return rows;
  }

 private:
  std::vector<ColumnRun> runs_;
  size_t row_count_;                       // of each cloth, if runs are gathered
  std::vector<uint32_t> picked_;           // empty: none on the host
  std::vector<uint32_t> particle_counts_;  // of each cloth; only then
};

// Takes a transfer of all positions, then all velocities.
class GlRead final : public PendingRead {
 public:
  GlRead(gl::Context& context, StateTransfer transfer, RowPlan plan, size_t position_words,
         size_t velocity_words)
      : context_(context),
        transfer_(std::move(transfer)),
        plan_(std::move(plan)),
        position_words_(position_words),
        velocity_words_(velocity_words) {}

  ~GlRead() override { context_.MakeCurrent(); }
  GlRead(const GlRead&) = delete;
  GlRead& operator=(const GlRead&) = delete;

  StateColumns Take() override {
    context_.MakeCurrent();
    std::vector<float> positions(position_words_), velocities(velocity_words_);
    transfer_.Take({positions, velocities});
    // A device that was reset signals its fences too: the buffer may hold an older read.
    const std::string reset_reason = context_.ResetReason();
    if (!reset_reason.empty()) LoseDevice(reset_reason);
    return {plan_.Pick(std::move(positions)), plan_.Pick(std::move(velocities))};
  }

 private:
  gl::Context& context_;
  StateTransfer transfer_;
  const RowPlan plan_;
  const size_t position_words_, velocity_words_;
};

}  // namespace drape
