#include "server/scheduler/observers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/core/check.h"
#include "server/scheduler/state_reading.h"

namespace drape {
namespace {

// Longest time between two frames that only a rate limit holds back: one hour.
constexpr double kMaxInterval_us = 3600e6;

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
    const int64_t next_us = *situation.last_frame_us + interval_us;
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
  Subscription subscription;
  for (const auto& cloth : spec.cloths) {
    Seen seen;
    seen.completed_steps = cloth->now().completed_steps;
    seen.reset_count = cloth->reset_count();
    subscription.seen.push_back(seen);
  }
  subscription.spec = std::move(spec);
  subscription.observer = std::move(observer);
  subscriptions_.push_back(std::move(subscription));
}

std::optional<int64_t> ObserverSet::Serve(Backend& backend, int64_t now_us) {
  std::optional<int64_t> wake_at_us;
  for (auto entry = subscriptions_.begin(); entry != subscriptions_.end();) {
    Subscription& subscription = *entry;
    if (const std::optional<Status> reason = EndReason(subscription)) {
      complete_([on_end = subscription.spec.on_end, reason] { on_end(*reason); });
      entry = subscriptions_.erase(entry);
      continue;
    }
    FrameSituation situation;
    situation.is_newly_due = IsNewlyDue(subscription);
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
    if (decision.send && SendFrame(subscription, backend)) subscription.last_frame_us = now_us;
    if (decision.wake_at_us.has_value()) {
      wake_at_us = std::min(wake_at_us.value_or(*decision.wake_at_us), *decision.wake_at_us);
    }
    ++entry;
  }
  return wake_at_us;
}

void ObserverSet::EndAll(const Status& status) {
  for (const Subscription& subscription : subscriptions_) {
    complete_([on_end = subscription.spec.on_end, status] { on_end(status); });
  }
  subscriptions_.clear();
}

std::optional<Status> ObserverSet::EndReason(const Subscription& subscription) const {
  if (subscription.observer->is_cancelled_) {
    return Status(StatusCode::kCancelled, "CANCELLED", "the subscription was cancelled");
  }
  const auto& cloths = subscription.spec.cloths;
  if (std::none_of(cloths.begin(), cloths.end(),
                   [](const auto& cloth) { return cloth->is_alive(); })) {
    return Status(StatusCode::kNotFound, "CLOTH_NOT_FOUND",
                  "every cloth of the subscription was deleted");
  }
  return std::nullopt;
}

bool ObserverSet::IsNewlyDue(Subscription& subscription) const {
  bool is_due = false;
  const uint64_t every = subscription.spec.every_n_steps;
  for (size_t k = 0; k < subscription.seen.size(); ++k) {
    const ClothRuntime& cloth = *subscription.spec.cloths[k];
    Seen& seen = subscription.seen[k];
    const uint64_t completed = cloth.now().completed_steps;
    is_due |= cloth.reset_count() != seen.reset_count ||
              completed / every != seen.completed_steps / every;
    seen.completed_steps = completed;
    seen.reset_count = cloth.reset_count();
  }
  return is_due;
}

bool ObserverSet::SendFrame(Subscription& subscription, Backend& backend) {
  ObservedFrame frame;
  std::vector<std::shared_ptr<ClothRuntime>> changed;
  for (uint32_t k = 0; k < subscription.seen.size(); ++k) {
    const auto& cloth = subscription.spec.cloths[k];
    Seen& seen = subscription.seen[k];
    if (!cloth->is_alive() || (seen.is_sent && seen.state_version == cloth->state_version())) {
      continue;
    }
    seen.is_sent = true;
    seen.state_version = cloth->state_version();
    frame.cloth_indices.push_back(k);
    changed.push_back(cloth);
  }
  if (changed.empty()) return false;
  frame.states = ReadClothStates(backend, changed, subscription.spec.fields);
  frame.frame = ++subscription.frame;
  frame.frames_dropped = std::exchange(subscription.frames_dropped, 0);
  const std::shared_ptr<Observer>& observer = subscription.observer;
  --observer->credit_;
  ++observer->frames_in_flight_;
  frame.in_flight = std::shared_ptr<void>(observer.get(), [observer](void*) {
    --observer->frames_in_flight_;
    observer->wake_();
  });
  // std::function needs copyable captures; the frame is moved out once.
  auto held = std::make_shared<ObservedFrame>(std::move(frame));
  complete_([on_frame = subscription.spec.on_frame, held] { on_frame(std::move(*held)); });
  return true;
}

}  // namespace drape
