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

// Limit on the frames of one subscription that exist at once (read from the device, not yet dropped
// by the receiver), whatever its credit. Two keep a connection busy; more only make frames older
// and use memory.
inline constexpr uint32_t kMaxFramesInFlight = 2;

// Everything that DecideFrame depends on.
struct FrameSituation {
  bool is_newly_due = false;   // some cloth reached a multiple of every_n_steps, or was reset
  bool is_owed = false;        // an earlier frame was due and is not sent yet
  bool lacked_credit = false;  // that, or too many frames in flight, held back the earlier one
  bool is_paused = false;
  uint32_t credit = 0;
  uint32_t frames_in_flight = 0;
  // 0 = no limit; else at most one frame from one multiple of 1/max_hz to the next.
  double max_hz = 0;
  int64_t now_us = 0;
  std::optional<int64_t> last_frame_us;
};
struct FrameDecision {
  bool send = false;  // read and send the latest state now
  // For the next situation.
  bool is_owed = false;
  bool lacked_credit = false;
  bool is_dropped = false;  // count one frame that was due and will not be sent
  // When to decide again; only if max_hz alone holds the frame back.
  std::optional<int64_t> wake_at_us;
};
// The latest frame wins. A due frame that cannot be sent now is owed; the next due frame replaces
// it, and the older one counts as dropped if lack of credit (or too many frames in flight) held it
// back. Frames held back by max_hz or a pause are not counted. The times of a rate are multiples of
// its interval, the same for all subscriptions, so that those of one rate share their frames. Pure.
FrameDecision DecideFrame(const FrameSituation& situation);

// What a frame holds: one for all subscriptions of the same audience to which it is due at once.
struct FrameContent {
  // The cloths in it, as indices into ObserverSpec::cloths, ascending: those whose state has
  // changed since the last frame that held them.
  std::vector<uint32_t> cloth_indices;
  ClothStates states;  // same order; the first receiver may take them
  // Completion thread only. What the first receiver made of the states, for the others.
  std::shared_ptr<const void> encoded;
};

// A frame of a subscription. Keep it (or `in_flight`) until its bytes have been sent: it is one of
// the kMaxFramesInFlight.
struct ObservedFrame {
  uint64_t frame = 0;           // from 1
  uint64_t frames_dropped = 0;  // since the previous frame
  std::shared_ptr<FrameContent> content;
  std::shared_ptr<void> in_flight;
};

// The frames of a subscription that leaves none out: those that its receiver holds. What the rows
// and cloths of a frame take is what its receiver says.
struct FrameQueue {
  uint32_t max_frames = 2;
  uint64_t max_bytes = 0;
  uint64_t bytes_per_row = 0;
  uint64_t bytes_per_cloth = 0;
};

struct ObserverSpec {
  std::string session;   // as in StepWork; empty: only the limit in all applies
  std::string tenant{};  // of the session
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  StateFields fields;  // at least one
  // How the receiver encodes them. Subscriptions of which cloths, fields and this are equal are one
  // audience: they share frames.
  std::string encoding{};
  uint32_t every_n_steps = 1;  // >= 1
  // Limit on the frames per second; 0 = none. Less than one per hour counts as one per hour.
  double max_hz = 0;
  uint32_t initial_credit = 0;
  // Every frame is sent, without credit; max_hz is 0. A frame holds the cloths that completed a
  // multiple of every_n_steps, or were reset, since the last round. Where the queue has no room for
  // it the subscription ends: nobody waits for its receiver. After Observer::Cancel come the frames
  // of all steps that were complete then.
  std::optional<FrameQueue> queue{};
  // Completion thread, in order. The first frame is sent as soon as there is credit and holds every
  // cloth as it is at that time, stepped or not.
  std::function<void(ObservedFrame)> on_frame;
  // Completion thread, exactly once, after the last frame: CANCELLED after Observer::Cancel,
  // NOT_FOUND (CLOTH_NOT_FOUND) when every cloth is gone, RESOURCE_EXHAUSTED (SLOW_CONSUMER) when
  // the queue is full, UNAVAILABLE (DRAINING) when the server shuts down.
  std::function<void(Status)> on_end;
};

