// The rounds of the device thread: step requests in, batches to the backend. No threads, no locks.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/core/clock.h"
#include "server/core/duration_histogram.h"
#include "server/core/rate_quota.h"
#include "server/scheduler/active_request.h"
#include "server/scheduler/batch_policy.h"
#include "server/scheduler/session_index.h"
#include "server/scheduler/state_reading.h"
#include "server/solver/device_backend.h"

namespace drape {

// Written by the device thread, read by any.
struct RoundCounters {
  std::atomic<uint64_t> rounds{0};
  std::atomic<uint64_t> dispatches{0};
  std::atomic<uint64_t> cloth_steps{0};
  std::atomic<uint64_t> cloth_steps_asleep{0};  // of these
  std::atomic<uint64_t> faults{0};
  std::atomic<uint64_t> long_step_pieces{0};
  DurationHistogram batch_durations;
  DurationHistogram request_durations;
};

// All step requests that the device thread has taken over. Device thread only.
class DeviceLoop {
 public:
  struct Settings {
    BatchLimits batch;
    uint32_t max_steps_per_request = 1;
    // What a whole batch may cost [us], see SchedulerLimits.
    int64_t batch_budget_us = 50'000;
    uint64_t max_long_step_bytes = UINT64_MAX;  // see SchedulerLimits
  };
  // Called once for every request, in order of completion.
  using EndedCallback = std::function<void(StepWork, StepOutcome)>;

  // `rates` outlives this.
  DeviceLoop(Backend& backend, const Settings& settings, const Clock& clock, EndedCallback ended,
             RoundCounters& counters, RateQuota& rates);

  void Admit(StepWork work, int64_t submitted_us);
  // Ends cancelled requests, starts those that can start, steps one batch, ends complete requests.
  // While is_busy(), every round makes progress. Returns the duration of the batch [us]; none:
  // there was no batch. If the backend runs ahead, answers whose states are still on their way stay
  // behind: they are given while the batch of the next round is stepped.
  std::optional<int64_t> RunRound();
  // Gives the answers that stayed behind. Call it if no round follows at once.
  void GiveAnswers();
  // The session of each answer that stayed behind.
  std::vector<std::string> UnansweredSessions() const;
  bool has_requests() const { return !requests_.empty(); }
  // When the next round is due, after RunRound: until then every request is held back, by the rate
  // of its tenant, by commands or by kernels to compile, and nobody's time is over. Not later than
  // kLook_us from now, because clients may give up. None: at once, or there are no requests.
  std::optional<int64_t> RestUntil_us() const;
  static constexpr int64_t kLook_us = 100'000;
  // Or than this if a request waits for what its device compiles.
  static constexpr int64_t kLookForKernels_us = 2'000;
  // Ends every request with this status.
  void EndAll(const Status& status);

 private:
  using RequestPointer = std::unique_ptr<ActiveRequest>;

