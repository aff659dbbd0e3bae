// A renderer without graphics that records its calls, and pictures to request.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/render/render_thread.h"

namespace drape::render {

// The script of the fake renderers and the record of their calls. Outlives them; thread-safe.
class FakeStudio {
 public:
  // The next `count` attempts to make a renderer fail.
  void FailNextMakes(int count) {
    const std::lock_guard lock(mutex_);
    makes_to_fail_ = count;
  }
  void FailNextDraw(Status status) {
    const std::lock_guard lock(mutex_);
    next_draw_ = std::move(status);
  }
  // Draw waits from now on, until Release.
  void Hold() {
    const std::lock_guard lock(mutex_);
    is_held_ = true;
  }
  void Release() {
    const std::lock_guard lock(mutex_);
    is_held_ = false;
    changed_.notify_all();
  }
  // Until a Draw waits.
  void WaitForHeldDraw() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_drawing_; });
  }
  int makes() const {
    const std::lock_guard lock(mutex_);
    return makes_;
  }
  int alive() const {
    const std::lock_guard lock(mutex_);
    return alive_;
  }
  // Widths of the pictures in the order in which they were drawn; tests identify pictures by width.
  std::vector<uint32_t> drawn() const {
    const std::lock_guard lock(mutex_);
    return drawn_;
  }
  // Calls on another thread than the one that made the renderer.
  int calls_on_wrong_thread() const {
    const std::lock_guard lock(mutex_);
    return calls_on_wrong_thread_;
  }
  RendererFactory Factory();

 private:
  friend class FakeRenderer;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  int makes_ = 0;
  int makes_to_fail_ = 0;
  int alive_ = 0;
  int calls_on_wrong_thread_ = 0;
  bool is_held_ = false;
  bool is_drawing_ = false;
  std::optional<Status> next_draw_;
  std::vector<uint32_t> drawn_;
};

class FakeRenderer final : public Renderer {
 public:
  explicit FakeRenderer(FakeStudio& studio) : studio_(studio) {
    const std::lock_guard lock(studio_.mutex_);
    ++studio_.alive_;
  }
  ~FakeRenderer() override {
    const std::lock_guard lock(studio_.mutex_);
    --studio_.alive_;
    CheckThread();
  }
  std::string device() const override { return "fake"; }
  bool takes_device_copies() const override { return true; }

  // Black.
  Result<Picture> Draw(const PictureSpec& spec, std::span<const DrawnCloth>,
                       const DrawnStates&) override {
    std::unique_lock lock(studio_.mutex_);
    CheckThread();
    studio_.is_drawing_ = true;
    studio_.changed_.notify_all();
    studio_.changed_.wait(lock, [this] { return !studio_.is_held_; });
    studio_.is_drawing_ = false;
    if (studio_.next_draw_.has_value()) return *std::exchange(studio_.next_draw_, std::nullopt);
    studio_.drawn_.push_back(spec.width_px);
    Picture picture;
    picture.width_px = spec.width_px;
    picture.height_px = spec.height_px;
    picture.rgb.resize(size_t{3} * spec.width_px * spec.height_px);
    return picture;
  }

 private:
  void CheckThread() { studio_.calls_on_wrong_thread_ += std::this_thread::get_id() != thread_; }

  FakeStudio& studio_;
  const std::thread::id thread_ = std::this_thread::get_id();
};

inline RendererFactory FakeStudio::Factory() {
  return [this]() -> Result<std::unique_ptr<Renderer>> {
    {
      const std::lock_guard lock(mutex_);
      ++makes_;
      if (makes_to_fail_ > 0) {
        --makes_to_fail_;
        return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE", "install libegl1");
      }
    }
    return std::unique_ptr<Renderer>(std::make_unique<FakeRenderer>(*this));
  };
}

// A place for the outcome of a picture. Copies share it.
class Outcome {
 public:
  void Set(Result<DrawnPicture> picture) const {
    const std::lock_guard lock(shared_->mutex);
    shared_->count += 1;
    shared_->picture.emplace(std::move(picture));
    shared_->changed.notify_all();
  }
  bool has_value() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->picture.has_value();
  }
  // Waits.
  const Result<DrawnPicture>& Get() const {
    std::unique_lock lock(shared_->mutex);
    shared_->changed.wait(lock, [this] { return shared_->picture.has_value(); });
    return *shared_->picture;
  }
  std::string Reason() const { return Get().status().reason(); }
  // As a client does once it has the file.
  void Drop() const {
    (void)Get();
    const std::lock_guard lock(shared_->mutex);
    shared_->picture.emplace(Status(StatusCode::kCancelled, "DROPPED", "by the test"));
  }
  int count() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->count;
  }

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<DrawnPicture>> picture;
    int count = 0;
  };
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
};

// A picture that can be drawn at once, with a width to know it by.
inline PictureJob Job(const std::string& session, uint32_t width_px, const Outcome& outcome) {
  PictureJob job;
  job.session = session;
  job.spec.width_px = width_px;
  job.spec.height_px = 16;
  job.particle_count = 10;
  job.fetch = [](bool, const ContentReady& ready) { ready(PictureContent{}); };
  job.is_cancelled = [] { return false; };
  job.done = [outcome](Result<DrawnPicture> picture) { outcome.Set(std::move(picture)); };
  return job;
}

}  // namespace drape::render