// The caller's side of a subscription. Thread-safe. Does nothing after the subscription has ended.
class Observer {
 public:
  // `wake` makes the device thread look at the subscription; it must stay callable. The observer
  // keeps the permit.
  explicit Observer(std::function<void()> wake, std::shared_ptr<void> permit = nullptr)
      : wake_(std::move(wake)), permit_(std::move(permit)) {}

  // Adds to the remaining credit; saturates.
  void AddCredit(uint32_t frames);
  void SetPaused(bool is_paused);
  void Cancel();

 private:
  friend class ObserverSet;

  std::atomic<uint32_t> credit_{0};
  std::atomic<bool> is_paused_{false};
  std::atomic<bool> is_cancelled_{false};
  std::atomic<uint32_t> frames_in_flight_{0};
  std::atomic<uint64_t> bytes_in_flight_{0};  // with a queue
  std::function<void()> wake_;
  std::shared_ptr<void> permit_;
};

// All subscriptions. Device thread only.
class ObserverSet {
 public:
  // `complete` runs a function on the completion thread, in order.
  explicit ObserverSet(std::function<void(std::function<void()>)> complete);

  // Since the start. Any thread.
  struct Counters {
    std::atomic<uint64_t> frames_sent{0};
    std::atomic<uint64_t> frames_dropped{0};
    std::atomic<uint64_t> slow_consumers{0};  // subscriptions that ended for it
  };
  const Counters& counters() const { return counters_; }

  void Add(ObserverSpec spec, std::shared_ptr<Observer> observer);
  // Sends due frames; ends subscriptions that were cancelled or have lost all their cloths. After
  // every round, and when woken. Returns when to serve again, if a rate limit holds a frame back.
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
  // Of subscriptions that share frames.
  struct Audience {
    std::vector<std::shared_ptr<FrameContent>> contents;  // read while Serve runs, for all of them
  };
  struct Subscription {
    ObserverSpec spec;
    std::shared_ptr<Audience> audience;
    std::shared_ptr<Observer> observer;
    std::vector<Seen> seen;            // [cloth]
    std::shared_ptr<ChangeBell> bell;  // of its cloths
    bool is_new = true;                // not served yet
    bool is_owed = true;               // the first frame
    bool lacked_credit = false;
    uint64_t frame = 0;
    uint64_t frames_dropped = 0;
    std::optional<int64_t> last_frame_us;
    Status failure;  // of the last frame
  };

  std::shared_ptr<Audience> AudienceOf(const ObserverSpec& spec) const;
  // The states of these cloths, all alive, read once for the audience while Serve runs.
  std::shared_ptr<FrameContent> Content(const Subscription& subscription,
                                        std::vector<uint32_t> cloths, Backend& backend);
  // Sends the latest state if a frame is due and may be sent; when to look again.
  std::optional<int64_t> ServeLatest(Subscription& subscription, bool is_newly_due,
                                     Backend& backend, int64_t now_us);
  // Sends the frame that is due, if there is one. An error: there is no room for it.
  Status ServeEveryFrame(Subscription& subscription, std::vector<uint32_t> due, Backend& backend);
  // Those of the cloths that have changed for which a frame is due since the last call.
  static std::vector<uint32_t> NewlyDue(Subscription& subscription,
                                        const std::vector<uint32_t>& changed);
  // Sends those of the cloths that are alive; all of them have been seen. False: there are none.
  bool SendFrame(Subscription& subscription, std::vector<uint32_t> cloths, Backend& backend);
  static std::optional<Status> EndReason(const Subscription& subscription, bool may_have_lost_all);

  std::function<void(std::function<void()>)> complete_;
  std::list<Subscription> subscriptions_;
  Counters counters_;
};

}  // namespace drape