  // Until none is over any more and all that can start have started.
  void StartAndFinish();
  // Moves the requests that are over from requests_ to the result; starts those that can start.
  // What is over with an answer keeps its turns until that is made (Finish): the next one may put
  // the cloths elsewhere, or move their grips.
  std::vector<RequestPointer> StartAndEnd();
  // Ends the request if nobody waits for it any longer, or if it would wait in vain.
  void EndIfPointless(ActiveRequest& request, int64_t now_us,
                      std::optional<int64_t> held_back_until_us);
  // When the rate of its tenant allows the request to go on; none: now. A long step that has begun
  // goes on: it holds memory that others may need.
  std::optional<int64_t> HeldBackUntil_us(const ActiveRequest& request, int64_t now_us) const;
  // The part of a batch that comes from one request.
  struct Part {
    ActiveRequest* request = nullptr;
    std::vector<uint32_t> cloths;  // indices into its work
    uint32_t units = 0;            // that these are
  };
  std::vector<Part> SelectParts();
  // Whether the next step of these cloths, one or those of a world, is done in pieces.
  bool IsLong(const ActiveRequest& request, std::span<const uint32_t> unit) const;
  // Whether a step of the request is under way in pieces.
  bool HasLongStep(const ActiveRequest& request) const;
  // Whether the next step of the request, a long one, has no room beside those that are under way.
  bool LacksRoom(const ActiveRequest& request) const;
  // The request that lacked room first, and still waits to begin its long step; null: none.
  const ActiveRequest* FirstToBegin(int64_t now_us);
  // Whether the request must wait: its next step is long, and too many such steps are under way, or
  // another one is `first` to begin. Becomes first if there is none and it lacks room.
  bool MustWait(const ActiveRequest& request, const ActiveRequest*& first) const;
  // Adds an item per cloth that is awake, of one cloth or those of a world; wakes them if something
  // acts on one.
  void AddItems(const ActiveRequest& request, std::span<const uint32_t> unit,
                std::vector<StepItem>& items) const;
  std::vector<StepItem> ItemsOf(const std::vector<Part>& parts) const;
  // Whether the device works while the host does something else.
  bool RunsAhead() const { return backend_.device() != nullptr && backend_.device()->RunsAhead(); }
  // How long the backend took [us], without the time for answers while its device works.
  int64_t CostOf(const BatchReport& batch, int64_t wall_us) const;
  // Returns its duration [us].
  int64_t StepBatch(const std::vector<Part>& parts);
  // The same for a single cloth, or world, whose step is long: one piece of it.
  int64_t StepPiece(const std::vector<Part>& parts);
  // What follows a batch: steps are complete, requests know what it took. `spent_us`: what earlier
  // pieces of the step have cost. Returns the batch's duration [us].
  int64_t EndBatch(const std::vector<Part>& parts, BatchReport batch, int64_t begin_us,
                   double spent_us);
  // Drops what the request has under way in pieces.
  void DropLongStep(ActiveRequest* request);
  // Ends the step of every cloth of the batch. `reports`: of the cloths that were awake; `cost_us`:
  // what the batch cost.
  void CompleteSteps(const std::vector<Part>& parts, const std::vector<StepReport>& reports,
                     double cost_us);
  // Tells the rates what was done for each tenant.
  void Charge(const std::vector<Part>& parts);
  // Divides the cost of a batch among its cloths.
  void MeasureCosts(const std::vector<Part>& parts, const std::vector<StepReport>& reports,
                    double cost_us);
  // Without the cloths whose step was left undone, and their reports: their turn comes again.
  std::vector<Part> WithoutUndone(const std::vector<Part>& parts,
                                  std::vector<StepReport>& reports) const;
  static std::vector<std::shared_ptr<ClothRuntime>> ClothsOf(const std::vector<Part>& parts);
  // Requests that ended together.
  struct Answer {
    StepWork work;
    StepOutcome outcome;
  };
  struct View {
    std::vector<size_t> answers;  // those that want it
    int64_t begin_us;
    SharedRead read;
  };
  struct Answers {
    std::vector<Answer> answers;  // in order of completion
    std::vector<View> views;
  };
  // Begins to read the states that the requests want; gives answers that need not wait.
  void Finish(std::vector<RequestPointer> over);
  // One read for all answers that want the same fields of the same particles.
  void BeginViews(Answers& ended);
  void TakeView(View& view, std::vector<Answer>& answers);

  Backend& backend_;
  const bool has_cheap_impulses_;  // BackendDescription::has_cheap_impulses
  const Settings settings_;
  const Clock& clock_;
  const EndedCallback ended_;
  RoundCounters& counters_;
  RateQuota& rates_;
  std::list<RequestPointer> requests_;  // in order of arrival
  SessionIndex sessions_;
  FairShare share_;
  uint64_t round_ = 0;
  SolveRate rate_;
  // A step that is done in pieces; a session has one at most, because each holds working memory.
  struct LongStep {
    std::vector<std::shared_ptr<ClothRuntime>> cloths;  // one, or those of a world
    uint64_t bytes = 0;
    double spent_us = 0;
  };
  std::unordered_map<ActiveRequest*, LongStep> long_steps_;
  const ActiveRequest* first_to_begin_ = nullptr;  // one, for which there was no room; null: none
  std::vector<Answers> answers_;                   // not given yet
};

}  // namespace drape
