#include "server/scheduler/device_loop.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <utility>

#include "server/core/check.h"
#include "server/core/memory_reserve.h"
#include "server/core/trace.h"
#include "server/scheduler/sleep_looks.h"
#include "server/scheduler/state_reading.h"

namespace drape {
namespace {
// A batch that takes so many times its budget is ended, and what it has not done is left undone
// [-]. Larger: others wait longer for steps that take longer than anybody expected; smaller: more
// is done twice on a machine that is busy with something else.
constexpr int64_t kMostBudgets = 2;

bool IsMoving(const RigidMotion& motion) {
  return !motion.velocity_m_per_s.isZero(0) || !motion.angular_velocity_rad_per_s.isZero(0);
}

// Whether the step of `item`, whose targets are set, differs from the last one of the cloth.
bool ActsOnCloth(const ClothControls& controls, const StepItem& item) {
  return controls.has_news() ||
         std::any_of(item.collider_motions.begin(), item.collider_motions.end(), IsMoving);
}

}  // namespace

DeviceLoop::DeviceLoop(Backend& backend, const Settings& settings, const Clock& clock,
                       EndedCallback ended, RoundCounters& counters, RateQuota& rates)
    : backend_(backend),
      has_cheap_impulses_(backend.Describe().has_cheap_impulses),
      settings_(settings),
      clock_(clock),
      ended_(std::move(ended)),
      counters_(counters),
      rates_(rates) {}

void DeviceLoop::Admit(StepWork work, int64_t submitted_us) {
  const uint32_t session = sessions_.Enter(work.owner());
  requests_.push_back(
      std::make_unique<ActiveRequest>(std::move(work), submitted_us, session, round_));
  requests_.back()->EnterTurns();
}

std::optional<int64_t> DeviceLoop::RunRound() {
  StartAndFinish();
  const std::vector<Part> parts = SelectParts();
  if (parts.empty()) {
    GiveAnswers();
    return std::nullopt;
  }
  const bool is_long =
      parts.size() == 1 && parts[0].units == 1 && IsLong(*parts[0].request, parts[0].cloths);
  int64_t batch_us = 0;
  {
    trace::Span span("batch");
    batch_us = is_long ? StepPiece(parts) : StepBatch(parts);
    span.Add("requests", static_cast<int64_t>(parts.size()));
    span.Add("is_piece", is_long);
  }
  StartAndFinish();
  return batch_us;
}

void DeviceLoop::StartAndFinish() {
  for (std::vector<RequestPointer> over = StartAndEnd(); !over.empty(); over = StartAndEnd()) {
    Finish(std::move(over));
  }
}

std::vector<DeviceLoop::RequestPointer> DeviceLoop::StartAndEnd() {
  std::vector<RequestPointer> over;
  const int64_t now_us = clock_.NowUs();
  // In order of arrival: a request that ends without an answer passes its turns to later ones only.
  for (auto entry = requests_.begin(); entry != requests_.end();) {
    ActiveRequest& request = **entry;
    const std::optional<int64_t> held_us = HeldBackUntil_us(request, now_us);
    EndIfPointless(request, now_us, held_us);
    if (!request.end_status() && !request.has_started() && request.may_start() && !held_us &&
        request.LooksReady(backend_)) {
      const Status status = request.Start(backend_, settings_.max_steps_per_request);
      if (!status.ok()) request.EndWith(status);
    }
    if (!request.end_status().has_value() && !request.is_done()) {
      ++entry;
      continue;
    }
    DropLongStep(&request);
    if (first_to_begin_ == &request) first_to_begin_ = nullptr;
    if (request.end_status()) request.LeaveTurns();
    sessions_.Leave(request.work().owner());
    over.push_back(std::move(*entry));
    entry = requests_.erase(entry);
  }
  return over;
}

void DeviceLoop::EndIfPointless(ActiveRequest& request, int64_t now_us,
                                std::optional<int64_t> held_back_until_us) {
  if (request.is_done()) return;
  const StepWork& work = request.work();
  if (work.cancel.is_cancelled()) {
    request.EndWith({StatusCode::kCancelled, "CANCELLED",
                     "the client cancelled the request, or its deadline passed; complete steps "
                     "stay: read `step`"});
  }
  if (request.has_started()) return;
  if (work.deadline_us <= now_us) {
    request.EndWith({StatusCode::kCancelled, "DEADLINE_PASSED",
                     "the deadline of the request passed before it started; nothing is done"});
  }
  if (!held_back_until_us || *held_back_until_us <= work.deadline_us) return;
  Status status(StatusCode::kResourceExhausted, "RATE_EXCEEDED",
                "max_particle_substeps_per_s_per_tenant is " +
                    std::to_string(static_cast<uint64_t>(rates_.LimitOf(work.tenant))) +
                    ": no step may begin before the deadline of the request");
  request.EndWith(status.RetryAfterMs((*held_back_until_us - now_us) / 1000 + 1));
}

std::optional<int64_t> DeviceLoop::HeldBackUntil_us(const ActiveRequest& request,
                                                    int64_t now_us) const {
  if (!rates_.has_limits()) return std::nullopt;
  if (HasLongStep(request)) return std::nullopt;
  const int64_t until_us = rates_.WaitUntil_us(request.work().tenant);
  return until_us > now_us ? std::optional(until_us) : std::nullopt;
}

std::optional<int64_t> DeviceLoop::RestUntil_us() const {
  if (requests_.empty()) return std::nullopt;
  const int64_t now_us = clock_.NowUs();
  int64_t rest_us = now_us + kLook_us;
  for (const RequestPointer& request : requests_) {
    if (!request->may_start()) continue;  // behind another one, or a command that holds a cloth
    const std::optional<int64_t> until_us = HeldBackUntil_us(*request, now_us);
    if (!until_us && request->is_ready()) return std::nullopt;
    rest_us = std::min(rest_us, until_us.value_or(now_us + kLookForKernels_us));
  }
  return rest_us;
}

std::vector<DeviceLoop::Part> DeviceLoop::SelectParts() {
  const double us_per_cost =
      static_cast<double>(settings_.batch_budget_us) / settings_.batch.max_cost;
  std::vector<RunnableRequest> runnable;
  std::vector<ActiveRequest*> requests;
  const int64_t now_us = clock_.NowUs();
  const ActiveRequest* first = FirstToBegin(now_us);
  for (const RequestPointer& request : requests_) {
    if (!request->has_started() || request->is_held()) continue;
    if (HeldBackUntil_us(*request, now_us) || MustWait(*request, first)) continue;
    runnable.push_back({request->session(),
                        request->Costs(rate_, us_per_cost, settings_.batch.max_cost),
                        request->last_round(), rates_.WeightOf(request->work().tenant)});
    requests.push_back(request.get());
  }
  first_to_begin_ = first;
  if (runnable.empty()) return {};
  ++round_;
  BatchChoice choice = SelectBatch(runnable, share_, settings_.batch);
  share_ = std::move(choice.share);
  std::vector<Part> parts;
  for (const BatchTake& take : choice.takes) {
    ActiveRequest* request = requests[take.request];
    parts.push_back({request, request->Take(take.count, round_), take.count});
  }
  return parts;
}

std::vector<StepItem> DeviceLoop::ItemsOf(const std::vector<Part>& parts) const {
  std::vector<StepItem> items;
  for (const Part& part : parts) {
    const auto& cloths = part.request->work().cloths;
    std::span<const uint32_t> rest = part.cloths;
    while (!rest.empty()) {
      const ClothWorld* const world = cloths[rest[0]]->world().get();
      const size_t count = world == nullptr ? 1 : world->members().size();
      AddItems(*part.request, rest.first(count), items);
      rest = rest.subspan(count);
    }
  }
  return items;
}

void DeviceLoop::AddItems(const ActiveRequest& request, std::span<const uint32_t> unit,
                          std::vector<StepItem>& items) const {
  const size_t first = items.size();
  const ClothWorld* const world = request.work().cloths[unit[0]]->world().get();
  bool must_wake = world != nullptr && !world->AreWatchesAlike();
  for (size_t n = 0; n < unit.size(); ++n) {
    ClothRuntime& cloth = *request.work().cloths[unit[n]];
    must_wake |=
        request.AsksImpulses(unit[n]) && cloth.MustWakeForImpulses(request.AsksContacts(unit[n]));
    StepItem& item = items.emplace_back();
    item.cloth = cloth.handle();
    item.max_iterations = cloth.budget().Cap();
    item.energy = cloth.energy();
    if (world != nullptr) item.world = {world->number(), world->members()[n].origin_m};
    if (cloth.is_faulted()) continue;
    cloth.controls().SetTargets(cloth.now().time_s, cloth.NextTime_s(), item);
    must_wake |= ActsOnCloth(cloth.controls(), item);
  }
  for (size_t n = 0; n < unit.size(); ++n) {
    ClothRuntime& cloth = *request.work().cloths[unit[n]];
    if (must_wake && !cloth.is_faulted()) cloth.sleep().Wake();
    StepItem& item = items[first + n];
    item.measure = request.IsMeasured(unit[n]) || cloth.sleep().decides_next();
    item.impulses = request.AsksImpulses(unit[n]) || cloth.WantsImpulses(has_cheap_impulses_);
    item.contact_impulses = request.AsksContacts(unit[n]) || cloth.WantsContacts();
  }
  if (request.work().cloths[unit[0]]->sleep().is_asleep()) items.resize(first);
}

int64_t DeviceLoop::CostOf(const BatchReport& batch, int64_t wall_us) const {
  if (!RunsAhead()) return wall_us;
  return batch.upload_us + batch.device_us + batch.readback_us;
}

int64_t DeviceLoop::StepBatch(const std::vector<Part>& parts) {
  const std::vector<StepItem> items = ItemsOf(parts);
  const int64_t begin_us = clock_.NowUs();
  BatchReport batch;
  if (items.empty()) {
    GiveAnswers();
  } else {
    trace::Span span("step");
    const Pause pause = Pause::After_us(kMostBudgets * settings_.batch_budget_us);
    batch = RunsAhead() ? backend_.device()->StepAhead(items, pause, [this] { GiveAnswers(); })
                        : backend_.StepUntil(items, pause);
    span.Add("cloths", static_cast<int64_t>(items.size()));
    span.Add("dispatches", batch.dispatch_count);
  }
  DRAPE_CHECK(batch.reports.size() == items.size(), "one report per item");
  return EndBatch(parts, std::move(batch), begin_us, 0);
}

int64_t DeviceLoop::EndBatch(const std::vector<Part>& parts, BatchReport batch, int64_t begin_us,
                             double spent_us) {
  const int64_t stepped_us = clock_.NowUs();
  const auto cost_us = static_cast<double>(CostOf(batch, stepped_us - begin_us));
  const auto cloths = static_cast<uint32_t>(batch.reports.size());
  MeasureCosts(parts, batch.reports, spent_us + cost_us);
  const std::vector<Part> done = WithoutUndone(parts, batch.reports);
  Charge(done);
  CompleteSteps(done, batch.reports, spent_us + cost_us);
  LookAtCloths(backend_, ClothsOf(done));
  const int64_t end_us = clock_.NowUs();
  batch.readback_us += end_us - stepped_us;
  for (const Part& part : parts) {
    part.request->AddBatch(batch, cloths, static_cast<uint32_t>(parts.size()), begin_us, end_us);
  }
  ++counters_.rounds;
  counters_.dispatches += batch.dispatch_count;
  counters_.batch_durations.Add(end_us - begin_us);
  return end_us - begin_us;
}

void DeviceLoop::CompleteSteps(const std::vector<Part>& parts,
                               const std::vector<StepReport>& reports, double cost_us) {
  size_t next = 0;
  uint64_t faults = 0, asleep = 0;
  for (const Part& part : parts) {
    for (const uint32_t k : part.cloths) {
      ClothRuntime& cloth = *part.request->work().cloths[k];
      if (cloth.sleep().is_asleep()) {
        part.request->CompleteStep(k, cloth.sleep().report());
        cloth.CompleteStepAsleep();
        ++asleep;
        continue;
      }
      const StepReport report = cloth.budget().Measured(reports[next++], cost_us);
      faults += report.fault != FaultReason::kNone && !cloth.is_faulted();
      part.request->CompleteStep(k, report);
      cloth.CompleteStep(report);
    }
  }
  counters_.cloth_steps += reports.size() + asleep;
  counters_.cloth_steps_asleep += asleep;
  counters_.faults += faults;
}

void DeviceLoop::Charge(const std::vector<Part>& parts) {
  const std::string* tenant = nullptr;
  double work = 0;
  const auto charge = [&] {
    if (work > 0) rates_.Charge(*tenant, std::exchange(work, 0));
  };
  for (const Part& part : parts) {
    const StepWork& step = part.request->work();
    if (tenant == nullptr || *tenant != step.tenant) charge();
    tenant = &step.tenant;
    for (const uint32_t k : part.cloths) {
      const ClothRuntime& cloth = *step.cloths[k];
      if (!cloth.is_idle()) work += cloth.work_per_step();
    }
  }
  charge();
}

void DeviceLoop::MeasureCosts(const std::vector<Part>& parts,
                              const std::vector<StepReport>& reports, double cost_us) {
  std::vector<ClothCost> costs;
  size_t next = 0;
  for (const auto& cloth : ClothsOf(parts)) {
    if (cloth->sleep().is_asleep()) continue;
    const StepReport& report = reports[next++];
    const double solves = cloth->solves_per_step();
    if (solves == 0) continue;
    costs.push_back({&cloth->cost(), solves, report.thread_us, report.is_undone});
  }
  const DoneWork done = ShareCost(costs, cost_us);
  if (done.solves > 0) rate_.Measured(done.solves, done.cost_us);
}

std::vector<DeviceLoop::Part> DeviceLoop::WithoutUndone(const std::vector<Part>& parts,
                                                        std::vector<StepReport>& reports) const {
  std::vector<Part> done = parts;
  size_t next = 0;
  for (Part& part : done) {
    std::erase_if(part.cloths, [&](uint32_t k) {
      ClothRuntime& cloth = *part.request->work().cloths[k];
      const bool is_undone = !cloth.sleep().is_asleep() && reports[next++].is_undone;
      if (is_undone) cloth.controls().SendAgain();
      // It costs nothing by its solves, and yet its report does.
      if (is_undone && cloth.is_faulted()) cloth.SetInPieces(true);
      return is_undone;
    });
  }
  std::erase_if(reports, [](const StepReport& report) { return report.is_undone; });
  return done;
}

std::vector<std::shared_ptr<ClothRuntime>> DeviceLoop::ClothsOf(const std::vector<Part>& parts) {
  std::vector<std::shared_ptr<ClothRuntime>> cloths;
  for (const Part& part : parts) {
    for (const uint32_t k : part.cloths) cloths.push_back(part.request->work().cloths[k]);
  }
  return cloths;
}

void DeviceLoop::BeginViews(Answers& ended) {
  using FieldsReference = std::reference_wrapper<const StateFields>;
  std::map<FieldsReference, std::vector<size_t>, std::less<StateFields>> wanting;
  for (size_t k = 0; k < ended.answers.size(); ++k) {
    const auto& [work, outcome] = ended.answers[k];
    if (outcome.status.ok() && work.view.any()) wanting[work.view].push_back(k);
  }
  for (auto& [fields, answers] : wanting) {
    std::vector<ClothSpan> receivers;
    for (const size_t k : answers) receivers.push_back(ended.answers[k].work.cloths);
    const int64_t begin_us = clock_.NowUs();
    const Status begun = WithinMemory([&] {
      ended.views.push_back({answers, begin_us, SharedRead(backend_, receivers, fields)});
      return Status::Ok();
    });
    for (const size_t k : answers) ended.answers[k].outcome.states_status = begun;
  }
}

void DeviceLoop::TakeView(View& view, std::vector<Answer>& answers) {
  const trace::Span span("read_states");
  auto columns = WithinMemory([&] { return Result(view.read.Take()); });
  const int64_t end_us = clock_.NowUs();
  for (size_t k = 0; k < view.answers.size(); ++k) {
    StepOutcome& outcome = answers[view.answers[k]].outcome;
    outcome.states_status = columns.status();
    if (columns.ok()) outcome.states = std::move((*columns)[k]);
    outcome.timing.readback_us += end_us - view.begin_us;
    outcome.device_done_us = end_us;
  }
}

void DeviceLoop::Finish(std::vector<RequestPointer> over) {
  if (over.empty()) return;
  Answers ended;
  for (const RequestPointer& request : over) {
    StepOutcome outcome = request->Outcome();
    if (!request->end_status()) request->LeaveTurns();
    outcome.device_done_us = clock_.NowUs();
    counters_.request_durations.Add(outcome.device_done_us - request->submitted_us());
    ended.answers.push_back({std::move(*request).TakeWork(), std::move(outcome)});
  }
  BeginViews(ended);
  answers_.push_back(std::move(ended));
  const auto waits = [](const Answers& some) { return !some.views.empty(); };
  if (!RunsAhead() || std::ranges::none_of(answers_, waits)) GiveAnswers();
}

void DeviceLoop::GiveAnswers() {
  for (Answers& ended : std::exchange(answers_, {})) {
    for (View& view : ended.views) TakeView(view, ended.answers);
    for (Answer& answer : ended.answers) ended_(std::move(answer.work), std::move(answer.outcome));
  }
}

std::vector<std::string> DeviceLoop::UnansweredSessions() const {
  std::vector<std::string> sessions;
  for (const Answers& ended : answers_) {
    for (const Answer& answer : ended.answers) sessions.push_back(answer.work.session);
  }
  return sessions;
}

void DeviceLoop::EndAll(const Status& status) {
  for (const RequestPointer& request : requests_) request->EndWith(status);
  Finish(StartAndEnd());
  GiveAnswers();
}

}  // namespace drape
