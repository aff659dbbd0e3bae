// The renderer of pictures, as the rest of the server sees it.
#pragma once

#include <memory>
#include <span>

#include "server/core/status.h"
#include "server/render/picture_spec.h"
#include "server/solver/device_backend.h"

namespace drape::render {

// The states to draw, cloth after cloth. Exactly one of the two is set; velocities only for
// Colouring::kSpeed. With kContact, on the host alone, vectors as long as its values [N] are in
// their place.
struct DrawnStates {
  StateColumns host;                   // from Backend::Read
  std::shared_ptr<DeviceCopy> device;  // from DeviceBackend::CopyOnDevice
  // The row of the first particle that is drawn, and the rows of each column; 0: those of the drawn
  // cloths.
  uint32_t first_row = 0;
  uint32_t row_total = 0;
};

// Error reason after which the renderer cannot be used any more.
inline constexpr char kRendererLost[] = "RENDERER_LOST";

// Owns a graphics context. Every call, construction and destruction included, is made on one
// thread, which must also drop the DrawnStates that it passed.
class Renderer {
 public:
  virtual ~Renderer() = default;

  // "llvmpipe (LLVM 15.0.6)"
  virtual std::string device() const = 0;

  // Whether DrawnStates::device may be used: the graphics context shares the backend's device
  // memory. False: the states must come from Backend::Read.
  virtual bool takes_device_copies() const = 0;

  // The states of `cloths`, in their order. Where the spec is tiled, a page of tiles: each cloth
  // alone, with the camera in its environment, one below the other. The spec is already validated:
  // violations are programmer errors. RESOURCE_EXHAUSTED (DEVICE_MEMORY) if there is no room for
  // the picture or the cloths; UNAVAILABLE (RENDERER_LOST) after the device was reset: this
  // renderer cannot be used any more.
  virtual Result<Picture> Draw(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                               const DrawnStates& states) = 0;
};

}  // namespace drape::render
