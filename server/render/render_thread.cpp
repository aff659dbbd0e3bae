#include "server/render/render_thread.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "server/core/memory_reserve.h"
#include "server/core/session_permits.h"
#include "server/core/trace.h"
#include "server/render/png.h"
#include "server/render/tiles.h"

namespace drape::render {
namespace {

// Limit on the pictures whose content is being fetched or waits to be drawn. Enough to hide the
// wait for the device thread; few enough to keep the states fresh.
constexpr size_t kMaxFetched = 4;

constexpr char kTooMany[] = "TOO_MANY_PICTURES";

Status Draining() {
  return {StatusCode::kUnavailable, "DRAINING", "the server is shutting down"};
}

Status Cancelled() {
  return {StatusCode::kCancelled, "CANCELLED", "the client cancelled the request"};
}

// Frees the permit before the client gets its answer.
void End(PictureJob job, Result<DrawnPicture> picture) {
  job.permit.reset();
  job.done(std::move(picture));
}

}  // namespace

Status PictureTooLarge(const std::string& limit, uint64_t value, uint64_t maximum) {
  return {StatusCode::kResourceExhausted, "PICTURE_TOO_LARGE",
          limit + " is " + std::to_string(maximum) + ": " + std::to_string(value) +
              " wanted; name fewer cloths"};
}

class RenderThread::Core : public std::enable_shared_from_this<Core> {
 public:
  Core(RendererFactory factory, const RenderLimits& limits)
      : factory_(std::move(factory)),
        limits_(limits),
        permits_(kTooMany,
                 {"max_pictures_in_flight_per_session", limits.max_pictures_in_flight_per_session},
                 PermitLimit{"twice max_queued_pictures", 2 * limits.max_queued_pictures},
                 limits.retry_after_ms) {}

  const RenderLimits& limits() const { return limits_; }
  Status Submit(PictureJob job);
  void RequestStop();
  // The body of the render thread.
  void Loop();

 private:
  // A picture whose turn has come. Used by the render thread, except when the content arrives.
  struct Fetch {
    PictureJob job;
    std::optional<Result<PictureContent>> content;  // set under mutex_
  };
  using FetchPointer = std::shared_ptr<Fetch>;

  bool MayFetch() const;            // mutex_ held
  FetchPointer FirstReady() const;  // or null; mutex_ held
  // Any thread.
  void Deliver(const FetchPointer& fetch, Result<PictureContent> content);

  // Render thread.
  Status MakeRenderer();
  void StartFetch(PictureJob job);
  Result<DrawnPicture> DrawAndEncode(const PictureJob& job, Result<PictureContent>& content);
  void Finish(const FetchPointer& fetch);
  // Pictures under way wait again, for a new renderer.
  void LoseRenderer();
  void EndAll();

  const RendererFactory factory_;
  const RenderLimits limits_;
  SessionPermits permits_;
  std::unique_ptr<Renderer> renderer_;  // render thread; null until it is needed

  std::mutex mutex_;
  std::condition_variable wake_;
  PictureQueue queue_;
  std::list<FetchPointer> fetches_;  // in order of their turns; at most kMaxFetched
  uint64_t particles_under_way_ = 0;
  bool is_stopping_ = false;
};

Status RenderThread::Core::Submit(PictureJob job) {
  if (job.particle_count > limits_.max_particles_per_picture) {
    return PictureTooLarge("max_particles_per_picture", job.particle_count,
                           limits_.max_particles_per_picture);
  }
  std::vector<PictureJob> cancelled;
  {
    const std::lock_guard lock(mutex_);
    if (is_stopping_) return Draining();
    cancelled = queue_.TakeCancelled();
  }
  for (PictureJob& gone : cancelled) End(std::move(gone), Cancelled());
  DRAPE_ASSIGN_OR_RETURN(job.permit, permits_.Take(job.session, job.tenant));
  const std::lock_guard lock(mutex_);
  if (is_stopping_) return Draining();
  const size_t waiting = queue_.size();
  const size_t free =
      limits_.max_queued_pictures - std::min<size_t>(limits_.max_queued_pictures, waiting);
  // An owner has at most as many places as it leaves free (SessionPermits).
  if (queue_.size_of(job.session, job.tenant) >= free) {
    Status status(StatusCode::kResourceExhausted, kTooMany,
                  "the queue is full: max_queued_pictures is " +
                      std::to_string(limits_.max_queued_pictures) + ", " + std::to_string(waiting) +
                      " wait, and an owner has at most as many places as it leaves free");
    return status.RetryAfterMs(limits_.retry_after_ms);
  }
  queue_.Push(std::move(job));
  wake_.notify_one();
  return Status::Ok();
}

void RenderThread::Core::RequestStop() {
  const std::lock_guard lock(mutex_);
  is_stopping_ = true;
  wake_.notify_one();
}

bool RenderThread::Core::MayFetch() const {
  if (queue_.empty() || fetches_.size() >= kMaxFetched) return false;
  const uint64_t particles = particles_under_way_ + queue_.Next().particle_count;
  return fetches_.empty() || particles <= limits_.max_particles_per_picture;
}

RenderThread::Core::FetchPointer RenderThread::Core::FirstReady() const {
  const auto ready = std::find_if(fetches_.begin(), fetches_.end(),
                                  [](const auto& fetch) { return fetch->content.has_value(); });
  return ready == fetches_.end() ? nullptr : *ready;
}

void RenderThread::Core::Deliver(const FetchPointer& fetch, Result<PictureContent> content) {
  const std::lock_guard lock(mutex_);
  const bool is_waited_for = std::find(fetches_.begin(), fetches_.end(), fetch) != fetches_.end();
  if (!is_waited_for) return;  // destroys the content on this thread
  fetch->content.emplace(std::move(content));
  wake_.notify_one();
}

void RenderThread::Core::Loop() {
  trace::NameThread("render");
  for (;;) {
    std::optional<PictureJob> next;
    FetchPointer ready;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return is_stopping_ || MayFetch() || FirstReady() != nullptr; });
      if (is_stopping_) break;
      // Fetching comes first: the device thread does it while a picture is drawn.
      if (MayFetch()) {
        next = queue_.Pop();
      } else {
        ready = FirstReady();
      }
    }
    if (next.has_value()) {
      StartFetch(std::move(*next));
    } else {
      Finish(ready);
    }
  }
  EndAll();
}

