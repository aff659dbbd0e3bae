#include "server/scheduler/scheduler.h"

#include <algorithm>
#include <future>
#include <utility>

#include "server/core/check.h"
#include "server/core/memory_reserve.h"
#include "server/scheduler/scheduler_core.h"
#include "server/scheduler/sliced_read.h"
#include "server/scheduler/state_reading.h"

namespace drape {
namespace {

// Whether the states of the cloths are there, and somebody wants them.
Status CheckReadable(ClothSpan cloths, const CancelToken& cancel) {
  if (cancel.is_cancelled()) {
    return {StatusCode::kCancelled, "CANCELLED", "the client cancelled the request"};
  }
  if (std::all_of(cloths.begin(), cloths.end(),
                  [](const auto& cloth) { return cloth->is_alive(); })) {
    return Status::Ok();
  }
  return {StatusCode::kNotFound, "CLOTH_NOT_FOUND",
          "a cloth was deleted before its state was read"};
}

}  // namespace

// A call of ReadStates.
struct Scheduler::ReadUnderWay {
  Core* core;
  std::string owner;
  SlicedRead read;
  std::function<void(Result<ClothStates>)> done;
  std::shared_ptr<void> permit;
  CancelToken cancel;
};

// A slice more.
void Scheduler::ContinueRead(const std::shared_ptr<ReadUnderWay>& call, Backend& backend) {
  bool is_over = false;
  const Status status = WithinMemory([&] {
    DRAPE_RETURN_IF_ERROR(CheckReadable(call->read.cloths(), call->cancel));
    is_over = call->read.ReadMore(backend);
    return Status::Ok();
  });
  if (status.ok() && !is_over) {
    call->core->Continue(call->owner, [call](Backend& device) { ContinueRead(call, device); });
    return;
  }
  if (!status.ok()) call->read.Release();
  const auto states = status.ok() ? std::make_shared<Result<ClothStates>>(call->read.Take())
                                  : std::make_shared<Result<ClothStates>>(status);
  // Moved, because the command itself exists until the round is over.
  if (states->ok()) (*states)->in_flight = std::move(call->permit);
  call->permit.reset();
  call->core->completions().Push(
      [done = std::move(call->done), states] { done(std::move(*states)); });
}

Result<std::unique_ptr<Scheduler>> Scheduler::Start(BackendFactory factory,
                                                    const SchedulerLimits& limits,
                                                    const Clock& clock) {
  auto core = std::make_shared<Core>(limits, clock);
  DRAPE_RETURN_IF_ERROR(core->Start(std::move(factory)));
  return std::unique_ptr<Scheduler>(new Scheduler(std::move(core)));
}

Scheduler::Scheduler(std::shared_ptr<Core> core) : core_(std::move(core)) {}

Scheduler::~Scheduler() {
  Drain(0);
}

const BackendDescription& Scheduler::description() const {
  return core_->description();
}

const SchedulerLimits& Scheduler::limits() const {
  return core_->limits();
}

Status Scheduler::Post(const std::string& owner, DeviceCommand command) {
  return core_->Post(owner, std::move(command));
}

bool Scheduler::PostCleanup(const std::string& owner, DeviceCommand command) {
  return core_->PostCleanup(owner, std::move(command));
}

void Scheduler::Continue(const std::string& owner, DeviceCommand command) {
  core_->Continue(owner, std::move(command));
}

bool Scheduler::PostFirst(const std::string& owner, DeviceCommand command) {
  return core_->PostFirst(owner, std::move(command));
}

Status Scheduler::RunBlocking(std::function<Status(Backend&)> command) {
  DRAPE_CHECK(!core_->IsOnOwnThread(), "a thread cannot wait for itself");
  auto outcome = std::make_shared<std::promise<Status>>();
  std::future<Status> result = outcome->get_future();
  const bool is_taken =
      core_->PostCleanup({}, [command = std::move(command), outcome](Backend& backend) {
        outcome->set_value(command(backend));
      });
  return is_taken ? result.get() : DrainingStatus();
}

void Scheduler::Complete(std::function<void()> function) {
  core_->completions().Push(std::move(function));
}

Status Scheduler::Submit(StepWork work) {
  return core_->Submit(std::move(work));
}

Status Scheduler::ReadStates(std::vector<std::shared_ptr<ClothRuntime>> cloths,
                             const StateFields& fields,
                             std::function<void(Result<ClothStates>)> done,
                             const std::string& session, const std::string& tenant,
                             const CancelToken& cancel) {
  DRAPE_CHECK(fields.any(), "nothing to read");
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit, core_->read_permits().Take(session, tenant));
  const std::shared_ptr<ReadUnderWay> read(
      new ReadUnderWay{core_.get(), OwnerOf(session, tenant), SlicedRead(std::move(cloths), fields),
                       std::move(done), std::move(permit), cancel});
  return core_->Post(read->owner, [read](Backend& backend) { ContinueRead(read, backend); });
}

Status Scheduler::ReadForDrawing(std::vector<std::shared_ptr<ClothRuntime>> cloths,
                                 const StateFields& fields, bool on_device,
                                 std::function<void(Result<ClothStates>)> done,
                                 const std::string& session, const std::string& tenant,
                                 const CancelToken& cancel) {
  DRAPE_CHECK(fields.any(), "nothing to read");
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit, core_->read_permits().Take(session, tenant));
  return core_->Post(OwnerOf(session, tenant),
                     [cloths = std::move(cloths), fields, on_device, done = std::move(done),
                      in_flight = std::move(permit), cancel](Backend& backend) mutable {
                       const Status readable = CheckReadable(cloths, cancel);
                       Result<ClothStates> states = WithinMemory([&]() -> Result<ClothStates> {
                         if (!readable.ok()) return readable;
                         return ReadForPicture(backend, cloths, fields, on_device);
                       });
                       if (states.ok()) states->in_flight = std::move(in_flight);
                       in_flight.reset();
                       done(std::move(states));
                     });
}

Result<std::shared_ptr<Observer>> Scheduler::Subscribe(ObserverSpec spec) {
  DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<void> permit,
                         core_->observer_permits().Take(spec.session, spec.tenant));
  auto observer = std::make_shared<Observer>(
      [core = std::weak_ptr<Core>(core_)] {
        if (const std::shared_ptr<Core> alive = core.lock()) alive->Wake();
      },
      std::move(permit));
  observer->AddCredit(spec.initial_credit);
  const std::string owner = OwnerOf(spec.session, spec.tenant);
  DRAPE_RETURN_IF_ERROR(
      core_->Post(owner, [core = core_.get(), spec = std::move(spec), observer](Backend&) mutable {
        core->observers().Add(std::move(spec), std::move(observer));
      }));
  return observer;
}

Result<std::shared_ptr<void>> Scheduler::TakeSubscription(const std::string& session,
                                                          const std::string& tenant) {
  return core_->observer_permits().Take(session, tenant);
}

void Scheduler::Drain(int64_t grace_us, DeviceCommand last, const CancelToken& hurry) {
  core_->Drain(grace_us, std::move(last), hurry);
}

bool Scheduler::is_draining() const {
  return core_->is_draining();
}

SchedulerCounters Scheduler::counters() const {
  return core_->counters();
}

QueuedRequests Scheduler::queued_requests() const {
  return core_->queued_requests();
}

RateQuota& Scheduler::rates() {
  return core_->rates();
}

void Scheduler::HoldForTest() {
  core_->Hold();
}

void Scheduler::ReleaseForTest() {
  core_->Release();
}

}  // namespace drape
