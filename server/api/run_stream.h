// Run: the server steps cloths by itself, at a pace.
#pragma once

#include <grpcpp/alarm.h>

#include <memory>
#include <optional>
#include <utility>

#include "server/api/ending_stream.h"
#include "server/api/request_log.h"
#include "server/api/run_pace.h"
#include "server/api/simulation_service.h"
#include "server/api/stream_validation.h"

namespace drape::api {

// One run. Its steps are requests of one step like those of any client, so others share the device
// with it, and step the same cloths between two of them, as they share it with a client that asks
// for step after step. Two are under way at most: one waits while the other one is stepped.
//
// Ends with OK after its last step or when the client sends no more messages (what is under way is
// finished first), else with the status that ended it. Alive until gRPC, its steps and its alarm
// have let go of it; the run keeps its session alive.
class RunReactor final : public EndingStream<Unparsed<v1::RunRequest>, v1::RunReport>,
                         public std::enable_shared_from_this<RunReactor> {
 public:
  static RunReactor* Start(const ServiceContext& context, Caller caller);

 private:
  RunReactor(const ServiceContext& context, Caller caller)
      : EndingStream(context, std::move(caller)) {}

  void OnRequest(bool ok) override;
  void OnWritten(bool ok) override;
  void OnCancel() override;

  // A step of the cloths of `generation` is over.
  void OnStep(const Status& status, uint32_t generation);
  void OnAlarm();
  // With mutex_ held.
  Status Take(const v1::RunRequest& request);
  Status Begin(const v1::RunRequest::Start& request);
  // The cloths of all further steps.
  void SetCloths(ClothList cloths);
  // Begins steps that are due, sends a report that is due, and comes back in time for the next.
  void Advance();
  Status BeginStep();
  bool MayBeginStep() const;
  void WakeAt(int64_t time_us);
  // After a step that failed: leaves out cloths that were deleted. An error: that ends the run.
  Status DropDeleted(const Status& status, uint32_t generation);
  void Close(const Status& status);
  void LoseClient();
  void WriteNext();
  void FillReport(v1::RunReport* report);
  void CountDropped();

  std::shared_ptr<void> place_;       // ServiceContext::OpenStream
  Unparsed<v1::RunRequest> request_;  // being read
  v1::RunReport report_;              // being written
  RequestTag tag_;
  SessionLease session_;
  std::shared_ptr<void> held_;    // for its messages
  std::shared_ptr<void> permit_;  // among the subscriptions of its session
  ClothList cloths_;
  uint32_t generation_ = 0;  // of them
  StepWork work_;            // of each step; the expected step only of the first
  std::optional<RunPace> pace_;
  uint64_t max_steps_ = 0;  // UINT64_MAX: no limit
  int64_t report_interval_us_ = 0;
  int64_t next_report_us_ = 0;
  uint64_t begun_steps_ = 0;
  uint64_t complete_steps_ = 0;
  uint64_t counted_drops_ = 0;    // in the metrics
  uint32_t under_way_ = 0;        // steps
  int64_t refused_until_us_ = 0;  // the queue had no room
  std::unique_ptr<grpc::Alarm> alarm_;
  std::optional<int64_t> alarm_at_us_;
  std::optional<Status> ending_;  // set once: no more steps are begun
  bool is_report_due_ = false;
  bool is_writing_ = false;
  bool has_last_report_ = false;  // it has been written
  bool is_broken_ = false;        // the client has gone
  bool is_ended_ = false;         // End was called
};

}  // namespace drape::api
