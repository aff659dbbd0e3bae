// States of the OpenGL backend on their way to the host.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "server/gl/context.h"
#include "server/solver/backend.h"
#include "server/solver/gl_compute/state_reader.h"

namespace drape {

// Of a transfer of all positions, then all velocities.
class GlRead final : public PendingRead {
 public:
  GlRead(gl::Context& context, StateTransfer transfer, size_t position_words, size_t velocity_words)
      : context_(context),
        transfer_(std::move(transfer)),
        position_words_(position_words),
        velocity_words_(velocity_words) {}

  ~GlRead() override { context_.MakeCurrent(); }
  GlRead(const GlRead&) = delete;
  GlRead& operator=(const GlRead&) = delete;

  StateColumns Take() override {
    context_.MakeCurrent();
    std::vector<float> positions(position_words_), velocities(velocity_words_);
    transfer_.Take({positions, velocities});
    // A device that was reset signals its fences too: what is there may be an older read.
    const std::string reset_reason = context_.ResetReason();
    DRAPE_CHECK(reset_reason.empty(), reset_reason);
    return {std::move(positions), std::move(velocities)};
  }

 private:
  gl::Context& context_;
  StateTransfer transfer_;
  const size_t position_words_, velocity_words_;
};

}  // namespace drape
