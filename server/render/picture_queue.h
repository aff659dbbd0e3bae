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

// What a picture is drawn from. Goes on the render thread, or on the thread that delivers it.
struct PictureContent {
  std::vector<DrawnCloth> cloths;
  DrawnStates states;
  std::vector<uint64_t> steps;      // [cloth] completed at that moment
  std::shared_ptr<void> in_flight;  // kept as long as the states: their place among the reads
};
using ContentReady = std::function<void(Result<PictureContent>)>;

// A picture as a file.
struct DrawnPicture {
  std::string png;
  Camera camera;                 // that was used
  Eigen::AlignedBox3d bounds_m;  // as Picture::bounds_m
  ValueRange range;              // as Picture::range
  std::string device;            // that drew it
  std::vector<uint64_t> steps;   // as PictureContent::steps
  // Keep it until the file has left: it is the tenant's place among its pictures.
  std::shared_ptr<void> in_flight;
};

// One picture that was asked for.
struct PictureJob {
  std::string tenant;  // key of the fair share: the session's name
  PictureSpec spec;
  uint64_t particle_count = 0;  // of all its cloths
  // Gets the content when the picture's turn has come. Render thread; must not block. Calls `ready`
  // exactly once, on any thread, possibly at once. `on_device`: a copy on the device will do.
  std::function<void(bool on_device, ContentReady ready)> fetch;
  // Any thread.
  std::function<bool()> is_cancelled;
  // Exactly once. Must not block.
  std::function<void(Result<DrawnPicture>)> done;
  std::shared_ptr<void> place;  // filled in by RenderThread
};

// Tenants take turns; the pictures of one are in order.
class PictureQueue {
 public:
  void Push(PictureJob job);
  // Before all others, whose turn it had been already.
  void Return(PictureJob job) { returned_.push_back(std::move(job)); }
  bool empty() const { return size() == 0; }
  size_t size() const;
  // The next in turn; not of an empty queue.
  const PictureJob& Next() const;
  PictureJob Pop();
  std::vector<PictureJob> TakeCancelled();
  std::vector<PictureJob> TakeAll();

 private:
  struct Tenant {
    std::string name;
    std::deque<PictureJob> jobs;  // at least one
  };
  std::deque<PictureJob> returned_;
  std::list<Tenant> tenants_;  // in order of their turns
};

}  // namespace drape::render
