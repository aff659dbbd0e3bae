#include "server/scheduler/observers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "server/core/check.h"
#include "server/core/memory_reserve.h"
#include "server/scheduler/state_reading.h"

namespace drape {
namespace {

// Longest time between two frames that only a rate limit holds back: one hour.
constexpr double kMaxInterval_us = 3600e6;

// What a frame of these cloths takes; 0 without a queue.
uint64_t FrameBytes(const ObserverSpec& spec, const std::vector<uint32_t>& cloths) {
  if (!spec.queue) return 0;
  uint64_t rows = 0;
  for (const uint32_t k : cloths) {
    rows += spec.fields.RowsOf(spec.cloths[k]->model()->described_particle_count());
  }
  return rows * spec.queue->bytes_per_row + cloths.size() * spec.queue->bytes_per_cloth;
}

}  // namespace

FrameDecision DecideFrame(const FrameSituation& situation) {
  FrameDecision decision;
  if (!situation.is_newly_due && !situation.is_owed) return decision;
  decision.is_owed = true;
  // The newer frame replaces the earlier one.
  decision.is_dropped = situation.is_newly_due && situation.is_owed && situation.lacked_credit;
  if (situation.is_paused) return decision;
  if (situation.max_hz > 0 && situation.last_frame_us.has_value()) {
    const double interval = std::min(std::ceil(1e6 / situation.max_hz), kMaxInterval_us);
    const auto interval_us = static_cast<int64_t>(interval);
    const int64_t next_us = (*situation.last_frame_us / interval_us + 1) * interval_us;
    if (situation.now_us < next_us) {
      decision.wake_at_us = next_us;
      return decision;
    }
  }
  if (situation.credit == 0 || situation.frames_in_flight >= kMaxFramesInFlight) {
    decision.lacked_credit = true;
    return decision;
  }
  decision.send = true;
  decision.is_owed = false;
  return decision;
}

void Observer::AddCredit(uint32_t frames) {
  uint32_t credit = credit_;
  uint32_t sum = 0;
  do {
    const uint32_t room = std::numeric_limits<uint32_t>::max() - credit;
    sum = credit + std::min(frames, room);
  } while (!credit_.compare_exchange_weak(credit, sum));
  wake_();
}

void Observer::SetPaused(bool is_paused) {
  is_paused_ = is_paused;
  wake_();
}

void Observer::Cancel() {
  is_cancelled_ = true;
  wake_();
}

ObserverSet::ObserverSet(std::function<void(std::function<void()>)> complete)
    : complete_(std::move(complete)) {}

void ObserverSet::Add(ObserverSpec spec, std::shared_ptr<Observer> observer) {
  DRAPE_CHECK(spec.every_n_steps >= 1 && spec.fields.any() && spec.max_hz >= 0,
              "a subscription needs a rate and a field");
  DRAPE_CHECK(!spec.queue || spec.max_hz == 0, "a rate would leave frames out");
  Subscription subscription;
  subscription.bell = std::make_shared<ChangeBell>(spec.cloths.size());
  for (const auto& cloth : spec.cloths) {
    cloth->Watch(subscription.bell, static_cast<uint32_t>(subscription.seen.size()));
    Seen seen;
    seen.completed_steps = cloth->now().completed_steps;
    seen.reset_count = cloth->reset_count();
    subscription.seen.push_back(seen);
  }
  subscription.audience = AudienceOf(spec);
  subscription.spec = std::move(spec);
  subscription.observer = std::move(observer);
  subscriptions_.push_back(std::move(subscription));
}

std::optional<int64_t> ObserverSet::Serve(Backend& backend, int64_t now_us) {
  std::optional<int64_t> wake_at_us;
  for (auto entry = subscriptions_.begin(); entry != subscriptions_.end();) {
    Subscription& subscription = *entry;
    const std::vector<uint32_t> changed = subscription.bell->Take();
    std::vector<uint32_t> due = NewlyDue(subscription, changed);
    const bool is_newly_due = !due.empty();
    // Before its end: what is due was stepped before it was cancelled.
    const Status served =
        subscription.spec.queue ? ServeEveryFrame(subscription, std::move(due), backend) : Status();
    const bool may_have_lost_all = std::exchange(subscription.is_new, false) || !changed.empty();
    std::optional<Status> reason = EndReason(subscription, may_have_lost_all);
    if (!reason && !served.ok()) reason = served;
    std::optional<int64_t> again_us;
    if (!reason && !subscription.spec.queue) {
      again_us = ServeLatest(subscription, is_newly_due, backend, now_us);
    }
    if (!reason && !subscription.failure.ok()) reason = subscription.failure;
    if (reason) {
      complete_([on_end = subscription.spec.on_end, reason] { on_end(*reason); });
      entry = subscriptions_.erase(entry);
      continue;
    }
    if (again_us) wake_at_us = std::min(wake_at_us.value_or(*again_us), *again_us);
    ++entry;
  }
  // The receivers keep what they have not sent.
  for (Subscription& subscription : subscriptions_) subscription.audience->contents.clear();
  return wake_at_us;
}

std::shared_ptr<ObserverSet::Audience> ObserverSet::AudienceOf(const ObserverSpec& spec) const {
  for (const Subscription& other : subscriptions_) {
    if (other.spec.encoding == spec.encoding && other.spec.fields == spec.fields &&
        other.spec.cloths == spec.cloths) {
      return other.audience;
    }
  }
  return std::make_shared<Audience>();
}

std::shared_ptr<FrameContent> ObserverSet::Content(const Subscription& subscription,
                                                   std::vector<uint32_t> cloths, Backend& backend) {
  auto& contents = subscription.audience->contents;
  for (const auto& content : contents) {
    if (content->cloth_indices == cloths) return content;
  }
  std::vector<std::shared_ptr<ClothRuntime>> read;
  for (const uint32_t k : cloths) read.push_back(subscription.spec.cloths[k]);
  auto content = std::make_shared<FrameContent>();
  content->cloth_indices = std::move(cloths);
  content->states = ReadClothStates(backend, read, subscription.spec.fields);
  contents.push_back(content);
  return content;
}

std::optional<int64_t> ObserverSet::ServeLatest(Subscription& subscription, bool is_newly_due,
                                                Backend& backend, int64_t now_us) {
  FrameSituation situation;
  situation.is_newly_due = is_newly_due;
  situation.is_owed = subscription.is_owed;
  situation.lacked_credit = subscription.lacked_credit;
  situation.is_paused = subscription.observer->is_paused_;
  situation.credit = subscription.observer->credit_;
  situation.frames_in_flight = subscription.observer->frames_in_flight_;
  situation.max_hz = subscription.spec.max_hz;
  situation.now_us = now_us;
  situation.last_frame_us = subscription.last_frame_us;
  const FrameDecision decision = DecideFrame(situation);
  subscription.is_owed = decision.is_owed;
  subscription.lacked_credit = decision.lacked_credit;
  subscription.frames_dropped += decision.is_dropped;
  counters_.frames_dropped += decision.is_dropped;
  if (!decision.send) return decision.wake_at_us;
  std::vector<uint32_t> changed;
  for (uint32_t k = 0; k < subscription.seen.size(); ++k) {
    const Seen& seen = subscription.seen[k];
    if (seen.is_sent && seen.state_version == subscription.spec.cloths[k]->state_version()) {
      continue;
    }
    changed.push_back(k);
  }
  if (SendFrame(subscription, std::move(changed), backend)) {
    --subscription.observer->credit_;
    subscription.last_frame_us = now_us;
  }
  return decision.wake_at_us;
}

Status ObserverSet::ServeEveryFrame(Subscription& subscription, std::vector<uint32_t> due,
                                    Backend& backend) {
  if (subscription.is_owed) {  // the first one holds every cloth
    due.resize(subscription.seen.size());
    std::iota(due.begin(), due.end(), 0u);
  }
  if (due.empty()) return Status::Ok();
  const FrameQueue& queue = *subscription.spec.queue;
  const uint32_t frames = subscription.observer->frames_in_flight_;
  const uint64_t bytes = subscription.observer->bytes_in_flight_;
  if (frames >= queue.max_frames || bytes + FrameBytes(subscription.spec, due) > queue.max_bytes) {
    ++counters_.slow_consumers;
    return {StatusCode::kResourceExhausted, "SLOW_CONSUMER",
            "the client has not read " + std::to_string(frames) + " frames of " +
                std::to_string(bytes) + " bytes, and the next one is due: max_queued_frames is " +
                std::to_string(queue.max_frames) + ", max_queued_bytes is " +
                std::to_string(queue.max_bytes)};
  }
  subscription.is_owed = false;
  SendFrame(subscription, std::move(due), backend);
  return Status::Ok();
}

void ObserverSet::EndAll(const Status& status) {
  for (const Subscription& subscription : subscriptions_) {
    complete_([on_end = subscription.spec.on_end, status] { on_end(status); });
  }
  subscriptions_.clear();
}

std::optional<Status> ObserverSet::EndReason(const Subscription& subscription,
                                             bool may_have_lost_all) {
  if (subscription.observer->is_cancelled_) {
    return Status(StatusCode::kCancelled, "CANCELLED", "the subscription was cancelled");
  }
  if (!may_have_lost_all) return std::nullopt;
  const auto& cloths = subscription.spec.cloths;
  if (std::none_of(cloths.begin(), cloths.end(),
                   [](const auto& cloth) { return cloth->is_alive(); })) {
    return Status(StatusCode::kNotFound, "CLOTH_NOT_FOUND",
                  "every cloth of the subscription was deleted");
  }
  return std::nullopt;
}

std::vector<uint32_t> ObserverSet::NewlyDue(Subscription& subscription,
                                            const std::vector<uint32_t>& changed) {
  std::vector<uint32_t> due;
  const uint64_t every = subscription.spec.every_n_steps;
  for (const uint32_t k : changed) {
    const ClothRuntime& cloth = *subscription.spec.cloths[k];
    Seen& seen = subscription.seen[k];
    const uint64_t completed = cloth.now().completed_steps;
    if (cloth.reset_count() != seen.reset_count ||
        completed / every != seen.completed_steps / every) {
      due.push_back(k);
    }
    seen.completed_steps = completed;
    seen.reset_count = cloth.reset_count();
  }
  return due;
}

bool ObserverSet::SendFrame(Subscription& subscription, std::vector<uint32_t> cloths,
                            Backend& backend) {
  std::erase_if(cloths, [&](uint32_t k) { return !subscription.spec.cloths[k]->is_alive(); });
  if (cloths.empty()) return false;
  for (const uint32_t k : cloths) {
    Seen& seen = subscription.seen[k];
    seen.is_sent = true;
    seen.state_version = subscription.spec.cloths[k]->state_version();
  }
  const uint64_t bytes = FrameBytes(subscription.spec, cloths);
  ObservedFrame frame;
  subscription.failure = WithinMemory([&] {
    frame.content = Content(subscription, std::move(cloths), backend);
    return Status::Ok();
  });
  if (!subscription.failure.ok()) return false;
  frame.frame = ++subscription.frame;
  frame.frames_dropped = std::exchange(subscription.frames_dropped, 0);
  ++counters_.frames_sent;
  const std::shared_ptr<Observer>& observer = subscription.observer;
  ++observer->frames_in_flight_;
  observer->bytes_in_flight_ += bytes;
  frame.in_flight = std::shared_ptr<void>(observer.get(), [observer, bytes](void*) {
    observer->bytes_in_flight_ -= bytes;
    --observer->frames_in_flight_;
    observer->wake_();
  });
  // std::function needs copyable captures; the frame is moved out once.
  auto held = std::make_shared<ObservedFrame>(std::move(frame));
  complete_([on_frame = subscription.spec.on_frame, held] { on_frame(std::move(*held)); });
  return true;
}

}  // namespace drape
