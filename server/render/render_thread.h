// The one thread that draws pictures, and the queue in front of it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "server/core/status.h"
#include "server/render/picture_queue.h"
#include "server/render/renderer.h"

namespace drape::render {

struct RenderLimits {
  // Pictures of one tenant that wait, are drawn, or whose files have not left (DrawnPicture::
  // in_flight), and pictures of all that wait.
  uint32_t max_pictures_in_flight_per_tenant = 4;
  uint32_t max_queued_pictures = 128;
  // Of one picture, and of all whose states are read or drawn at a time: 12 bytes each, 24 where
  // velocities are shown, on the device or on the host.
  uint32_t max_particles_per_picture = 1u << 24;
  // Of one picture.
  uint32_t max_colliders_per_picture = 1u << 16;
  // Suggested to clients that were refused for want of a place [ms].
  int64_t retry_after_ms = 200;
};

// RESOURCE_EXHAUSTED (PICTURE_TOO_LARGE), naming the limit.
Status PictureTooLarge(const std::string& limit, uint64_t value, uint64_t maximum);

// Runs on the render thread.
using RendererFactory = std::function<Result<std::unique_ptr<Renderer>>()>;

// Owns the renderer, which is made for the first picture, made again for the next one after it was
// lost or could not be made, and used and destroyed on the render thread. Thread-safe.
//
// While one picture is drawn the content of the next ones is fetched, for
// max_particles_per_picture in all. A content that is delivered when nobody waits for it any more
// goes on the thread that delivers it.
class RenderThread {
 public:
  RenderThread(RendererFactory factory, const RenderLimits& limits);
  // Stop.
  ~RenderThread();
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  const RenderLimits& limits() const;

  // An error means that the job is dropped and `done` will not be called: RESOURCE_EXHAUSTED
  // (TOO_MANY_PICTURES, with retry_after, or PICTURE_TOO_LARGE), UNAVAILABLE (DRAINING). Else
  // `done` gets, mostly on the render thread: the picture; the error of `fetch` or of the renderer;
  // FAILED_PRECONDITION with the reason of the factory, such as NO_EGL_DEVICE; UNAVAILABLE
  // (RENDERER_LOST, with retry_after, or DRAINING); CANCELLED.
  Status Submit(PictureJob job);

  // Draws to its end what is being drawn, ends the rest with UNAVAILABLE (DRAINING), destroys the
  // renderer. Not on the render thread. A second call does nothing more.
  void Stop();

 private:
  class Core;
  const std::shared_ptr<Core> core_;  // contents may be delivered later than this goes
  std::thread thread_;
};

}  // namespace drape::render
