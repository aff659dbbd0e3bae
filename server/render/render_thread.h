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
  // Pictures per session that wait, are being drawn, or whose files have not been sent
  // (DrawnPicture::in_flight), and waiting pictures of all sessions.
  uint32_t max_pictures_in_flight_per_session = 4;
  uint32_t max_queued_pictures = 128;
  // Limit of one picture, and of all pictures whose states are read or drawn at a time: 12 bytes
  // each, 24 with velocities, on the device or on the host.
  uint32_t max_particles_per_picture = 1u << 24;
  // Limit of one picture.
  uint32_t max_colliders_per_picture = 1u << 16;
  // Suggested to clients that were refused because of a limit [ms].
  int64_t retry_after_ms = 200;
};

// RESOURCE_EXHAUSTED (PICTURE_TOO_LARGE), naming the limit.
Status PictureTooLarge(const std::string& limit, uint64_t value, uint64_t maximum);

// Runs on the render thread.
using RendererFactory = std::function<Result<std::unique_ptr<Renderer>>()>;

// Owns the renderer. It is made for the first picture, and again for the next one if it was lost or
// could not be made; it is used and destroyed on the render thread. Thread-safe.
//
// While one picture is drawn, the content of the next ones is fetched, max_particles_per_picture in
// all. Content that arrives after its picture was cancelled is destroyed on the delivering thread.
class RenderThread {
 public:
  RenderThread(RendererFactory factory, const RenderLimits& limits);
  // Stop.
  ~RenderThread();
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  const RenderLimits& limits() const;

  // An error means that the job is dropped and `done` will not be called: RESOURCE_EXHAUSTED
  // (TOO_MANY_PICTURES, with retry_after, or PICTURE_TOO_LARGE), UNAVAILABLE (DRAINING). Otherwise
  // `done` gets, mostly on the render thread: the picture; the error of `fetch` or of the renderer;
  // FAILED_PRECONDITION with the reason of the factory, such as NO_EGL_DEVICE; UNAVAILABLE
  // (RENDERER_LOST, with retry_after, or DRAINING); CANCELLED.
  Status Submit(PictureJob job);

  // Finishes the picture that is being drawn, ends the rest with UNAVAILABLE (DRAINING), destroys
  // the renderer. Not on the render thread. A second call does nothing.
  void Stop();

 private:
  class Core;
  const std::shared_ptr<Core> core_;  // content may still be delivered after the destructor
  std::thread thread_;
};

}  // namespace drape::render
