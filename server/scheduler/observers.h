// Subscriptions to the states of cloths while they are stepped.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/core/status.h"
#include "server/scheduler/step_work.h"
#include "server/solver/backend.h"

namespace drape {

// Frames of one subscription that may exist at once (read from the device, not yet dropped by the
// receiver), whatever its credit. Two keep a connection busy; more only make frames older and cost
// memory.
inline constexpr uint32_t kMaxFramesInFlight = 2;

// What decides about one subscription at one moment.
struct FrameSituation {
  bool is_newly_due = false;   // some cloth reached a multiple of every_n_steps, or was reset
  bool is_owed = false;        // an earlier frame was due and is not sent yet
  bool lacked_credit = false;  // or a free place in flight: that is what held back the earlier one
  bool is_paused = false;
  uint32_t credit = 0;
  uint32_t frames_in_flight = 0;
  double max_hz = 0;  // 0 = no limit
  int64_t now_us = 0;
  std::optional<int64_t> last_frame_us;
};
struct FrameDecision {
  bool send = false;  // read and send the latest state now
  // Of the next situation.
  bool is_owed = false;
  bool lacked_credit = false;
  bool is_dropped = false;  // count one frame that was due and will not be sent
  // Owed only because of max_hz: look again then.
  std::optional<int64_t> wake_at_us;
};
// Latest frame wins: a due frame that cannot go now is owed; when the next one becomes due it takes
// its place, and the older one counts as dropped if it was want of credit (or of a free place in
// flight) that held it back. Frames held back by max_hz or a pause are not counted. Pure.
FrameDecision DecideFrame(const FrameSituation& situation);

// A frame of a subscription. Keep it (or `in_flight`) until its bytes have left: it occupies one of
// kMaxFramesInFlight places.
struct ObservedFrame {
  uint64_t frame = 0;           // from 1
  uint64_t frames_dropped = 0;  // since the previous frame
  // Which cloths are in it, as indices into ObserverSpec::cloths, ascending: those whose state has
  // changed since the last frame that held them.
  std::vector<uint32_t> cloth_indices;
  ClothStates states;  // same order
  std::shared_ptr<void> in_flight;
};

struct ObserverSpec {
  std::string tenant;  // as in StepWork; empty: counted in all subscriptions alone
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  StateFields fields;          // at least one
  uint32_t every_n_steps = 1;  // >= 1
  // Frames per second at most; 0 = no limit. Less than one per hour counts as one per hour.
  double max_hz = 0;
  uint32_t initial_credit = 0;
  // Completion thread, in order. The first frame, as soon as there is credit, holds every cloth as
  // it is at that time, stepped or not.
  std::function<void(ObservedFrame)> on_frame;
  // Completion thread, exactly once, after the last frame: CANCELLED after Observer::Cancel,
  // NOT_FOUND (CLOTH_NOT_FOUND) when every cloth is gone, UNAVAILABLE (DRAINING) when the server
  // shuts down.
  std::function<void(Status)> on_end;
};

// The caller's side of a subscription. Thread-safe, any thread; harmless after its end.
class Observer {
 public:
  // `wake` makes the device thread look at the subscription; it must be callable for ever. `place`
  // is kept until this goes.
  explicit Observer(std::function<void()> wake, std::shared_ptr<void> place = nullptr)
      : wake_(std::move(wake)), place_(std::move(place)) {}

  // Adds to what is left; saturates.
  void AddCredit(uint32_t frames);
  void SetPaused(bool is_paused);
  void Cancel();

 private:
  friend class ObserverSet;

  std::atomic<uint32_t> credit_{0};
  std::atomic<bool> is_paused_{false};
  std::atomic<bool> is_cancelled_{false};
  std::atomic<uint32_t> frames_in_flight_{0};
  std::function<void()> wake_;
  std::shared_ptr<void> place_;
};

// All subscriptions. Device thread alone.
class ObserverSet {
 public:
  // `complete` runs a function on the completion thread, in order.
  explicit ObserverSet(std::function<void(std::function<void()>)> complete);

  void Add(ObserverSpec spec, std::shared_ptr<Observer> observer);
  // Sends what is due; ends what is cancelled or has lost all its cloths. After every round, and
  // when woken. Returns when to look again, if only time is waited for.
  std::optional<int64_t> Serve(Backend& backend, int64_t now_us);
  void EndAll(const Status& status);
  size_t size() const { return subscriptions_.size(); }

 private:
  struct Seen {
    uint64_t state_version = 0;    // when last sent
    bool is_sent = false;          // at least once
    uint64_t completed_steps = 0;  // when last looked at
    uint64_t reset_count = 0;
  };
  struct Subscription {
    ObserverSpec spec;
    std::shared_ptr<Observer> observer;
    std::vector<Seen> seen;  // [cloth]
    bool is_owed = true;     // the first frame
    bool lacked_credit = false;
    uint64_t frame = 0;
    uint64_t frames_dropped = 0;
    std::optional<int64_t> last_frame_us;
  };

  bool IsNewlyDue(Subscription& subscription) const;
  bool SendFrame(Subscription& subscription, Backend& backend);
  std::optional<Status> EndReason(const Subscription& subscription) const;

  std::function<void(std::function<void()>)> complete_;
  std::list<Subscription> subscriptions_;
};

}  // namespace drape