Status RenderThread::Core::MakeRenderer() {
  if (renderer_ != nullptr) return Status::Ok();
  Result<std::unique_ptr<Renderer>> made = factory_();
  if (!made.ok()) {
    return {StatusCode::kFailedPrecondition, made.status().reason(),
            "this server cannot draw pictures: " + made.status().message()};
  }
  renderer_ = std::move(*made);
  spdlog::info("renderer_started device=\"{}\"", renderer_->device());
  return Status::Ok();
}

void RenderThread::Core::StartFetch(PictureJob job) {
  if (job.is_cancelled()) return End(std::move(job), Cancelled());
  const Status status = MakeRenderer();
  if (!status.ok()) return End(std::move(job), status);
  const auto fetch = std::make_shared<Fetch>();
  fetch->job = std::move(job);
  {
    const std::lock_guard lock(mutex_);
    fetches_.push_back(fetch);
    particles_under_way_ += fetch->job.particle_count;
  }
  fetch->job.fetch(renderer_->takes_device_copies(),
                   [core = shared_from_this(), fetch](Result<PictureContent> content) {
                     core->Deliver(fetch, std::move(content));
                   });
}

Result<DrawnPicture> RenderThread::Core::DrawAndEncode(const PictureJob& job,
                                                       Result<PictureContent>& content) {
  if (job.is_cancelled()) return Cancelled();
  if (!content.ok()) return content.status();
  const auto draw = [&]() -> Result<Picture> {
    const trace::Span span("draw");
    if (!job.spec.is_tiled) return renderer_->Draw(job.spec, content->cloths, content->states);
    return DrawTiles(*renderer_, job.spec, content->cloths, content->states, job.is_cancelled);
  };
  DRAPE_ASSIGN_OR_RETURN(Picture picture, draw());
  const trace::Span span("encode_picture");
  std::string png, rgb;
  if (job.spec.is_raw) {
    rgb.assign(picture.rgb.begin(), picture.rgb.end());
  } else {
    DRAPE_ASSIGN_OR_RETURN(png, EncodePng(picture));
  }
  return DrawnPicture{.png = std::move(png),
                      .rgb = std::move(rgb),
                      .depths_m = std::move(picture.depths_m),
                      .camera = picture.camera,
                      .bounds_m = picture.bounds_m,
                      .range = picture.range,
                      .device = renderer_->device(),
                      .steps = content->steps,
                      .in_flight = job.permit};
}

void RenderThread::Core::Finish(const FetchPointer& fetch) {
  Result<DrawnPicture> picture =
      WithinMemory([&] { return DrawAndEncode(fetch->job, *fetch->content); });
  fetch->content.reset();
  {
    const std::lock_guard lock(mutex_);
    particles_under_way_ -= fetch->job.particle_count;
    fetches_.remove(fetch);
  }
  if (!picture.ok() && picture.status().reason() == kRendererLost) {
    spdlog::error("renderer_lost message=\"{}\"", picture.status().message());
    LoseRenderer();
    picture = picture.status().RetryAfterMs(limits_.retry_after_ms);
  }
  End(std::move(fetch->job), std::move(picture));
}

void RenderThread::Core::LoseRenderer() {
  std::list<FetchPointer> lost;
  {
    const std::lock_guard lock(mutex_);
    lost.swap(fetches_);
    particles_under_way_ = 0;
    for (const FetchPointer& fetch : lost) queue_.Return(std::move(fetch->job));
  }
  // Content may belong to the renderer's context: it must be destroyed first.
  for (const FetchPointer& fetch : lost) fetch->content.reset();
  renderer_.reset();
}

void RenderThread::Core::EndAll() {
  LoseRenderer();
  std::vector<PictureJob> waiting;
  {
    const std::lock_guard lock(mutex_);
    waiting = queue_.TakeAll();
  }
  for (PictureJob& job : waiting) End(std::move(job), Draining());
}

RenderThread::RenderThread(RendererFactory factory, const RenderLimits& limits)
    : core_(std::make_shared<Core>(std::move(factory), limits)),
      thread_([core = core_] { core->Loop(); }) {}

RenderThread::~RenderThread() {
  Stop();
}

const RenderLimits& RenderThread::limits() const {
  return core_->limits();
}

Status RenderThread::Submit(PictureJob job) {
  return core_->Submit(std::move(job));
}

void RenderThread::Stop() {
  core_->RequestStop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace drape::render
