#include "client/cli/load_viewers.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace drape::cli {
namespace {

StateStream Subscribe(const Session& session, double hz) {
  v1::StreamStatesRequest::Subscribe subscribe;
  subscribe.set_all_cloths(true);
  subscribe.set_every_n_steps(1);
  subscribe.set_max_hz(hz);
  return session.StreamStates(std::move(subscribe));
}

uint64_t StepOf(const States& frame) {
  uint64_t step = 0;
  for (const ClothState& cloth : frame) step = std::max(step, cloth.step);
  return step;
}

}  // namespace

struct LoadViewers::Viewer {
  Viewer(const LoadPlan& plan, LoadClient& followed, double hz)
      : driver(followed),
        client(plan.connect()),
        session(client.AttachSession(followed.session_name())),
        stream(Subscribe(session, hz)) {}

  // Reads every frame until the stream is cancelled.
  void Read() {
    try {
      while (const std::optional<States> frame = stream.Next()) {
        const auto now = LoadClock::now();
        if (frame->frame() == 1) continue;  // what was there before, however old
        // A frame that arrives before the answer of its step is no older than that.
        const auto answered = driver.answers().Of(StepOf(*frame)).value_or(now);
        const std::chrono::duration<double, std::milli> age = now - answered;
        samples.frame_ages_ms.push_back(std::max(0.0, age.count()));
        samples.frames_dropped += frame->frames_dropped();
      }
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCancelled) ++samples.errors["viewer:" + error.reason()];
    }
  }

  LoadClient& driver;
  Client client;
  Session session;
  StateStream stream;
  LoadSamples samples;
  std::thread reader;  // of no stalled viewer
};

LoadViewers::LoadViewers(const LoadPlan& plan,
                         std::span<const std::unique_ptr<LoadClient>> clients) {
  for (uint32_t k = 0; k < plan.viewers; ++k) {
    viewers_.push_back(
        std::make_unique<Viewer>(plan, *clients[k % clients.size()], plan.viewer_hz));
    viewers_.back()->reader = std::thread([viewer = viewers_.back().get()] { viewer->Read(); });
  }
  for (uint32_t k = 0; k < plan.stalled_viewers; ++k) {
    viewers_.push_back(std::make_unique<Viewer>(plan, *clients[k % clients.size()], 0));
  }
}

LoadViewers::~LoadViewers() {
  Stop();
}

void LoadViewers::Stop() {
  for (const auto& viewer : viewers_) viewer->stream.Cancel();
  for (const auto& viewer : viewers_) {
    if (viewer->reader.joinable()) viewer->reader.join();
  }
}

void LoadViewers::StopAndAdd(LoadSamples& samples) {
  Stop();
  for (const auto& viewer : viewers_) samples.Add(viewer->samples);
  viewers_.clear();
}

}  // namespace drape::cli
