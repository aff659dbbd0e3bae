// Pictures that wait to be drawn. No threads, no locks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "server/core/status.h"
#include "server/render/picture_spec.h"
#include "server/render/renderer.h"

namespace drape::render {

// The content of a picture. Destroyed on the render thread or on the thread that delivers it.
struct PictureContent {
  std::vector<DrawnCloth> cloths;
  DrawnStates states;
  std::vector<uint64_t> steps;      // [cloth] completed at that moment
  std::shared_ptr<void> in_flight;  // the permit of the read, kept as long as the states
};
using ContentReady = std::function<void(Result<PictureContent>)>;

// A picture as a file, or as its pixels.
struct DrawnPicture {
  std::string png;
  std::string rgb;               // as Picture::rgb, if PictureSpec::is_raw
  std::vector<float> depths_m;   // as Picture::depths_m
  Camera camera;                 // as Picture::camera
  Eigen::AlignedBox3d bounds_m;  // as Picture::bounds_m
  ValueRange range;              // as Picture::range
  std::string device;            // the device that drew it
  std::vector<uint64_t> steps;   // as PictureContent::steps
  // The permit of the picture. Keep it until the file has been sent.
  std::shared_ptr<void> in_flight;
};

// A picture that was requested.
struct PictureJob {
  std::string session;   // the session's name: those of a tenant take turns
  std::string tenant{};  // of the session: tenants take turns, and sessions without one
  PictureSpec spec;
  uint64_t particle_count = 0;  // of all its cloths
  // Gets the content when the picture's turn has come. Render thread; must not block. Calls `ready`
  // exactly once, on any thread, possibly at once. `on_device`: a copy on the device is accepted.
  std::function<void(bool on_device, ContentReady ready)> fetch;
  // Any thread.
  std::function<bool()> is_cancelled;
  // Exactly once. Must not block.
  std::function<void(Result<DrawnPicture>)> done;
  std::shared_ptr<void> permit;  // filled in by RenderThread
};

// Owners (tenants, or sessions without one) take turns, and the sessions of a tenant its turns; the
// pictures of one session are in order.
class PictureQueue {
 public:
  void Push(PictureJob job);
  // Puts a picture whose turn it was already before all others.
  void Return(PictureJob job) { returned_.push_back(std::move(job)); }
  bool empty() const { return size() == 0; }
  size_t size() const;
  // Of the owner, without those that were returned.
  size_t size_of(const std::string& session, const std::string& tenant) const;
  // The next in turn; not of an empty queue.
  const PictureJob& Next() const;
  PictureJob Pop();
  std::vector<PictureJob> TakeCancelled();
  std::vector<PictureJob> TakeAll();

 private:
  struct SessionJobs {
    std::string session;
    std::deque<PictureJob> jobs;  // at least one
  };
  struct OwnerJobs {
    std::string owner;
    std::list<SessionJobs> sessions;  // at least one, in order of their turns
  };
  std::deque<PictureJob> returned_;
  std::list<OwnerJobs> owners_;  // in order of their turns
};

}  // namespace drape::render
