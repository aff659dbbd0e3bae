// Chooses the backend that steps the cloths, and the renderer.
#pragma once

#include <memory>
#include <optional>

#include "server/config.h"
#include "server/core/status.h"
#include "server/gl/context.h"
#include "server/render/renderer.h"
#include "server/solver/backend.h"

namespace drape {

// Prints the GPUs, one per line; the exit status: 1 if there is none.
int PrintDevices();

// Until the GPU that the configuration names is there, after it was lost: a driver may need a
// while, and nobody who was on a GPU is to find himself on cores. UNAVAILABLE after 30 s. Blocks,
// and makes contexts on the calling thread.
Status AwaitGpu(const Config& config);

// The backend of the configuration. Device thread. `context` becomes that of the gl backend; with
// the others it stays unset.
Result<std::unique_ptr<Backend>> MakeBackend(const Config& config,
                                             std::optional<gl::ShareHandle>& context);

// Draws with the device of the gl backend while that lives, else with the first that works,
// hardware before software. Render thread.
Result<std::unique_ptr<render::Renderer>> MakeRenderer(
    const Config& config, const std::optional<gl::ShareHandle>& context);

}  // namespace drape
