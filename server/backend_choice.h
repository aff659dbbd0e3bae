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

// The backend of the configuration. Device thread. `context` becomes that of the gl backend; with
// the others it stays unset.
Result<std::unique_ptr<Backend>> MakeBackend(const Config& config,
                                             std::optional<gl::ShareHandle>& context);

// Draws with the device of the gl backend while that lives, else with the first that works,
// hardware before software. Render thread.
Result<std::unique_ptr<render::Renderer>> MakeRenderer(
    const Config& config, const std::optional<gl::ShareHandle>& context);

}  // namespace drape
